"""Observers in numbers: p values under chance, outliers nobody is, many items, many observers."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb
from time import process_time

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from analysis.comparisons import Comparisons
from analysis.observers import observers_in_comparisons
from analysis.observers.concordance import kendall_u
from analysis.observers.consistency import consistencies
from analysis.observers.fit_to_rest import fits_to_rest
from analysis.observers.tails import Tail
from tests.stress.answered import answered
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress


def answers(theta: NDArray[np.float64], observers: int, random: np.random.Generator, gaps: float = 0.0) -> Comparisons:
    """Let everyone answer every pair once by ``theta``, or a random part of them."""
    n = len(theta)
    first, second = np.triu_indices(n, 1)
    one, other = np.tile(first, observers), np.tile(second, observers)
    observer = np.repeat(np.arange(observers), len(first))
    kept = random.random(len(one)) >= gaps
    one, other, observer = one[kept], other[kept], observer[kept]
    won = random.random(len(one)) < 1 / (1 + np.exp(theta[other] - theta[one]))
    return answered(n, np.where(won, one, other), np.where(won, other, one), observers, observer=observer)


def check_uniform(tails: Sequence[Tail], random: np.random.Generator, slack: float = 0.0) -> None:
    assert kstest(
        [tail.randomised_p(random.random()) for tail in tails], "uniform"
    ).statistic <= slack + 1.63 / np.sqrt(len(tails))
    p = np.array([tail.p for tail in tails])
    for level in (0.01, 0.05, 0.1):
        assert (p <= level).mean() <= level + slack + 3 * np.sqrt(level * (1 - level) / len(p))


@pytest.mark.parametrize(("n", "gaps"), [(6, 0.0), (10, 0.0), (20, 0.0), (12, 0.3)])
def test_p_of_zeta_is_uniform_under_chance(n: int, gaps: float) -> None:
    random = np.random.default_rng(n)
    found = consistencies(answers(np.zeros(n), 4000, random, gaps))
    tails = [line.test for line in found if line.test]
    assert len(tails) == 4000
    # Above ten items, and with gaps, the law is that of three moments: within 0.01 of the exact one.
    check_uniform(tails, random, slack=0.0 if n <= 10 and not gaps else 0.01)


@pytest.mark.parametrize(("n", "observers", "gaps"), [(10, 30, 0.0), (6, 3, 0.0), (10, 15, 0.4), (24, 30, 0.0)])
def test_p_of_u_is_uniform_under_chance(n: int, observers: int, gaps: float) -> None:
    random = np.random.default_rng(n + observers)
    tails = []
    for _ in range(how_many(400, 1000)):
        found = kendall_u(answers(np.zeros(n), observers, random, gaps), shuffles=0)
        assert found is not None
        assert found.chance is not None
        tails.append(found.chance)
    check_uniform(tails, random, slack=0.0 if tails[0].exact else 0.01)


@pytest.mark.parametrize(("observers", "most"), [(30, 0.055), (15, 0.065), (10, 0.075), (5, 0.1)])
def test_how_often_anybody_is_called_an_outlier_who_is_none(observers: int, most: float) -> None:
    random = np.random.default_rng(observers)
    flagged, studies = 0, how_many(500, 1500)
    for _ in range(studies):
        lines = fits_to_rest(answers(random.normal(0, 0.7, 10), observers, random))
        assert all(lines)
        flagged += any(line.outlier for line in lines if line)
    # The rates that docs/observer_table.md tells, and three standard errors.
    assert flagged / studies <= most + 3 * np.sqrt(most * (1 - most) / studies)


@pytest.mark.parametrize(("n", "observers", "seconds"), [(100, 30, 60), (10, 1000, 60), (2, 1000, 30), (300, 5, 180)])
def test_many_items_and_many_observers(n: int, observers: int, seconds: float) -> None:
    random = np.random.default_rng(1)
    comparisons = answers(random.normal(0, 1, n), observers, random)
    start = process_time()
    table = observers_in_comparisons(comparisons)
    assert process_time() - start < seconds
    assert len(table.lines) == observers
    assert all(line.fit and line.answers == comb(n, 2) for line in table.lines)
    assert table.concordance is not None
    assert table.concordance.u > 0
