"""Codes of 10 bits: offscreen, and in a window on an X server whose screen has them."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import EYES, DisplayModel, EyeModels
from documents.arrays import Floats
from runner import Picture, Scene
from runner.presenter import (
    Buffer,
    Dithering,
    ModeOptions,
    PresentationError,
    Presenter,
    Surface,
    find_mode,
    open_surface,
)
from runner.presenter.depth import Bits, given_bits
from runner.presenter.surfaces import gl_calls
from runner.presenter.surfaces.egl import EglSurface
from runner.presenter.surfaces.gl_calls import GlCalls
from runner.presenter.surfaces.glfw_session import context_hints
from runner.presenter.words import ink_codes
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.choice import nightly
from tests.runner.presenter.conftest import AskedRamps

MakeModel = Callable[..., DisplayModel]
Stereo = Callable[..., StereoImage]


SCENE = Scene((Picture("a"),))
FULL_CODE = 1023
DISPLAYS = [
    pytest.param({"gamma": 1.6}, id="gamma 1.6", marks=pytest.mark.nightly),
    pytest.param({"gamma": 2.4, "black": 0.05, "lift": 0.003}, id="gamma 2.4, black, lift"),
    pytest.param({"gamma": 2.8}, id="gamma 2.8", marks=pytest.mark.nightly),
]


@pytest.fixture
def deep_egl() -> Iterator[EglSurface]:
    """An offscreen surface of 640 × 480 with codes of 10 bits."""
    try:
        surface = EglSurface((640, 480), bits=10)
    except PresentationError as error:
        pytest.skip(str(error))
    with surface:
        if surface.bits != 10:
            pytest.skip("; ".join(surface.facts.remarks))
        yield surface


def x_screen() -> NDArray[np.int64]:
    """The codes that the X server shows, 640 × 480, from 16 bits that ImageMagick scales them to."""
    tool = shutil.which("import")
    if tool is None:
        pytest.skip("ImageMagick is not installed (apt install imagemagick)")
    command = [tool, "-window", "root", "-depth", "16", "-endian", "LSB", "rgb:-"]
    shot = subprocess.run(command, capture_output=True, check=True, timeout=20)
    values = np.frombuffer(shot.stdout, "<u2").reshape(480, 640, 3)
    return np.asarray(np.rint(values / 65535 * FULL_CODE), dtype=np.int64)


def assert_rounded(codes: NDArray[np.uint8] | NDArray[np.uint16], reference: Floats) -> None:
    """Every code is of 10 bits and within 0.501 of the reference, which more than 8 bits are needed for."""
    assert codes.dtype == np.uint16
    assert codes.max() <= FULL_CODE
    assert np.abs(codes - reference).max() <= 0.501
    assert len(np.unique(codes)) > 900


@pytest.mark.parametrize("display_parameters", DISPLAYS)
def test_every_pixel_is_the_rounded_reference(
    deep_surface: Surface, display_parameters: dict[str, float], ramps_on: Callable[..., AskedRamps]
) -> None:
    """Flat, side by side and woven: 1e-7 cd/m² to above white, in the gamut and out of it."""
    asked = ramps_on(**display_parameters)
    models, picture, left = asked.models, asked.picture, asked.models.left
    with Presenter(deep_surface, find_mode("side-by-side"), models, lambda _: picture) as presenter:
        presenter.show(SCENE)
        assert_rounded(presenter.eye_view("left"), asked.left * FULL_CODE)
        assert_rounded(presenter.eye_view("right"), asked.right * FULL_CODE)
    flat = StereoImage.flat(np.concatenate([picture.left, picture.right], axis=1))
    with Presenter(deep_surface, find_mode("flat"), EyeModels(left, left), lambda _: flat) as presenter:
        presenter.show(SCENE)
        assert_rounded(
            presenter.capture()["screen"], np.concatenate([asked.left, asked.right_on_left], axis=1) * FULL_CODE
        )
    wide = StereoImage(*(np.tile(picture.eye(eye), (1, 2, 1)) for eye in EYES))
    odd = np.add.outer(np.arange(480), np.arange(640))[..., np.newaxis] % 2 == 1
    with Presenter(deep_surface, find_mode("checkerboard"), models, lambda _: wide) as presenter:
        presenter.show(SCENE)
        woven = np.where(odd, np.tile(asked.right, (1, 2, 1)), np.tile(asked.left, (1, 2, 1))) * FULL_CODE
        assert_rounded(presenter.capture()["screen"], woven)


def test_words_on_black_are_their_ink(deep_surface: Surface, model: MakeModel) -> None:
    """Every pixel of smooth letters is a code of the ramp, none lost to blending."""
    display = model(2.2)
    models = EyeModels(display, display)
    with Presenter(deep_surface, find_mode("flat"), models, lambda name: pytest.fail(name)) as presenter:
        presenter.show(Scene((Text("Which is closer?", height_px=40, luminance_share=0.5),)))
        shown = {tuple(code) for code in presenter.capture()["screen"].reshape(-1, 3).tolist()}
    ramp = {tuple(code) for code in ink_codes(display, 0.5, 10).tolist()}
    assert shown <= ramp
    assert len(shown) > 50


def test_the_instruments_square_is_full_drive(
    deep_surface: Surface, same_models: EyeModels, random_stereo: Stereo
) -> None:
    picture = random_stereo(480, 640)
    mode = find_mode("row-interleaved", ModeOptions.parse({"photodiode_corner": "top-left", "photodiode_size_px": 30}))
    with Presenter(deep_surface, mode, same_models, lambda _: picture) as presenter:
        presenter.show(SCENE)
        assert np.all(presenter.capture()["screen"][:30, :30] == FULL_CODE)


def test_the_surface_reads_all_1024_codes(deep_egl: EglSurface) -> None:
    """Codes put there by clearing rows, and not by a colour pass."""
    target = deep_egl.target(Buffer.BACK)
    for first in (0, 480, 544):
        codes = np.arange(480) + first
        for row, code in enumerate(codes / FULL_CODE):
            target.clear(code, 1.0 - code, 0.5, viewport=(0, 479 - row, 640, 1))
        read = deep_egl.read()
        assert np.array_equal(read[..., 0], np.broadcast_to(codes[:, np.newaxis], (480, 640)))
        assert np.array_equal(read[..., 1], FULL_CODE - read[..., 0])


@pytest.mark.window
def test_a_screen_without_ten_bits_gets_eight_and_a_remark(
    display: str, same_models: EyeModels, random_stereo: Stereo
) -> None:
    picture = random_stereo(480, 320)
    with open_surface("window", (640, 480), bits=10) as surface:
        assert surface.bits == surface.facts.bits == 8
        assert surface.facts.remarks == given_bits(10, 8)[1]
        with Presenter(surface, find_mode("side-by-side"), same_models, lambda _: picture) as presenter:
            presenter.show(SCENE)
            view = presenter.eye_view("left")
    assert view.dtype == np.uint8
    assert np.abs(view - same_models.left.code(picture.left) * 255.0).max() <= 0.501


def test_a_window_without_a_screen_has_eight_and_a_remark() -> None:
    try:
        surface = open_surface("null", (64, 48), bits=10)
    except PresentationError as error:
        pytest.skip(str(error))
    with surface:
        assert surface.facts.bits == 8
        assert "10 bits a channel were asked for" in surface.facts.remarks[0]
        assert surface.read().dtype == np.uint8


@pytest.mark.window
@pytest.mark.nightly
def test_eight_bits_on_a_screen_of_ten_are_the_same_codes(
    deep_display: str, same_models: EyeModels, random_stereo: Stereo
) -> None:
    picture = random_stereo(480, 320)
    shown = []
    for backend in ("window", "egl"):
        with (
            open_surface(backend, (640, 480)) as surface,
            Presenter(surface, find_mode("side-by-side"), same_models, lambda _: picture) as presenter,
        ):
            assert surface.facts.bits == 8
            presenter.show(Scene((Picture("a"), Text("Which is closer?"))))
            shown.append(presenter.capture()["screen"])
    assert shown[0].dtype == np.uint8
    np.testing.assert_array_equal(shown[0], shown[1])


@pytest.mark.window
@pytest.mark.nightly
def test_each_of_two_windows_has_ten_bits(deep_display: str, model: MakeModel, random_stereo: Stereo) -> None:
    models = EyeModels(model(2.4, 0.05), model(1.9, 0.2))
    picture = random_stereo(240, 320)
    with (
        open_surface("window", (320, 240), windowed=True, windows=2, bits=10) as surface,
        Presenter(surface, find_mode("dual-window"), models, lambda _: picture) as presenter,
    ):
        if surface.bits != 10:
            pytest.skip("; ".join(surface.facts.remarks))
        presenter.show(SCENE)
        on_screen = x_screen()
        captured = presenter.capture()
    np.testing.assert_array_equal(on_screen[:240], np.hstack([captured["left"], captured["right"]]))
    for eye in EYES:
        assert_rounded(captured[eye], models.eye(eye).code(picture.eye(eye)) * FULL_CODE)


@pytest.mark.window
def test_the_screen_shows_the_ten_bits_that_were_drawn(
    deep_display: str, same_models: EyeModels, random_stereo: Stereo
) -> None:
    picture = random_stereo(480, 320)
    with (
        open_surface("window", (640, 480), bits=10) as surface,
        Presenter(surface, find_mode("side-by-side"), same_models, lambda _: picture) as presenter,
    ):
        if surface.bits != 10:
            pytest.skip("; ".join(surface.facts.remarks))
        presenter.show(Scene((Picture("a"), Text("Which is closer?"))))
        on_screen = x_screen()
        np.testing.assert_array_equal(on_screen, presenter.capture()["screen"])
    assert len(np.unique(on_screen)) > 900


@pytest.mark.parametrize("levels", [255, *nightly(4095)])
def test_dithering_to_other_levels_than_the_surface_s_is_refused(
    deep_egl: EglSurface, same_models: EyeModels, levels: int
) -> None:
    said = rf"dithered to 0\.\.{levels} cannot be shown: the surface has 10 bits, 0\.\.1023"
    with pytest.raises(PresentationError, match=said):
        Presenter(
            deep_egl, find_mode("flat"), same_models, lambda name: pytest.fail(name), dithering=Dithering(levels=levels)
        )


@pytest.mark.parametrize("backend", ["egl", "null"])
def test_other_depths_are_refused_and_leave_nothing_open(backend: str) -> None:
    for _ in range(2):
        with pytest.raises(
            PresentationError, match=r"codes of 12 bits cannot be shown \(ask for 8 or 10\)|OSMesa gives|EGL gives"
        ):
            open_surface(backend, (64, 48), bits=12)  # type: ignore[arg-type]  # wrong on purpose


# The bits that codes have: what the driver is asked, and what follows from its answer.


@pytest.mark.parametrize(
    ("asked", "found", "given", "said"),
    [
        (8, 8, 8, None),
        (10, 10, 10, None),
        (10, 8, 8, "10 bits a channel were asked for, and the driver gives 8: codes have 8 bits"),
        (8, 10, 8, "codes have 8 bits, on a framebuffer of 10 bits a channel"),
        (8, 0, 8, "the driver does not report how many bits its framebuffer has: codes have 8"),
        (10, 0, 8, "the driver does not report how many bits its framebuffer has: codes have 8"),
        (10, 16, 10, "codes have 10 bits, on a framebuffer of 16 bits a channel"),
    ],
)
def test_a_depth_other_than_asked_is_never_silent(asked: Bits, found: int, given: Bits, said: str | None) -> None:
    assert given_bits(asked, found) == (given, (said,) if said else ())


@pytest.mark.parametrize("asked", [8, 10])
@pytest.mark.parametrize("found", [5, 6])
def test_fewer_than_eight_bits_are_refused(asked: Bits, found: int) -> None:
    with pytest.raises(PresentationError, match=f"a framebuffer of {found} bits a channel"):
        given_bits(asked, found)


def test_the_driver_is_asked_for_the_size_of_each_channel() -> None:
    """A framebuffer is as deep as its shallowest channel: 5, 6 and 5 bits are 5."""
    asked: list[tuple[int, int, int]] = []
    sizes = {0x8212: 5, 0x8213: 6, 0x8214: 5}
    kept: list[Any] = []

    def load(name: str) -> int:
        signature: Any = ctypes.CFUNCTYPE(None, *(ctypes.c_uint,) * 3, ctypes.POINTER(ctypes.c_int))

        def answer(target: int, attachment: int, parameter: int, value: Any) -> None:
            asked.append((target, attachment, parameter))
            value[0] = sizes[parameter]

        kept.append(signature(answer))
        return ctypes.cast(kept[-1], ctypes.c_void_p).value or 0

    assert GlCalls(load).bits(gl_calls.BACK_LEFT) == 5
    assert asked == [(0x8D40, 0x0402, parameter) for parameter in sizes]


def test_a_window_asks_for_what_is_wanted() -> None:
    import glfw

    deep, plain = context_hints(10), context_hints()
    assert [deep[hint] for hint in (glfw.RED_BITS, glfw.GREEN_BITS, glfw.BLUE_BITS, glfw.ALPHA_BITS)] == [10, 10, 10, 2]
    assert [plain[hint] for hint in (glfw.RED_BITS, glfw.GREEN_BITS, glfw.BLUE_BITS)] == [8, 8, 8]
    assert glfw.ALPHA_BITS not in plain
