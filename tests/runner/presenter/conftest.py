"""A display of any gamma, pictures that fill its gamut, and presenters to show them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import DisplayModel
from devices.display_file import EyeModels
from devices.tone_curve import ToneCurve
from runner.presenter.errors import PresentationError
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.surfaces.egl import EglSurface
from stimuli.stereo_image import StereoImage

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def _model(gamma: float = 2.2, black: float = 0.0, lift: float = 0.0, offset: float = 0.0) -> DisplayModel:
    red, green, blue = (ToneCurve(1.0 - offset, offset, gamma + step, lift) for step in (0.0, -0.05, 0.1))
    return DisplayModel(black * np.array([0.95, 1.0, 1.2]), PRIMARIES, (red, green, blue))


def _random_XYZ(height: int, width: int, seed: int = 0) -> NDArray[np.float32]:
    codes = np.random.default_rng(seed).random((height, width, 3))
    return _model().xyz(codes).astype(np.float32)


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


@pytest.fixture
def egl() -> Iterator[EglSurface]:
    """An offscreen surface of 640 × 480."""
    try:
        surface = EglSurface((640, 480))
    except PresentationError as error:
        pytest.skip(str(error))
    with surface:
        yield surface


@pytest.fixture
def make_presenter(egl: EglSurface, same_models: EyeModels) -> Iterator[Callable[..., Presenter]]:
    """A presenter of (pictures by name, mode, models) on the EGL surface."""
    made: list[Presenter] = []

    def make(
        pictures: dict[str, StereoImage],
        mode: str = "side-by-side",
        models: EyeModels | None = None,
        **options: int,
    ) -> Presenter:
        made.append(Presenter(egl, find_mode(mode), models or same_models, pictures.__getitem__, **options))
        return made[-1]

    yield make
    for presenter in made:
        presenter.close()
