"""A display of any gamma, pictures that fill its gamut, and presenters to show them."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels, ToneCurve
from runner.presenter import PresentationError, Presenter, Surface, find_mode, open_surface
from runner.presenter.surfaces.egl import EglSurface
from runner.presenter.surfaces.windows import WindowSurface
from stimuli.pictures import StereoImage
from tests.choice import nightly
from tests.conftest import _x_server

BACKENDS = ("egl", "null", "window")
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def _model(gamma: float = 2.2, black: float = 0.0, lift: float = 0.0, offset: float = 0.0) -> DisplayModel:
    red, green, blue = (ToneCurve(1.0 - offset, offset, gamma + step, lift) for step in (0.0, -0.05, 0.1))
    return DisplayModel(black * np.array([0.95, 1.0, 1.2]), PRIMARIES, (red, green, blue))


@lru_cache(maxsize=32)
def _kept_XYZ(height: int, width: int, seed: int) -> NDArray[np.float32]:
    codes = np.random.default_rng(seed).random((height, width, 3))
    return _model().xyz(codes).astype(np.float32)


def _random_XYZ(height: int, width: int, seed: int = 0) -> NDArray[np.float32]:
    return _kept_XYZ(height, width, seed).copy()


@pytest.fixture(scope="session")
def model() -> Callable[..., DisplayModel]:
    """A display model of (gamma, black, lift, offset)."""
    return _model


@pytest.fixture(scope="session")
def same_models() -> EyeModels:
    """One display model for both eyes."""
    both = _model()
    return EyeModels(both, both)


@pytest.fixture(scope="session")
def random_XYZ() -> Callable[..., NDArray[np.float32]]:
    """Colours inside the gamut, of (height, width, seed)."""
    return _random_XYZ


@pytest.fixture(scope="session")
def random_stereo() -> Callable[..., StereoImage]:
    """A picture with two different views, of (height, width, seed)."""
    return lambda height, width, seed=0: StereoImage(
        _random_XYZ(height, width, 2 * seed), _random_XYZ(height, width, 2 * seed + 1)
    )


@pytest.fixture(params=["doubles", *nightly("two-floats")])
def each_arithmetic(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """What the colour passes compute in, in turn: of a module, by ``pytest.mark.usefixtures("each_arithmetic")``.

    That codes in two floats are those in doubles is shown by test_arithmetic.py.
    """
    monkeypatch.setenv("CYCLOPEAN_ARITHMETIC", request.param)
    return str(request.param)


def _egl_surface(size_px: tuple[int, int]) -> Iterator[EglSurface]:
    try:
        surface = EglSurface(size_px)
    except PresentationError as error:
        pytest.skip(str(error))
    with surface:
        yield surface


@pytest.fixture
def egl() -> Iterator[EglSurface]:
    """An offscreen surface of 640 × 480."""
    yield from _egl_surface((640, 480))


@pytest.fixture
def small_egl() -> Iterator[EglSurface]:
    """An offscreen surface of 160 × 120."""
    yield from _egl_surface((160, 120))


@pytest.fixture
def make_presenter(egl: EglSurface, same_models: EyeModels) -> Iterator[Callable[..., Presenter]]:
    """A presenter of (pictures by name, mode, models) on the EGL surface."""
    made: list[Presenter] = []

    def make(
        pictures: dict[str, StereoImage],
        mode: str = "side-by-side",
        models: EyeModels | None = None,
        **options: Any,
    ) -> Presenter:
        made.append(Presenter(egl, find_mode(mode), models or same_models, pictures.__getitem__, **options))
        return made[-1]

    yield make
    for presenter in made:
        presenter.close()


@pytest.fixture(scope="session")
def colour_ramps() -> Callable[[DisplayModel], NDArray[np.float32]]:
    """XYZ (480, 320, 3) that tries a display model: ramps from 1e-7 cd/m² to above white, in and out of the gamut."""
    return _colour_ramps


def _colour_ramps(model: DisplayModel) -> NDArray[np.float32]:
    rows, columns = 480, 320
    rng = np.random.default_rng(3)
    black, white = model.black_XYZ_cd_m2, model.white_XYZ_cd_m2
    luminance = np.geomspace(1e-7, 2.0 * white[1], 60 * columns)[:, np.newaxis]
    primaries = [model.primaries_XYZ_cd_m2[:, channel] for channel in range(3)]
    parts = [white / white[1] * luminance]
    parts += [black + primary / primary[1] * luminance for primary in primaries]
    parts.append(black + (primaries[0] + primaries[2]) / white[1] * luminance)  # magenta: no green at all
    in_gamut = model.xyz(rng.uniform(0.1, 1.0, (60 * columns, 3)))
    beyond = rng.random((60 * columns, 3)) * 3.0 * white - white / 2.0
    halfway = model.xyz((rng.integers(0, 255, (60 * columns, 3)) + 0.5) / 255.0)
    return np.concatenate([*parts, in_gamut, beyond, halfway]).reshape(rows, columns, 3).astype(np.float32)


@dataclass(frozen=True, slots=True)
class AskedRamps:
    """A display for each eye, a picture, and the codes that show it in float64, 0..1 and not rounded."""

    models: EyeModels
    picture: StereoImage
    left: NDArray[np.float64]
    right: NDArray[np.float64]
    right_on_left: NDArray[np.float64]  # what the right eye should see, on the left eye's display


@pytest.fixture(scope="module")
def ramps_on() -> Callable[..., AskedRamps]:
    """Ramps on a display of (gamma, black, lift, offset) beside another one, made once for all surfaces."""
    right = _model(2.1, black=0.1)
    right_ramps = _colour_ramps(right)
    right_codes = right.code(right_ramps)

    @cache
    def make(**display_parameters: float) -> AskedRamps:
        left = _model(**display_parameters)
        ramps = _colour_ramps(left)
        codes, others = (left.code(view) for view in (ramps, right_ramps))
        return AskedRamps(EyeModels(left, right), StereoImage(ramps, right_ramps), codes, right_codes, others)

    return make


@pytest.fixture(scope="session")
def xvfb_display() -> Iterator[str]:
    """A display of 640 × 480 on an X server of its own."""
    yield from _x_server("640x480x24")


@pytest.fixture(scope="session")
def xvfb_deep_display() -> Iterator[str]:
    """A display of 640 × 480 with 10 bits a channel on an X server of its own."""
    yield from _x_server("640x480x30")


def _use_display(name: str, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("DISPLAY", name)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("XDG_SESSION_TYPE", "x11")
    return name


@pytest.fixture
def display(xvfb_display: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """The display, set for this process."""
    return _use_display(xvfb_display, monkeypatch)


@pytest.fixture
def deep_display(xvfb_deep_display: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """The display of 10 bits a channel, set for this process."""
    return _use_display(xvfb_deep_display, monkeypatch)


def _surface_of(request: pytest.FixtureRequest, display: str, bits: Any = 8) -> Surface:
    """Open a surface of 640 × 480 of the backend that is asked for; a window on ``display``."""
    if request.param == "window":
        request.getfixturevalue(display)
    try:
        return open_surface(request.param, (640, 480), bits=bits)
    except PresentationError as error:
        if request.param == "window":
            raise  # there is a display: it must open
        pytest.skip(str(error))


@pytest.fixture(params=["egl", *nightly("window")])
def deep_surface(request: pytest.FixtureRequest) -> Iterator[Surface]:
    """A surface of 640 × 480 with codes of 10 bits, of each backend that can have them."""
    with _surface_of(request, "deep_display", bits=10) as opened:
        if opened.bits != 10:
            pytest.skip("; ".join(opened.facts.remarks))
        yield opened


def on_surfaces(cases: Sequence[str], often: Sequence[str], backends: Sequence[str] = ("egl",)) -> list[Any]:
    """Parameters (surface, case): ``often`` on ``backends``; all offscreen, and those anywhere: nightly; else stress.

    For ``surface``, which is to be indirect.
    """

    def marks(backend: str, case: str) -> list[pytest.MarkDecorator]:
        if case in often and backend in backends:
            return []
        return [pytest.mark.nightly if backend == "egl" or case in often else pytest.mark.stress]

    return [pytest.param(backend, case, marks=marks(backend, case)) for backend in BACKENDS for case in cases]


@pytest.fixture(params=["egl", *nightly("null", "window")])
def surface(request: pytest.FixtureRequest) -> Iterator[Surface]:
    """A surface of 640 × 480 of each backend in turn."""
    with _surface_of(request, "display") as opened:
        yield opened


@pytest.fixture
def x_screen(display: str) -> Callable[[], NDArray[np.uint8]]:
    """What the X server's screen shows when it is called, (height, width, 3)."""
    from PIL import ImageGrab

    return lambda: np.asarray(ImageGrab.grab(xdisplay=display).convert("RGB"))


@pytest.fixture
def window(display: str) -> Iterator[WindowSurface]:
    """A full-screen window on the 640 × 480 display."""
    with WindowSurface((640, 480)) as opened:
        yield opened


@pytest.fixture
def do() -> Callable[..., None]:
    """Do something with xdotool."""
    tool = shutil.which("xdotool")
    if tool is None:
        pytest.skip("xdotool is not installed (apt install xdotool)")

    def send(*words: str) -> None:
        subprocess.run([tool, *words], check=True, timeout=10)

    return send
