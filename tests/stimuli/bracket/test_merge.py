"""The merged light is unbiased, its variance is the Cramér-Rao bound, and the standard error says so."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

from stimuli.bracket import NoiseModel, merge_exposures
from stimuli.bracket.noise import estimate_noise
from stimuli.errors import StimulusError
from tests.stimuli.bracket.sensor import FULL_E, READ_E, record

NOISE = NoiseModel.of_electrons(FULL_E, READ_E)
T = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]
MANY = 40_000


def rms(values: np.ndarray, light: float) -> float:
    return float(np.sqrt(((values - light) ** 2).mean()))


def near_full(light: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what two exposures give, by us, by leaving out full values, and by the shorter exposure alone."""
    values, full = taken(light, [1.0, 4.0])
    plain = np.where(full[1], values[0], (values[0] + values[1]) / 5)
    return merge_exposures(values, full, [1.0, 4.0], NOISE).value, plain, values[0]


def taken(light: float, t: list[float] = T, many: int = MANY) -> tuple[list[np.ndarray], list[np.ndarray]]:
    values = [record(np.full(many, light), time, seed=number) for number, time in enumerate(t)]
    clipped = [np.minimum(value, 1.0) for value in values]
    return clipped, [value >= 1.0 for value in values]


def bound(light: float, t: list[float] = T) -> float:
    """The Cramér-Rao bound on the standard deviation, of the exposures that the light does not fill."""
    clear = [time for time in t if light * time + 4.5 * np.sqrt(light * time / FULL_E) < 1]
    return float(1 / np.sqrt(sum(time**2 / (light * time / FULL_E + (READ_E / FULL_E) ** 2) for time in clear)))


@pytest.mark.parametrize("light", [0.0005, 0.02, 0.12, 0.8])
def test_the_variance_is_the_cramer_rao_bound_and_there_is_no_bias(light: float) -> None:
    merged = merge_exposures(*taken(light), T, NOISE)
    limit = bound(light)
    # of 40000 values the mean has a standard error of 1/200, a standard deviation one of 1/283: four of each
    assert abs(merged.value.mean() - light) < 4 * limit / np.sqrt(MANY)
    assert merged.value.std() == pytest.approx(limit, rel=4 / np.sqrt(2 * MANY))
    assert np.sqrt((merged.standard_error**2).mean()) == pytest.approx(limit, rel=0.01)
    assert not merged.saturated.any()


@pytest.mark.parametrize("light", [0.002, 0.0623, 0.5])
def test_the_iteration_is_the_solution_of_the_likelihood_equation(light: float) -> None:
    """The slow twin finds its root for each value by bisection, full exposures censored."""
    values, full = taken(light, T[:5], many=20)
    merged = merge_exposures(values, full, T[:5], NOISE)

    def slope(x: float, number: int) -> float:
        total = 0.0
        for time, value, is_full in zip(T[:5], values, full, strict=True):
            deviation = np.sqrt(max(x, 0.0) * time / FULL_E + (READ_E / FULL_E) ** 2)
            if is_full[number]:
                z = (time * x - 1) / deviation
                total += time / deviation * np.exp(norm.logpdf(z) - norm.logcdf(z))
            else:
                total += time * (value[number] - time * x) / deviation**2
        return float(total)

    exact = np.array([brentq(slope, 1e-3, 1.2, args=(number,), xtol=1e-14) for number in range(20)])
    np.testing.assert_allclose(merged.value, exact, atol=1e-3 * float(merged.standard_error.mean()))


def test_photon_noise_alone_needs_no_gain() -> None:
    values, full = taken(0.01)
    plain = sum(values) / sum(T)
    np.testing.assert_allclose(merge_exposures(values, full, T).value, plain, rtol=1e-12)
    np.testing.assert_allclose(merge_exposures(values, full, T, NoiseModel(1e-4, 0)).value, plain, rtol=1e-12)
    assert np.isnan(merge_exposures(values, full, T).standard_error).all()


def test_what_is_full_at_every_exposure_is_a_lower_bound() -> None:
    merged = merge_exposures([[0.97, 0.1], [1.0, 0.4]], [[True, False], [True, False]], [1, 4], NOISE)
    assert merged.saturated.tolist() == [True, False]
    assert merged.value[0] == 0.97
    assert merged.exposures.tolist() == [0, 2]


def test_one_exposure_alone() -> None:
    values = [[0.1, 0.1, 0.1], [0.5, 0.4, 1.0], [0.9, 1.0, 1.0]]
    full = [[False] * 3, [False, False, True], [False, True, True]]
    merged = merge_exposures(values, full, [1, 4, 8], NOISE, alone=[True, False, True], reference=1)
    assert merged.value[0] == pytest.approx(0.125)
    assert merged.value[2] == pytest.approx(0.1)
    assert merged.exposures.tolist() == [1, 2, 1]


@pytest.mark.parametrize(
    ("values", "t"), [([[0.1], [0.1, 0.2]], [1, 2]), ([[0.1], [0.2]], [1]), ([[0.1], [0.2]], [2, 1]), ([], [])]
)
def test_what_does_not_go_together_is_refused(values: list[list[float]], t: list[float]) -> None:
    with pytest.raises(StimulusError):
        merge_exposures(values, [np.zeros(len(part), bool) for part in values], t)


@pytest.mark.nightly
def test_noise_is_found_in_the_photographs() -> None:
    rng = np.random.default_rng(1)
    light = np.exp(rng.uniform(np.log(1e-4), 0, 200_000))
    values = [np.rint(14920 * record(light, time, seed=number)) / 14920 for number, time in enumerate(T)]
    full = [value >= 1 for value in values]
    noise = estimate_noise(values, full, T)
    assert noise is not None
    assert 1 / noise.gain == pytest.approx(FULL_E, rel=0.02)
    coded = np.sqrt(READ_E**2 + (FULL_E / 14920) ** 2 / 12)  # whole codes add to the read noise
    assert noise.read / noise.gain == pytest.approx(coded, rel=0.05)
    given = estimate_noise(values, full, T, read=float(coded) / FULL_E)
    assert given is not None
    assert 1 / given.gain == pytest.approx(FULL_E, rel=0.02)
    assert given.read == pytest.approx(coded / FULL_E)
    assert estimate_noise([value[:100] for value in values], [part[:100] for part in full], T) is None
    still = [light * time for time in T]
    assert estimate_noise(still, [value >= 1 for value in still], T) == NoiseModel(0.0, 0.0)


@pytest.mark.parametrize("numbers", [(0, 3), (-1, 3), (30000, -1), (np.nan, 3), (30000, np.inf)])
def test_noise_that_cannot_be(numbers: tuple[float, float]) -> None:
    with pytest.raises(StimulusError):
        NoiseModel.of_electrons(*numbers)


@pytest.mark.parametrize("light", np.geomspace(0.24, 0.26, 9))
def test_an_exposure_that_is_nearly_full_helps_and_hardly_biases(light: float) -> None:
    """A quarter fills the exposure of 4. One censored value leaves a bias of at most a third of the standard error."""
    ours, _, alone = near_full(float(light))
    assert rms(ours, light) < 1.01 * rms(alone, light)
    # beside the third, four standard errors of the mean of 40000
    assert abs(ours.mean() - light) < (0.33 + 4 / np.sqrt(MANY)) * ours.std()


def test_leaving_out_full_values_errs_more_there() -> None:
    errors = [[rms(part, light) for part in near_full(light)] for light in np.geomspace(0.245, 0.255, 9)]
    ours, plain, alone = np.sqrt(np.mean(np.square(errors), axis=0))
    assert ours < plain < alone


def test_more_exposures_are_never_less_exact() -> None:
    rng = np.random.default_rng(5)
    for light in rng.uniform(0.001, 0.9, 20):
        errors = [
            float(np.nanmean(merge_exposures(*taken(light, T[:n], 500), T[:n], NOISE).standard_error))
            for n in range(1, 7)
        ]
        # the estimate of x in the error has noise of its own, a hundredth at most
        assert all(later < earlier * 1.01 for earlier, later in pairwise(errors))
