"""What reaches the framebuffer against the float64 reference, on every surface and in every mode that it has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import EyeModels
from runner import Picture, Scene
from runner.presenter import Codes, Presenter, Surface, find_mode
from runner.presenter.modes.registry import available
from stimuli.pictures import StereoImage
from tests.runner.presenter.conftest import BACKENDS, AskedRamps, on_surfaces

DISPLAYS: dict[str, dict[str, float]] = {
    "gamma 1.6": {"gamma": 1.6},
    "gamma 2.2, black": {"gamma": 2.2, "black": 0.05},
    "gamma 2.4, black, lift": {"gamma": 2.4, "black": 0.05, "lift": 0.003},
    "gamma 2.8, black, lift, offset": {"gamma": 2.8, "black": 0.3, "lift": 0.01, "offset": -0.05},
    "gamma 2.8": {"gamma": 2.8},
}


IN_GAMUT_ROWS = slice(300, 360)  # random codes; the ramps dwell at black, and halfway codes all round one way


def assert_rounded(codes: Codes, reference: NDArray[np.float64]) -> None:
    """Every code within 0.501 of the reference, and the random ones no more than chance to either side."""
    assert codes.dtype == np.uint8
    error = codes - reference
    assert np.abs(error).max() <= 0.501
    assert np.abs(error[IN_GAMUT_ROWS].reshape(-1, 3).mean(axis=0)).max() < 0.02


@pytest.mark.promise("framebuffer")
@pytest.mark.parametrize(
    ("surface", "name"),
    on_surfaces(tuple(DISPLAYS), ("gamma 2.8, black, lift, offset",), BACKENDS),
    indirect=["surface"],
)
def test_every_pixel_is_the_rounded_reference_for_both_eyes(
    surface: Surface, name: str, ramps_on: Callable[..., AskedRamps]
) -> None:
    asked = ramps_on(**DISPLAYS[name])
    left, picture = asked.models.left, asked.picture
    scene = Scene((Picture("ramps"),))
    with Presenter(surface, find_mode("side-by-side"), asked.models, lambda _: picture) as presenter:
        presenter.show(scene)
        assert_rounded(presenter.eye_view("left"), asked.left * 255.0)
        assert_rounded(presenter.eye_view("right"), asked.right * 255.0)
    flat = StereoImage.flat(np.concatenate([picture.left, picture.right], axis=1))
    with Presenter(surface, find_mode("flat"), EyeModels(left, left), lambda _: flat) as presenter:
        presenter.show(scene)
        assert_rounded(presenter.capture()["screen"], np.concatenate([asked.left, asked.right_on_left], axis=1) * 255.0)
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
