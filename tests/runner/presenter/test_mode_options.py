"""A rig's mode options, and what is said of those that cannot be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.compensation import Rectangle
from runner.presenter import MODES, ModeOptions, PresentationError, find_mode
from runner.presenter.modes.mode import Weave

STEPS = st.sampled_from([(0, 1), (1, 0), (1, 1)])
PLACES = st.tuples(st.integers(-9, 9), st.integers(-9, 9))


def test_a_rig_that_says_nothing_adjusts_nothing() -> None:
    assert ModeOptions.parse({}) == ModeOptions()
    for name, mode in MODES.items():
        assert type(find_mode(name, ModeOptions())) is type(mode)


def test_every_option_is_read() -> None:
    options = ModeOptions.parse(
        {"swap_eyes": True, "left_offset_px": [3, -2], "left_mirror": "horizontal", "right_mirror": "both"}
    )
    assert options == ModeOptions(True, (3, -2), (0, 0), (True, False), (True, True))


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"swap_eye": True}, r"unknown mode option 'swap_eye' \(did you mean 'swap_eyes'"),
    ({"colour": 1}, r"unknown mode option 'colour' \(expected one of: swap_eyes, "),
    ({"swap_eyes": "yes"}, r"'swap_eyes' is 'yes' \(expected true or false"),
    ({"left_offset_px": [1.5, 0]}, r"'left_offset_px' is \[1.5, 0\] \(expected two whole numbers"),
    ({"left_offset_px": [True, 0]}, "expected two whole numbers"),
    ({"right_offset_px": 3}, "expected two whole numbers"),
    ({"left_mirror": "horizontaly"}, "did you mean 'horizontal'"),
    ({"left_mirror": True}, "expected one of: none, horizontal, vertical, both"),
    ({"photodiode_corner": "top left"}, "did you mean 'top-left'"),
    ({"photodiode_size_px": 0}, "expected a whole number of pixels above 0"),
    ({"photodiode_size_px": True}, "expected a whole number of pixels above 0"),
    ({"sync_line": 1}, "expected true or false"),
]


@pytest.mark.parametrize(("options", "said"), WRONG)
def test_a_wrong_option_is_named_with_what_would_be_right(options: dict[str, Any], said: str) -> None:
    with pytest.raises(PresentationError, match=said):
        ModeOptions.parse(options)


def test_all_faults_are_told_at_once() -> None:
    with pytest.raises(PresentationError) as raised:
        ModeOptions.parse({"swap": 1, "left_mirror": 2, "left_offset_px": "a"})
    assert len(raised.value.findings) == 3


def test_what_both_eyes_share_cannot_be_moved_for_one_of_them() -> None:
    with pytest.raises(PresentationError, match="'flat' shows both eyes the same pixels: it cannot move or mirror"):
        find_mode("flat", ModeOptions(left_offset_px=(1, 0)))
    (both,) = find_mode("flat", ModeOptions(left_offset_px=(1, 0), right_offset_px=(1, 0))).areas((10, 10))
    assert both.offset_px == (1, 0)


@given(STEPS, PLACES, PLACES)
def test_a_weave_is_of_the_panel_wherever_it_is_seen_from(
    steps: tuple[int, int], first: tuple[int, int], second: tuple[int, int]
) -> None:
    weave = Weave(*steps)
    left = max(first[0], second[0])
    top = max(first[1], second[1])
    masks = [
        weave.seen_from(corner).mask(40, 40)[top - corner[1] :, left - corner[0] :][:20, :20]
        for corner in (first, second)
    ]
    np.testing.assert_array_equal(masks[0], masks[1])


@given(STEPS, st.integers(0, 1), st.integers(1, 9), st.integers(1, 9))
def test_every_pixel_is_one_eyes(steps: tuple[int, int], start: int, height: int, width: int) -> None:
    weave = Weave(*steps, start)
    assert (weave.mask(height, width) ^ weave.other().mask(height, width)).all()


@given(
    st.builds(Rectangle, st.integers(-9, 9), st.integers(-9, 9), st.integers(1, 9), st.integers(1, 9)),
    st.builds(Rectangle, st.integers(-9, 9), st.integers(-9, 9), st.integers(1, 9), st.integers(1, 9)),
    st.tuples(st.booleans(), st.booleans()),
)
def test_mirroring_twice_changes_nothing(one: Rectangle, area: Rectangle, mirror: tuple[bool, bool]) -> None:
    assert one.mirrored_in(area, mirror).mirrored_in(area, mirror) == one
    assert area.mirrored_in(area, mirror) == area
