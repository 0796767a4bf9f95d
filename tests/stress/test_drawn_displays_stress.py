"""Every code within 0.501 of float64 on hundreds of displays drawn at random, other ones each time."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.compensation import Correction, least_squares
from devices.display import EYES, Eye, EyeModels
from runner.presenter import MODES, PresentationError, find_mode
from runner.presenter.depth import Bits
from runner.presenter.surfaces.egl import EglSurface
from tests.displays import corrections, eye_models
from tests.runner.presenter.drawn_displays import (
    SIZE_PX,
    WITHIN_CODES,
    worst_in_a_mode,
    worst_of_a_mixture,
    worst_of_an_eye,
)

pytestmark = pytest.mark.stress

MANY = settings(max_examples=300, suppress_health_check=list(HealthCheck), deadline=None)
BITS = st.sampled_from([8, 10])
SEEDS = st.integers(0, 10**6)
EITHER = st.sampled_from(EYES)
UNLIFTED = corrections(SIZE_PX, lifts=False)
MODE_NAMES = tuple(name for name in MODES if not find_mode(name).needs_stereo)  # the others: tests/quad


@pytest.fixture(scope="module")
def surface() -> Iterator[EglSurface]:
    """One offscreen surface for all of them."""
    try:
        opened = EglSurface((96, 72), windows=2)
    except PresentationError as error:
        pytest.skip(str(error))
    with opened:
        yield opened


# Which displays, what is corrected, for which eye, how many: Newton's method for both eyes takes seconds to compile.
CASES = {
    "adding up": (eye_models(plvc=False), st.none(), EITHER, 300),
    "acting on each other": (eye_models(plvc=True, residual=False), st.none(), st.just(EYES[0]), 25),
    "with some left over": (eye_models(plvc=True, residual=True), st.none(), st.just(EYES[0]), 25),
    "adding up, corrected": (eye_models(plvc=False), corrections(SIZE_PX), EITHER, 150),
    "acting on each other, corrected": (eye_models(plvc=True, residual=False), UNLIFTED, EITHER, 25),
    "with some left over, corrected": (eye_models(plvc=True, residual=True), UNLIFTED, EITHER, 25),
}


@pytest.mark.parametrize("case", CASES)
def test_an_eye_is_shown_what_was_asked(surface: EglSurface, case: str) -> None:
    models, correction, eye, examples = CASES[case]

    @settings(MANY, max_examples=examples)
    @given(models, correction, eye, BITS, SEEDS)
    def shown(models: EyeModels, correction: Correction | None, eye: Eye, bits: Bits, seed: int) -> None:
        assert max(worst_of_an_eye(surface, models, correction, eye, bits, seed).values()) <= WITHIN_CODES

    shown()


@settings(MANY, max_examples=100)
@given(models=eye_models(plvc=False), bits=BITS, seed=SEEDS)
def test_both_views_in_one_picture(surface: EglSurface, models: EyeModels, bits: Bits, seed: int) -> None:
    mixture = least_squares(EyeModels(models.left, models.left), (0.2, 0.01, 0.0), (0.0, 0.4, 0.3))
    assert max(worst_of_a_mixture(surface, models, mixture, bits, seed).values()) <= WITHIN_CODES


@settings(MANY, max_examples=150)
@given(models=eye_models(plvc=False), name=st.sampled_from(MODE_NAMES), seed=SEEDS)
def test_every_mode(surface: EglSurface, name: str, models: EyeModels, seed: int) -> None:
    both = EyeModels(models.left, models.left) if name == "flat" else models
    assert max(worst_in_a_mode(surface, find_mode(name), both, seed).values()) <= WITHIN_CODES
