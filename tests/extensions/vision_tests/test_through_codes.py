"""What the presenter sends: parallax measured back from its 8-bit codes, and pictures made in time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

from devices.display import EYES, Eye, EyeModels
from documents.arrays import Floats
from extensions.vision_tests import Screen
from extensions.vision_tests.acuity import FINEST_PX, StereoAcuitySpec, finest_arcsec
from runner import Picture, Scene
from runner.presenter import PresentationError, Presenter, find_mode, open_surface
from stimuli.pictures import StereoImage
from tests.extensions.vision_tests.conftest import measured_px, model

MODEL = model()


@dataclass(frozen=True)
class Sampling:
    """How a mode samples a view: every ``step`` columns, the right eye's first ``right_later_px`` further right."""

    mode: str
    screens_px: tuple[int, int]
    step: int = 1
    right_later_px: float = 0.0

    def samples(self, view: Floats, eye: Eye) -> Floats:
        """Return what the eye is shown of its view's columns, one beside the other."""
        if self.mode != "column-interleaved":
            return view
        return view[:, 0::2] if eye == "left" else view[:, 1::2]


SIDE_BY_SIDE = Sampling("side-by-side", (1000, 500))
HALF = Sampling("side-by-side-half", (500, 500), 2)
COLUMNS = Sampling("column-interleaved", (500, 500), 2, 1.0)


def sent(sampling: Sampling, level: float, seeds: range) -> list[float]:
    """Return the errors, in pixels, of the parallax in the codes that are sent for stereograms of ``level`` arcsec."""
    screen = Screen((500, 500), 0.2768, 700.0, 65.0, (sampling.step, 1), EyeModels(MODEL, MODEL))
    step, errors = sampling.step, []
    for seed in seeds:
        test = StereoAcuitySpec(
            test="stereo_acuity", pass_arcsec=level, levels_arcsec=(level,), repeats=2, required=1, depth="both"
        ).make(screen, str(seed))
        shown = next(iter(test.series[0].levels.values()))
        pictures = {one.picture: one.make for one in shown}
        try:
            surface = open_surface("egl", sampling.screens_px)
        except PresentationError as error:
            pytest.skip(str(error))
        mode, models = find_mode(sampling.mode), EyeModels(MODEL, MODEL)
        with surface, Presenter(surface, mode, models, partial(_made, pictures)) as presenter:
            for one in shown:
                presenter.show(Scene((Picture(one.picture),)))
                codes = {eye: sampling.samples(presenter.eye_view(eye) / 255.0, eye) for eye in EYES}
                light = {eye: MODEL.xyz(code)[:, :, 1] for eye, code in codes.items()}
                offset = test.targets[one.correct].offset_px
                half = test.targets[one.correct].size_px[0] // 2 - 10
                middle = [round(place + 250) for place in offset]
                rows = slice(middle[1] - half, middle[1] + half)
                wanted = float(one.details["parallax_px"])
                patch = slice((middle[0] - half) // step, (middle[0] + half) // step)
                about = round((wanted - sampling.right_later_px) / step)  # to the nearest whole sample, no better
                found = measured_px(light["left"][rows], light["right"][rows], patch, about)
                found = step * found + sampling.right_later_px
                errors.append(found - wanted)
    return errors


def _made(pictures: Mapping[str, Callable[[], StereoImage]], name: str) -> StereoImage:
    return pictures[name]()


NIGHTLY = pytest.mark.nightly


@pytest.mark.parametrize("arcsec", [20.0, *(pytest.param(arcsec, marks=NIGHTLY) for arcsec in (70.0, 140.0, 500.0))])
def test_the_codes_that_are_sent_hold_the_parallax_to_a_fiftieth_of_a_pixel(arcsec: float) -> None:
    errors = sent(SIDE_BY_SIDE, arcsec, range(3))
    assert len(errors) == 6
    assert np.abs(errors).max() < 0.02


@pytest.mark.parametrize("sampling", [pytest.param(HALF, marks=NIGHTLY), COLUMNS], ids=lambda one: one.mode)
@pytest.mark.parametrize("arcsec", [40.0, *(pytest.param(arcsec, marks=NIGHTLY) for arcsec in (140.0, 500.0))])
def test_so_do_modes_in_which_an_eye_has_half_the_columns(sampling: Sampling, arcsec: float) -> None:
    """To a fiftieth of a pixel of those that the eye is really shown."""
    errors = sent(sampling, arcsec, range(3))
    assert np.abs(errors).max() < 0.02 * sampling.step


@pytest.mark.nightly
@pytest.mark.parametrize("sampling", [SIDE_BY_SIDE, HALF, COLUMNS], ids=lambda one: one.mode)
def test_the_finest_parallax_is_right_to_a_tenth(sampling: Sampling) -> None:
    screen = Screen((500, 500), 0.2768, 700.0, 65.0, (sampling.step, 1), EyeModels(MODEL, MODEL))
    errors = sent(sampling, 1.001 * finest_arcsec(screen), range(4))
    assert np.abs(errors).max() < 0.1 * FINEST_PX * sampling.step
