"""Every code within 0.501 of float64 on displays drawn at random; many more are in tests/stress.

Drivers take seconds to compile each of the shaders for each arithmetic and each format that it draws to: they are drawn
with codes of 10 bits here, and in tests/stress with 8 too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.compensation import Correction, least_squares
from devices.display import EYES, Eye, EyeModels, Plvc, Residual, TableCurve
from runner.presenter import MODES, Surface, find_mode
from tests.displays import corrections, eye_models
from tests.runner.families import by_family
from tests.runner.presenter.drawn_displays import (
    SIZE_PX,
    WITHIN_CODES,
    WORDS,
    one_surface,
    worst_in_a_mode,
    worst_of_a_mixture,
    worst_of_an_eye,
)

# The same displays each time, so that no run is unlucky: the stress tests look for others.
FEW = settings(
    max_examples=5, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow], deadline=None
)
FEWER = settings(FEW, max_examples=3)
# Newton's method for both eyes takes seconds to compile.
TWO = settings(FEW, max_examples=2)
MODE_NAMES = tuple(name for name in MODES if not find_mode(name).needs_stereo)  # the others: tests/quad
SEEDS = st.integers(0, 10**6)


surface = pytest.fixture(scope="module", name="surface")(one_surface)


def _check(worst: dict[str, float], words: Sequence[str] = WORDS) -> None:
    assert set(worst) == set(words)
    assert max(worst.values()) <= WITHIN_CODES, worst


@FEW
@given(models=eye_models(plvc=False), eye=st.sampled_from(EYES), seed=SEEDS)
def test_channels_that_add_up(surface: Surface, models: EyeModels, eye: Eye, seed: int) -> None:
    _check(worst_of_an_eye(surface, models, None, eye, 10, seed))


@TWO
@given(models=eye_models(plvc=True, residual=False), seed=SEEDS)
def test_channels_that_act_on_each_other(surface: Surface, models: EyeModels, seed: int) -> None:
    _check(worst_of_an_eye(surface, models, None, "left", 10, seed))


@FEW
@given(
    models=eye_models(plvc=False),
    correction=corrections(SIZE_PX, takes=0.08, adds=0.12),
    eye=st.sampled_from(EYES),
    seed=SEEDS,
)
def test_crosstalk_and_uneven_panels(
    surface: Surface, models: EyeModels, correction: Correction, eye: Eye, seed: int
) -> None:
    _check(worst_of_an_eye(surface, models, correction, eye, 10, seed))


@TWO
@given(
    models=eye_models(plvc=True, residual=False),
    correction=corrections(SIZE_PX, lifts=False),
    eye=st.sampled_from(EYES),
    seed=SEEDS,
)
def test_crosstalk_between_channels_that_act_on_each_other(
    surface: Surface, models: EyeModels, correction: Correction, eye: Eye, seed: int
) -> None:
    """In the arithmetic of graphics cards; in doubles: test_colour_pass.py, with what is left over too."""
    words = ("two-floats",)
    _check(worst_of_an_eye(surface, models, correction, eye, 10, seed, words), words)


@FEWER
@given(models=eye_models(plvc=False), seed=SEEDS)
def test_both_views_in_one_picture(surface: Surface, models: EyeModels, seed: int) -> None:
    mixture = least_squares(EyeModels(models.left, models.left), (0.2, 0.01, 0.0), (0.0, 0.4, 0.3))
    _check(worst_of_a_mixture(surface, models, mixture, 10, seed))


@pytest.mark.parametrize("name", by_family(MODE_NAMES))
@settings(FEW, max_examples=2)
@given(models=eye_models(plvc=False), seed=SEEDS)
def test_every_mode(surface: Surface, name: str, models: EyeModels, seed: int) -> None:
    both = EyeModels(models.left, models.left) if name == "flat" else models
    _check(worst_in_a_mode(surface, find_mode(name), both, seed))


def test_at_the_border_of_the_gamut_where_a_curve_is_almost_flat(surface: Surface) -> None:
    """A step too few there leaves 1e-12 of full light, which such a curve shows as a whole code."""
    codes = (0.0, 0.25, 0.5, 0.75, 1.0)
    even, flat = (
        TableCurve(codes, (0.0, *light, 1.0)) for light in ((0.0625, 0.25, 0.5625), (0.0039297, 0.1407, 0.4727))
    )
    model = Plvc(
        black_XYZ_cd_m2=np.zeros(3),
        primaries_XYZ_cd_m2=np.array([[128 / 3, 35.0, 20.0], [22.0, 70.0, 8.0], [2.0, 35 / 3, 316 / 3]]),
        curves=(even, even, flat),
        XYZ_per_light_cd_m2=np.array(
            [
                [[43.0, 21.8, 1.9], [41.9, 22.3, 1.9], [44.6, 22.9, 1.9], [44.2, 21.2, 2.0]],
                [[33.6, 71.6, 12.3], [37.0, 71.4, 11.2], [34.6, 68.1, 12.3], [34.2, 70.5, 11.5]],
                [[19.1, 7.9, 108.7], [19.8, 8.2, 106.4], [19.0, 8.2, 107.5], [20.7, 7.7, 111.3]],
            ]
        ),
        mixtures_XYZ_cd_m2=np.zeros((10, 3)),
        residual=Residual(np.array([[0.56, 0.24, 0.04]]), 1.0, np.array([[-4.72, 3.13, 4.91]])),
    )
    for seed in (14, 18, 26, 48):
        _check(worst_of_an_eye(surface, EyeModels(model, model), None, "left", 10, seed))
