"""What the presenter sends: parallax measured back from its 8-bit codes, and pictures made in time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import DisplayModel
from devices.display_file import Eye, EyeModels
from devices.tone_curve import ToneCurve
from runner.blocks.screening.screen import Screen
from runner.blocks.screening.stereo_acuity import FINEST_PX, stereo_acuity
from runner.presenter.errors import PresentationError
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.scene import Picture, Scene
from runner.presenter.surfaces import open_surface
from stimuli.stereo_image import StereoImage

Floats = NDArray[np.float64]
CURVE = ToneCurve(gamma=2.2)
MODEL = DisplayModel(
    np.array([0.02, 0.02, 0.03]),
    np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]]),
    (CURVE, CURVE, CURVE),
)
EYES: tuple[Eye, Eye] = ("left", "right")


def measured_px(left: Floats, right: Floats, about_px: float) -> float:
    """Return the parallax of two patches by the phases of their Fourier transforms along the rows, to a least square.

    The frequencies below a quarter of what pixels can carry are weighed by their energy; both patches are windowed
    alike after the nearest whole shift is taken off by the caller.
    """
    window = np.hanning(left.shape[1])
    first, second = (np.fft.rfft((view - view.mean()) * window, axis=1) for view in (left, right))
    cross = (first * np.conj(second)).sum(axis=0)
    frequency = np.fft.rfftfreq(left.shape[1])
    use = (frequency > 0.02) & (frequency < 0.25)
    turned = np.angle(cross[use] * np.exp(-2j * np.pi * frequency[use] * about_px))
    weight = np.abs(cross[use])
    slope = (weight * frequency[use] * turned).sum() / (weight * frequency[use] ** 2).sum()
    return float(about_px + slope / (2 * np.pi))


def sent(mode: str, level: float, screen: Screen, seeds: range) -> list[float]:
    """Return the errors, in pixels, of the parallax in the codes that are sent for stereograms of ``level`` arcsec."""
    size = (2 * screen.view_px[0], screen.view_px[1]) if mode == "side-by-side" else screen.view_px
    errors = []
    for seed in seeds:
        test = stereo_acuity(
            screen, str(seed), pass_arcsec=level, levels_arcsec=(level,), repeats=2, required=1, depth="both"
        )
        shown = test.series[0].levels[0].presentations
        pictures = {one.picture: one.make for one in shown}
        try:
            surface = open_surface("egl", size)
        except PresentationError as error:
            pytest.skip(str(error))
        with (
            surface,
            Presenter(surface, find_mode(mode), EyeModels(MODEL, MODEL), partial(_made, pictures)) as presenter,
        ):
            for one in shown:
                presenter.show(Scene((Picture(one.picture),)))
                light = {eye: MODEL.xyz(presenter.eye_view(eye) / 255.0)[:, :, 1] for eye in EYES}
                offset = test.targets[one.correct].offset_px
                half = test.targets[one.correct].size_px[0] // 2 - 10
                middle = [round(place + side / 2) for place, side in zip(offset, screen.view_px, strict=True)]
                rows = slice(middle[1] - half, middle[1] + half)
                wanted = float(one.details["parallax_px"])
                whole = round(wanted / 2)
                columns = {"left": middle[0] - whole, "right": middle[0] + whole}
                left, right = (light[eye][rows, columns[eye] - half : columns[eye] + half] for eye in EYES)
                found = 2 * whole + measured_px(left, right, wanted - 2 * whole)
                errors.append(found - wanted)
    return errors


def _made(pictures: Mapping[str, Callable[[], StereoImage]], name: str) -> StereoImage:
    return pictures[name]()


@pytest.mark.parametrize("arcsec", [20.0, 70.0, 140.0, 500.0])
def test_the_codes_that_are_sent_hold_the_parallax_to_a_fiftieth_of_a_pixel(arcsec: float) -> None:
    screen = Screen((500, 500), 0.2768, 700.0, 65.0, (1, 1), EyeModels(MODEL, MODEL))
    errors = sent("side-by-side", arcsec, screen, range(3))
    assert len(errors) == 6
    assert np.abs(errors).max() < 0.02


def test_the_finest_parallax_is_right_to_a_tenth() -> None:
    screen = Screen((500, 500), 0.2768, 700.0, 65.0, (1, 1), EyeModels(MODEL, MODEL))
    errors = sent("side-by-side", 1.001 * screen.disparity_arcsec(FINEST_PX), screen, range(4))
    assert np.abs(errors).max() < 0.1 * FINEST_PX


def test_making_a_picture_takes_less_time_than_an_answer() -> None:
    """Under 50 ms on an idle processor; here with room for a busy one, and at the size of a full HD eye's view."""
    screen = Screen((960, 1080), 0.2768, 700.0, 65.0, (1, 1), EyeModels(MODEL, MODEL))
    test = stereo_acuity(screen, "s", pass_arcsec=140, levels_arcsec=(140,), repeats=5, required=1, depth="both")
    times = []
    for one in test.series[0].levels[0].presentations:
        start = time.thread_time()
        one.make()
        times.append(time.thread_time() - start)
    assert min(times) < 0.1
