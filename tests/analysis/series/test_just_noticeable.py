"""The smallest noticeable step, from choices whose scatter is known."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from analysis.records import SessionLog
from analysis.series import gather
from analysis.series.just_noticeable import PROBABLE_ERROR, Matches, fit, log_normal_between, observer_test, step_size
from tests.kept import known

Maker = Callable[..., SessionLog]
EXPOSURES_S = (1.3, 1.6, 2.0, 2.5, 3.0, 4.0)


def nearest(match: float) -> int:
    """Return the picture nearest to a match in log exposure."""
    return int(np.argmin(np.abs(np.log(EXPOSURES_S) - match)))


@pytest.mark.nightly
def test_the_scatter_of_many_choices_comes_back(make_choices: Maker) -> None:
    leaning = {f"{n:03d}": random.Random(n).gauss(0, 0.15) for n in range(120)}
    sessions = [
        make_choices(
            name, kinds=("base",), law=lambda rng, *_, lean=lean: nearest(np.log(2.2) + lean + rng.gauss(0, 0.25))
        )
        for name, lean in leaning.items()
    ]
    found = step_size(gather(sessions), "base")
    assert found.axis == "log"
    assert (found.choices, found.observers) == (600, 120)
    assert found.match == pytest.approx(2.2, rel=0.06)  # three standard errors: the observers' spread over root 120
    assert found.within == pytest.approx(0.25, abs=0.035)
    assert found.between == pytest.approx(0.15, abs=0.06)
    assert found.within_interval is not None
    low, high = found.within_interval
    assert low < 0.25 < (high or 0)
    assert found.step == PROBABLE_ERROR * (found.within or 0)
    assert found.ratio == pytest.approx(np.exp(found.step or 0))
    assert found.step_at is not None
    assert found.step_at[2] == pytest.approx(2.0 * (found.ratio or 0) - 2.0)
    assert found.expected is not None
    assert sum(found.expected) == pytest.approx(600)
    assert found.fit_p is not None
    assert found.fit_p > 0.01
    assert found.fit_by_observers is not None
    assert found.fit_by_observers.p > 0.01
    assert found.fit_by_observers.df == 3


@pytest.mark.nightly
def test_the_likelihood_is_that_of_its_integral() -> None:
    cuts = np.array([-np.inf, -0.5, 0.2, 0.9, np.inf])
    index = np.array([0, 1, 2, 2, 3, 1])
    observer = np.array([0, 0, 0, 1, 1, 2])
    matches = Matches.of(cuts[index], cuts[index + 1], observer)
    slow = 0.0
    for person in range(3):
        mine = index[observer == person]

        def chance(lean: float, mine: np.ndarray = mine) -> float:
            law = norm(0.1 + lean, 0.6)
            return float(np.prod([law.cdf(cuts[i + 1]) - law.cdf(cuts[i]) for i in mine]) * norm.pdf(lean, 0, 0.4))

        slow += np.log(quad(chance, -4, 4, epsabs=1e-13)[0])
    assert matches.log_likelihood(0.1, 0.6, 0.4) == pytest.approx(slow, abs=1e-9)


def test_without_repeats_the_fit_is_the_plain_one() -> None:
    """Five open or closed intervals, each observer once: the likelihood by the normal law's distribution function."""
    cuts = np.array([-np.inf, -0.5, 0.2, 0.9, np.inf])
    index = np.repeat([0, 1, 2, 3], [4, 9, 11, 3])
    matches = Matches.of(cuts[index], cuts[index + 1], np.arange(len(index)))
    found = fit(matches, 0.0, 2.0)
    assert not isinstance(found, str)
    match, within, between = found
    assert between == 0.0

    def slow(m: float, s: float) -> float:
        return float(np.log(norm.cdf((cuts[index + 1] - m) / s) - norm.cdf((cuts[index] - m) / s)).sum())

    here = slow(match, within)
    for step in (-1e-3, 1e-3):
        assert here >= slow(match + step, within)
        assert here >= slow(match, within + step)
    assert matches.log_likelihood(match, within, 0.0) == pytest.approx(here)


def test_chances_keep_their_digits_far_out() -> None:
    low, high = np.array([-1.0, 8.0, -40.0, -np.inf, 30.0]), np.array([1.0, 9.0, -39.0, -30.0, np.inf])
    expected = [np.log(norm.cdf(1) - norm.cdf(-1)), np.log(norm.sf(8) - norm.sf(9))]
    expected += [norm.logcdf(-39) + np.log1p(-np.exp(norm.logcdf(-40) - norm.logcdf(-39)))]
    expected += [norm.logcdf(-30), norm.logsf(30)]
    assert log_normal_between(low, high) == pytest.approx(np.array(expected), rel=1e-12)


@pytest.mark.parametrize(
    ("law", "reason"),
    [
        (lambda rng, *_: 2 + rng.randrange(2), "fewer than three"),
        (lambda rng, *_: 5, "fewer than three"),
        (lambda rng, *_: rng.choice([0, 0, 0, 5, 5, 5, 5, 2] if rng.random() < 0.05 else [0, 5]), "both ends"),
    ],
)
def test_what_cannot_be_told_is_said(make_choices: Maker, law: Callable[..., int], reason: str) -> None:
    sessions = [make_choices(f"{n:02d}", kinds=("base",), law=law) for n in range(20)]
    found = step_size(gather(sessions), "base")
    assert reason in found.reason
    assert (found.step, found.ratio, found.step_at, found.step_interval) == (None, None, None, None)


def test_observers_who_never_waver_are_finer_than_the_series(make_choices: Maker) -> None:
    sessions = [make_choices(f"{n:02d}", kinds=("base",), law=lambda *_, n=n: 1 + n % 4) for n in range(12)]
    assert "finer than the series" in step_size(gather(sessions), "base").reason


def test_the_fit_of_observers_who_differ_is_no_misfit_and_two_peaks_are() -> None:
    rng = np.random.default_rng(3)
    cuts = np.array([-np.inf, -1.0, -0.4, 0.2, 0.8, 1.4, np.inf])
    observer = np.repeat(np.arange(10), 6)

    def chances(match: float, sd: float) -> np.ndarray:
        return np.diff(norm.cdf((cuts - match) / sd))

    expected = 60 * chances(0.1, 0.8)
    slopes = 60 * np.column_stack(
        [
            (chances(0.1 + 1e-5, 0.8) - chances(0.1 - 1e-5, 0.8)) / 2e-5,
            (chances(0.1, 0.8 + 1e-5) - chances(0.1, 0.8 - 1e-5)) / 2e-5,
        ]
    )
    plain = false = found = 0
    for _ in range(80):
        matches = 0.1 + 0.77 * rng.standard_normal(10)[observer] + 0.2 * rng.standard_normal(60)
        peaks = 0.1 + 0.9 * np.where(rng.random(60) < 0.5, 1, -1) + 0.2 * rng.standard_normal(60)
        tests = []
        for values in (matches, peaks):
            took = np.eye(6)[np.searchsorted(cuts, values) - 1]
            test = known(observer_test(took - expected / 60, observer, expected, slopes))
            tests.append(test)
        false, found = false + (tests[0].p <= 0.05), found + (tests[1].p <= 0.05)
        plain += tests[0].statistic > 7.815  # χ² of 3 degrees of freedom
    assert tests[0].df == 3
    assert plain > 20
    assert false <= 11
    assert found > 70
