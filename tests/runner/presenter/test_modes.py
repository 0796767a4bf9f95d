"""Modes: where each eye's pixels are, and the refusal of what a surface cannot show."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.compensation import Rectangle
from devices.display import EyeModels
from runner.presenter import MODES, Buffer, GraphicsError, PresentationError, Presenter, find_mode
from runner.presenter.modes.registry import available, require
from runner.presenter.surfaces import gl_calls
from runner.presenter.surfaces.egl import EglSurface
from runner.presenter.surfaces.gl_calls import GlCalls

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
