"""Marks for instruments: a photodiode's square, and the line that tells whose frame it is."""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle

import numpy as np
import pytest

from devices.compensation import Rectangle
from devices.display import EyeModels
from runner import Picture, Scene
from runner.presenter import MODES, Buffer, ModeOptions, PresentationError, Presenter, find_mode
from runner.presenter.surfaces.egl import EglSurface
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.runner.families import FAMILIES

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
