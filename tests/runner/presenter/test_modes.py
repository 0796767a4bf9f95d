"""Modes: where each eye's pixels are, and the refusal of what a surface cannot show."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import cycle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.compensation import Rectangle
from devices.display import EyeModels
from runner import Picture, Scene
from runner.presenter import MODES, Buffer, GraphicsError, ModeOptions, PresentationError, Presenter, find_mode
from runner.presenter.modes.mode import Weave
from runner.presenter.modes.registry import available, require
from runner.presenter.surfaces import gl_calls
from runner.presenter.surfaces.egl import EglSurface
from runner.presenter.surfaces.gl_calls import GlCalls
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.runner.families import FAMILIES

SIZES = st.tuples(st.integers(2, 4000), st.integers(1, 3000))


@dataclass
class FakeDriver:
    """A loader whose functions note how they were called; ``stereo`` is what it answers to GL_STEREO."""

    stereo: bool
    calls: list[tuple[str, int]] = field(default_factory=list)
    kept: list[Any] = field(default_factory=list)

    def load(self, name: str) -> int:
        function: Any
        if name == "glGetBooleanv":
            pointer = ctypes.POINTER(ctypes.c_ubyte)

            def get(key: int, value: Any) -> None:
                self.calls.append((name, key))
                value[0] = int(self.stereo) if key == 0x0C33 else 1

            function = ctypes.CFUNCTYPE(None, ctypes.c_uint, pointer)(get)
        else:
            function = ctypes.CFUNCTYPE(None, ctypes.c_uint)(lambda value: self.calls.append((name, value)))
        self.kept.append(function)
        return ctypes.cast(function, ctypes.c_void_p).value or 0


@dataclass
class FakeSurface:
    """As much of a surface as choosing a mode needs."""

    stereo: bool
    size_px: tuple[int, int] = (1920, 1080)
    windows: int = 1


@pytest.mark.parametrize("stereo", [True, False])
def test_the_driver_is_asked_for_stereo_and_for_each_eyes_buffer(stereo: bool) -> None:
    driver = FakeDriver(stereo)
    calls = GlCalls(driver.load)
    assert calls.has_stereo() == stereo
    calls.draw_to(gl_calls.BACK_LEFT)
    calls.draw_to(gl_calls.BACK_RIGHT)
    assert driver.calls == [("glGetBooleanv", 0x0C33), ("glDrawBuffer", 0x0402), ("glDrawBuffer", 0x0403)]


def test_a_driver_without_a_call_is_named() -> None:
    with pytest.raises(GraphicsError, match="no glDrawBuffer"):
        GlCalls(lambda name: 0)


def test_quad_buffered_is_refused_without_a_right_back_buffer_and_says_what_would_do() -> None:
    surface: Any = FakeSurface(stereo=GlCalls(FakeDriver(stereo=False).load).has_stereo())
    with pytest.raises(
        PresentationError, match=r"GL_STEREO is false\) \(available here: flat, side-by-side, .*checkerboard, "
    ):
        require(find_mode("quad-buffered"), surface)
    surface = FakeSurface(stereo=GlCalls(FakeDriver(stereo=True).load).has_stereo())
    require(find_mode("quad-buffered"), surface)
    reasons = available(surface)
    assert {name for name, reason in reasons.items() if reason} == {"dual-window"}
    surface = FakeSurface(stereo=False, windows=2)
    assert {name for name, reason in available(surface).items() if reason} == {"quad-buffered"}


def test_the_presenter_refuses_it_before_anything_is_made(egl: EglSurface, same_models: EyeModels) -> None:
    with pytest.raises(PresentationError, match="GL_STEREO is false"):
        Presenter(egl, find_mode("quad-buffered"), same_models, lambda name: pytest.fail(name))


def test_an_offscreen_surface_has_one_buffer(egl: EglSurface) -> None:
    with pytest.raises(PresentationError, match="no buffer 'back right'"):
        egl.target(Buffer.BACK_RIGHT)
    with pytest.raises(PresentationError, match="no buffer 'back left'"):
        egl.read("left")


def test_an_unknown_mode_is_answered_with_the_nearest() -> None:
    with pytest.raises(PresentationError, match="did you mean 'side-by-side'"):
        find_mode("side_by_side")
    with pytest.raises(PresentationError, match=r"expected one of: flat, side-by-side, .*quad-buffered"):
        find_mode("hologram")


@given(SIZES)
def test_the_halves_are_equal_apart_and_left_eye_left(size_px: tuple[int, int]) -> None:
    left, right = find_mode("side-by-side").areas(size_px)
    assert (left.eyes, right.eyes) == (("left",), ("right",))
    assert left.rectangle.size_px == right.rectangle.size_px == (size_px[0] // 2, size_px[1])
    assert left.rectangle.left == 0
    assert right.rectangle.left + right.rectangle.width == size_px[0]
    assert left.rectangle.intersection(right.rectangle).is_empty


@pytest.mark.parametrize("name", MODES)
def test_every_mode_serves_both_eyes_once_within_the_surface(name: str) -> None:
    areas = find_mode(name).areas((1920, 1080))
    assert sorted(eye for area in areas for eye in area.eyes) == ["left", "right"]
    for area in areas:
        assert area.rectangle.intersection(Rectangle(0, 0, 1920, 1080)) == area.rectangle


def test_a_surface_one_pixel_wide_has_no_halves() -> None:
    assert find_mode("side-by-side").unavailable((1, 5), stereo=False) == "a surface 1 px wide has no two halves"


@given(SIZES, SIZES, st.tuples(st.integers(-50, 50), st.integers(-50, 50)))
def test_centring_is_by_floor(area: tuple[int, int], size: tuple[int, int], offset: tuple[int, int]) -> None:
    place = Rectangle(7, 11, *area).centred(size, offset)
    assert place.left == 7 + (area[0] - size[0]) // 2 + offset[0]
    assert place.top == 11 + (area[1] - size[1]) // 2 + offset[1]
    assert place.size_px == size


def test_unknown_backends_are_answered_with_the_nearest() -> None:
    from runner.presenter import open_surface

    with pytest.raises(PresentationError, match="did you mean 'window'"):
        open_surface("windo", (10, 10))


@pytest.mark.parametrize("size_px", [(0, 10), (10, 10**6)])
def test_a_size_that_cannot_be_made_is_refused(size_px: tuple[int, int], egl: EglSurface) -> None:
    egl.close()
    with pytest.raises(PresentationError, match="cannot be made; this driver goes to"):
        EglSurface(size_px)


# A rig's mode options, and what is said of those that cannot be.


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


# Marks for instruments: a photodiode's square, and the line that tells whose frame it is.


CORNERS = {
    "top-left": (slice(0, 30), slice(0, 30)),
    "top-right": (slice(0, 30), slice(-30, None)),
    "bottom-left": (slice(-30, None), slice(0, 30)),
    "bottom-right": (slice(-30, None), slice(-30, None)),
}
ELSEWHERE = ("quad-buffered", "flat", "dual-window")  # these need other windows, or have one picture for both eyes


def _marks(mode: str, its_own: bool) -> tuple[pytest.MarkDecorator, ...]:
    return (() if mode in FAMILIES else (pytest.mark.nightly,)) if its_own else (pytest.mark.stress,)


@pytest.mark.parametrize(
    ("mode", "corner"),
    [
        pytest.param(mode, corner, marks=_marks(mode, corner == its_own))
        for mode, its_own in zip((name for name in MODES if name not in ELSEWHERE), cycle(CORNERS))
        for corner in CORNERS
    ],
)
def test_the_square_turns_with_each_new_scene_and_covers_nothing_else(
    small_egl: EglSurface,
    mode: str,
    corner: str,
    random_stereo: Callable[..., StereoImage],
    same_models: EyeModels,
) -> None:
    pictures = {name: random_stereo(120, 160, seed) for seed, name in enumerate("ab")}
    marked = find_mode(mode, ModeOptions.parse({"photodiode_corner": corner, "photodiode_size_px": 30}))
    with Presenter(small_egl, find_mode(mode), same_models, pictures.__getitem__) as presenter:
        presenter.show(Scene((Picture("a"),)))
        plain = presenter.capture()
    with Presenter(small_egl, marked, same_models, pictures.__getitem__) as presenter:
        levels = []
        for name in "abbab":
            presenter.show(Scene((Picture(name),)))
            presenter.redraw()
            captured = presenter.capture()
            for key, codes in captured.items():
                square = codes[CORNERS[corner]]
                assert square.min() == square.max()
                if name == "a":
                    without = plain[key].copy()
                    without[CORNERS[corner]] = square
                    np.testing.assert_array_equal(codes, without)
            levels.append(int(square[0, 0, 0]))
    assert levels == [255, 0, 0, 255, 0]


def test_a_square_larger_than_the_surface_is_the_surface() -> None:
    mode = find_mode("flat", ModeOptions(photodiode_corner=(True, True), photodiode_size_px=500))
    assert mode.patch((40, 30)) == Rectangle(10, 0, 30, 30)
    assert find_mode("flat").patch((40, 30)) is None


@pytest.mark.parametrize("swapped", [False, True])
def test_the_line_tells_whose_frame_it_is(
    egl: EglSurface, swapped: bool, random_stereo: Callable[..., StereoImage], same_models: EyeModels
) -> None:
    picture = random_stereo(480, 640)
    mode = find_mode("frame-sequential", ModeOptions(sync_line=True, swap_eyes=swapped))
    with Presenter(egl, mode, same_models, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("a"), Text("Which?"))))
        captured = presenter.capture()
    for eye, blue_px in (("left", 160), ("right", 480)):
        row = captured[eye][-1]
        assert (row[:blue_px] == (0, 0, 255)).all()
        assert not row[blue_px:].any()
        assert captured[eye][-2].any(axis=1).all()


def test_quad_buffered_has_a_line_in_each_eyes_buffer() -> None:
    left, right = find_mode("quad-buffered", ModeOptions(sync_line=True)).areas((1920, 1080))
    assert (left.buffer, left.sync_line) == (Buffer.BACK_LEFT, Rectangle(0, 1079, 480, 1))
    assert (right.buffer, right.sync_line) == (Buffer.BACK_RIGHT, Rectangle(0, 1079, 1440, 1))


@pytest.mark.parametrize("mode", ["flat", "side-by-side", "row-interleaved", "anaglyph-red-cyan"])
def test_a_line_has_no_place_where_both_eyes_share_a_frame(mode: str) -> None:
    with pytest.raises(PresentationError, match=f"'{mode}' shows both eyes in one frame"):
        find_mode(mode, ModeOptions(sync_line=True))
