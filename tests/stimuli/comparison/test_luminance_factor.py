"""The factor between luminances: planted, and against NumPy's own regression."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stimuli.comparison.luminance import luminance_factor
from stimuli.errors import StimulusError

lights = st.lists(st.tuples(st.floats(1, 1e3), st.floats(0.5, 2.0)), min_size=3, max_size=20)


def test_a_factor_comes_back() -> None:
    rendering = np.array([3.0, 10.0, 40.0, 90.0])
    found = luminance_factor(1000 * rendering, rendering)
    assert found.mean_ratio == pytest.approx(1000, rel=1e-14)
    assert found.least_squares == pytest.approx(1000, rel=1e-14)
    assert found.mean_ratio_se == pytest.approx(0, abs=1e-9)
    assert found.pearson == pytest.approx(1)
    assert found.rms_mean_ratio == pytest.approx(0, abs=1e-9)
    assert found.r2_mean_ratio == pytest.approx(1)
    assert found.r2_as_rendered is not None
    assert found.r2_as_rendered < 0


@given(lights)
@settings(max_examples=25, deadline=None)
def test_what_scaling_changes_and_what_not(pairs: list[tuple[float, float]]) -> None:
    rendering = np.array([light for light, _ in pairs])
    photo = rendering * np.array([share for _, share in pairs])
    found, scaled = luminance_factor(photo, rendering), luminance_factor(photo, 7.0 * rendering)
    if found.pearson is not None and scaled.pearson is not None and np.ptp(rendering) > 1e-3:
        assert scaled.pearson == pytest.approx(found.pearson, abs=1e-6)
        assert found.pearson == pytest.approx(np.corrcoef(photo, rendering)[0, 1], abs=1e-6)
    assert 7 * scaled.least_squares == pytest.approx(found.least_squares)
    assert 7 * scaled.mean_ratio == pytest.approx(found.mean_ratio)
    slope, left, *_ = np.linalg.lstsq(rendering[:, None], photo, rcond=None)
    assert found.least_squares == pytest.approx(slope[0])
    assert found.rms_least_squares == pytest.approx(np.sqrt(left[0] / len(photo)) if len(left) else 0, abs=1e-6)
    assert found.rms_least_squares <= min(found.rms_mean_ratio, found.rms_as_rendered) * (1 + 1e-9) + 1e-12


def test_standard_errors_are_those_of_repetition() -> None:
    rng = np.random.default_rng(3)
    rendering = np.linspace(20, 90, 24)
    runs = [luminance_factor(0.97 * rendering + rng.normal(0, 2, 24), rendering) for _ in range(400)]
    told = np.sqrt(np.mean([(run.least_squares_se or 0) ** 2 for run in runs]))
    # 400 runs: a standard deviation to 3.5 %.
    assert told == pytest.approx(np.std([run.least_squares for run in runs]), rel=0.12)


def test_one_region_has_a_factor_and_no_more() -> None:
    found = luminance_factor([10.0], [20.0])
    assert (found.mean_ratio, found.least_squares) == (0.5, 0.5)
    assert (found.mean_ratio_se, found.pearson, found.r2_mean_ratio) == (None, None, None)


@pytest.mark.parametrize("bad", [[], [0.0], [np.nan], [1.0, 2.0]])
def test_what_has_no_factor_is_refused(bad: list[float]) -> None:
    with pytest.raises(StimulusError):
        luminance_factor(bad, [1.0] if bad else [])
