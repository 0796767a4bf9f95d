"""Exact codes for each eye's pixels, in every mode, by reading the framebuffer back."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.errors import MeasuringError
from runner.measuring.code_screen import CodeScreen, EyeCodes
from runner.presenter import MODES, ModeOptions, PresentationError, Surface, find_mode, open_surface
from runner.presenter.depth import Bits
from tests.choice import nightly
from tests.runner.families import by_family

SIZE = (63, 48)  # an odd width: what halves of it do must hold
OFFSCREEN = [name for name in MODES if name != "quad-buffered"]  # needs a stereo driver: see tests/quad


def _open(mode: str, bits: Bits = 8, backend: str = "egl") -> Surface:
    try:
        surface = open_surface(backend, SIZE, windows=find_mode(mode).windows, bits=bits)
    except PresentationError as error:
        pytest.skip(str(error))
    if surface.bits != bits:
        surface.close()
        pytest.skip(f"this driver gives {surface.bits} bits")
    return surface


def _codes(screen: CodeScreen, *numbers: int) -> Any:
    return tuple(number / screen.highest for number in numbers)


@pytest.mark.parametrize("bits", [8, 10])
@pytest.mark.parametrize("mode", by_family(OFFSCREEN))
def test_all_pixels_of_an_eye_have_exactly_the_code(mode: str, bits: Bits) -> None:
    with _open(mode, bits) as surface, CodeScreen(surface, find_mode(mode)) as screen:
        top = screen.highest
        for left in ((0, 0, 0), (1, 127, top), (top, top - 1, 128), (top, top, top), (13, 200, 77)):
            right = left if screen.shared else (top - left[0], 3, left[1])
            screen.show(EyeCodes(_codes(screen, *left), _codes(screen, *right)))
            assert np.all(screen.seen_by("left") == left)
            assert np.all(screen.seen_by("right") == right)


@pytest.mark.parametrize("mode", by_family(name for name in OFFSCREEN if name != "flat" and "anaglyph" not in name))
@pytest.mark.parametrize("eye", ["left", *nightly("right")])
def test_the_other_eye_sees_black(mode: str, eye: str) -> None:
    with _open(mode) as surface, CodeScreen(surface, find_mode(mode)) as screen:
        screen.show(EyeCodes.of((1.0, 0.2, 0.4), eye))
        seen = {name: screen.seen_by(name) for name in ("left", "right")}
        assert np.all(seen[eye] == (255, 51, 102))
        assert np.all(seen["left" if eye == "right" else "right"] == 0)


def test_every_8_bit_code_of_every_channel_comes_back() -> None:
    with _open("checkerboard") as surface, CodeScreen(surface, find_mode("checkerboard")) as screen:
        for code in range(256):
            screen.show(EyeCodes.of(_codes(screen, code, 255 - code, code ^ 0x55), "both"))
            assert np.all(screen.seen_by("left") == (code, 255 - code, code ^ 0x55))


@settings(max_examples=10, deadline=None)
@given(st.sampled_from(OFFSCREEN), st.booleans())
def test_areas_of_the_two_eyes_tile_what_the_mode_uses(mode: str, swapped: bool) -> None:
    options = ModeOptions(swap_eyes=swapped)
    with _open(mode) as surface, CodeScreen(surface, find_mode(mode, options)) as screen:
        screen.show(EyeCodes.of((1.0, 1.0, 1.0), "both"))
        for codes in screen.capture().values():
            unused = SIZE[0] % 2 * SIZE[1] if "side-by-side" in mode else 0
            assert (codes == 0).all(axis=-1).sum() == unused


def test_a_sync_line_stays_and_is_no_part_of_the_patch() -> None:
    mode = find_mode("frame-sequential", ModeOptions(sync_line=True))
    with _open("frame-sequential") as surface, CodeScreen(surface, mode) as screen:
        screen.show(EyeCodes((0.2, 0.4, 0.6), (0.6, 0.4, 0.2)))
        captured = screen.capture()
        assert np.all(captured["left"][:-1] == (51, 102, 153))
        assert np.all(captured["right"][:-1] == (153, 102, 51))
        assert np.all(captured["left"][-1, : SIZE[0] // 4] == (0, 0, 255))
        assert np.all(captured["left"][-1, SIZE[0] // 4 :] == 0)
        assert np.all(captured["right"][-1, : 3 * SIZE[0] // 4] == (0, 0, 255))
        assert len(screen.seen_by("left")) == SIZE[0] * (SIZE[1] - 1)


def test_frames_in_turn_go_on_in_turn() -> None:
    with _open("frame-sequential") as surface, CodeScreen(surface, find_mode("frame-sequential")) as screen:
        assert screen.takes_turns
        screen.show(EyeCodes((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
        seen = []
        for _ in range(4):
            screen.redraw()
            seen.append(tuple(surface.read()[0, 0]))
        assert seen in ([(255, 0, 0), (0, 255, 0)] * 2, [(0, 255, 0), (255, 0, 0)] * 2)


@pytest.mark.parametrize("mode", ["flat", "anaglyph-red-cyan"])
def test_different_codes_need_different_pixels(mode: str) -> None:
    with (
        _open(mode) as surface,
        CodeScreen(surface, find_mode(mode)) as screen,
        pytest.raises(MeasuringError, match="the same pixels"),
    ):
        screen.show(EyeCodes.of((1.0, 0.0, 0.0), "left"))


def test_a_window_without_a_screen_shows_codes_too() -> None:
    mode = find_mode("row-interleaved")
    with _open("row-interleaved", backend="null") as surface, CodeScreen(surface, mode) as screen:
        screen.show(EyeCodes((0.2, 0.4, 0.6), (0.6, 0.4, 0.2)))
        codes = screen.capture()["screen"]
    for row, eye in zip(codes, itertools.cycle([(51, 102, 153), (153, 102, 51)]), strict=False):
        assert np.all(row == eye)


def test_what_was_lost_is_drawn_again() -> None:
    with _open("flat") as surface, CodeScreen(surface, find_mode("flat")) as screen:
        screen.show(EyeCodes.of((1.0, 0.0, 1.0), "both"))
        surface.target(next(iter(screen.mode.areas(SIZE))).buffer).clear(0.3, 0.3, 0.3)
        assert surface.on_damage is not None
        surface.on_damage()
        assert np.all(surface.read() == (255, 0, 255))
    assert surface.on_damage is None


def test_a_surface_that_cannot_do_the_mode_is_refused() -> None:
    with _open("flat") as surface, pytest.raises(PresentationError, match="no right back buffer"):
        CodeScreen(surface, find_mode("quad-buffered"))
