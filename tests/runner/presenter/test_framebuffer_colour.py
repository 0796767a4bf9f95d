"""What reaches the framebuffer against the float64 reference, on every surface and in every mode that it has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display.display_file import EyeModels
from devices.display.model import DisplayModel
from runner.presenter.modes.registry import available, find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.scene import Picture, Scene
from runner.presenter.surfaces.gl_calls import Codes
from runner.presenter.surfaces.surface import Surface
from stimuli.pictures.stereo_image import StereoImage

MakeModel = Callable[..., DisplayModel]
Ramps = Callable[[DisplayModel], NDArray[np.float32]]

DISPLAYS = [
    pytest.param({"gamma": 1.6}, id="gamma 1.6"),
    pytest.param({"gamma": 2.2, "black": 0.05}, id="gamma 2.2, black"),
    pytest.param({"gamma": 2.4, "black": 0.05, "lift": 0.003}, id="gamma 2.4, black, lift"),
    pytest.param({"gamma": 2.8, "black": 0.3, "lift": 0.01, "offset": -0.05}, id="gamma 2.8, black, lift, offset"),
    pytest.param({"gamma": 2.8}, id="gamma 2.8"),
]


IN_GAMUT_ROWS = slice(300, 360)  # random codes; the ramps dwell at black, and halfway codes all round one way


def assert_rounded(codes: Codes, reference: NDArray[np.float64]) -> None:
    """Every code within 0.501 of the reference, and the random ones no more than chance to either side."""
    assert codes.dtype == np.uint8
    error = codes - reference
    assert np.abs(error).max() <= 0.501
    assert np.abs(error[IN_GAMUT_ROWS].reshape(-1, 3).mean(axis=0)).max() < 0.02


@pytest.mark.parametrize("display_parameters", DISPLAYS)
def test_every_pixel_is_the_rounded_reference_for_both_eyes(
    surface: Surface, display_parameters: dict[str, float], model: MakeModel, colour_ramps: Ramps
) -> None:
    left, right = model(**display_parameters), model(2.1, black=0.1)
    picture = StereoImage(colour_ramps(left), colour_ramps(right))
    scene = Scene((Picture("ramps"),))
    with Presenter(surface, find_mode("side-by-side"), EyeModels(left, right), lambda _: picture) as presenter:
        presenter.show(scene)
        assert_rounded(presenter.eye_view("left"), left.code(picture.left) * 255.0)
        assert_rounded(presenter.eye_view("right"), right.code(picture.right) * 255.0)
    flat = StereoImage.flat(np.concatenate([picture.left, picture.right], axis=1))
    with Presenter(surface, find_mode("flat"), EyeModels(left, left), lambda _: flat) as presenter:
        presenter.show(scene)
        assert_rounded(presenter.capture()["screen"], left.code(flat.left) * 255.0)
        assert presenter.counters.colour_passes == 1


def test_the_modes_of_a_surface_follow_from_its_buffers(surface: Surface) -> None:
    reasons = available(surface)
    assert reasons["flat"] is None
    assert reasons["side-by-side"] is None
    assert (reasons["quad-buffered"] is None) == surface.stereo


def test_the_facts_say_how_it_was_shown(surface: Surface) -> None:
    facts = surface.facts
    assert facts.size_px == (640, 480)
    assert facts.renderer
    assert facts.gl_version
    assert facts.display_server == ("x11" if facts.backend == "window" else "none")
