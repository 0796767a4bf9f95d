"""Moments by the quick formula against those by the law; the rough information against the exact one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from analysis.comparisons import Comparisons
from analysis.comparisons.comparisons import from_arrays
from analysis.covariance import laplacian
from analysis.hierarchical.fitting import _answers
from analysis.hierarchical.propagation import (
    _logistic_moments,
    _moments,
    _rough_links,
    _solved,
    alike,
    propagate,
)
from analysis.scaling import LOGISTIC, Counts
from tests.kept import known

Maker = Callable[..., Comparisons]


def test_quick_logistic_moments_are_those_of_the_law() -> None:
    random = np.random.default_rng(1)
    pairs = 3000
    won, lost = random.integers(0, 4, (2, pairs)).astype(float)
    won += (won + lost == 0) * 0.5
    counts = Counts(2, np.zeros(pairs, np.intp), np.ones(pairs, np.intp), won[None], lost[None], 0 * won[None])
    mean, deviation = random.normal(0, 1, pairs), random.uniform(1e-3, 0.8, pairs)
    v = random.uniform(0, 0.25, pairs) * (won + lost) * (deviation < 0.7)
    site = (mean, deviation, random.normal(0, 0.3, pairs), v)
    quick = known(_logistic_moments(counts, *site))
    for one, other in zip(quick, _moments(counts, LOGISTIC, *site), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)
    assert _logistic_moments(counts, 60 * mean, *site[1:]) is None
    assert _logistic_moments(counts, mean, 20 * deviation, *site[2:]) is None
    many = Counts(2, counts.first, counts.second, 1000 * counts.won, counts.lost, counts.tied)
    assert _logistic_moments(many, *site) is None


@pytest.mark.parametrize(("items", "neighbours", "near"), [(12, 12, 0.02), (30, 2, 0.02), (3, 3, 1e-9), (2, 2, 1e-9)])
def test_rough_information_has_the_exact_row_sums(make: Maker, items: int, neighbours: int, near: float) -> None:
    """With every pair compared it is near the exact one; far pairs of a chain get more weight than they have."""
    comparisons = make(np.linspace(-1, 1, items), 20, 0.8, repeats=2)
    close = abs(comparisons.winner - comparisons.loser) <= neighbours
    columns = {name: getattr(comparisons, name)[close] for name in ("winner", "loser", "observer", "count")}
    columns |= {"winner_was_first": np.full(close.sum(), -1, np.int8), "tie": np.zeros(close.sum(), np.bool_)}
    answers, _ = _answers(from_arrays(comparisons.items, comparisons.observers, **columns))
    blocks, counts = answers.blocks, answers.counts
    sites = propagate(answers, LOGISTIC, 0.8, alike(answers, LOGISTIC, np.linspace(-1, 1, items)), 1e-6)
    delta = counts.differences(sites.theta[None])[0]
    solution = _solved(blocks, 0.64, sites.slope - sites.precision * delta, sites.precision)
    rough = _rough_links(counts, blocks, 0.64, solution)
    np.testing.assert_allclose(rough.sum(axis=1), sites.links.sum(axis=1), rtol=1e-6)
    variances, exact = (np.diag(laplacian.pseudo_inverse(links[None])[0]) for links in (rough, sites.links))
    assert (variances < (1 + near) * exact).all()
    if neighbours >= items:
        np.testing.assert_allclose(variances, exact, rtol=near)
