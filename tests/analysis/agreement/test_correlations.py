"""Correlations in a batch are SciPy's one by one, also with ties; what is constant correlates with nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from analysis.agreement import KINDS, CorrelationKind, correlation
from analysis.agreement.correlations import direction, mean_ranks

PEERS: dict[str, Any] = {"pearson": stats.pearsonr, "spearman": stats.spearmanr, "kendall": stats.kendalltau}


@pytest.mark.parametrize("count", [1, 2, 20, 21])
def test_ranks_are_scipys_for_few_values_and_many(count: int) -> None:
    values = np.rint(np.random.default_rng(5).normal(0, 3, (50, 2, count)))
    values[:7, :, 0] = np.inf
    assert np.array_equal(mean_ranks(values), stats.rankdata(values, axis=-1))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("whole_numbers", [False, True])
def test_a_batch_is_scipys_one_by_one(kind: CorrelationKind, whole_numbers: bool) -> None:
    random = np.random.default_rng(4)
    scores, values = random.normal(0, 2, (40, 3, 8)), random.normal(0, 2, 8)
    if whole_numbers:  # many ties
        scores, values = np.rint(scores), np.rint(values)
    expected = [[PEERS[kind](row, values)[0] for row in rows] for rows in scores]
    assert correlation(scores, values, kind) == pytest.approx(np.array(expected), abs=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_what_does_not_vary_correlates_with_nothing(kind: CorrelationKind) -> None:
    rising = np.arange(5.0)
    # 0.1 + 0.2 is not 0.3: such a constant differs by rounding.
    constant = np.array([0.3, 0.1 + 0.2, 0.3, 0.3, 0.1 + 0.2])
    assert correlation(constant, rising, kind) == 0
    assert correlation(rising, constant, kind) == 0


@pytest.mark.parametrize("kind", ["spearman", "kendall"])
def test_values_equal_but_for_rounding_are_ties(kind: CorrelationKind) -> None:
    scores = np.array([1.0, 2.0, 3.0, 4.0])
    near = np.array([0.3, 0.1 + 0.2, 0.7, 0.9])
    assert correlation(scores, near, kind) == correlation(scores, np.array([0.3, 0.3, 0.7, 0.9]), kind)


@pytest.mark.parametrize("kind", KINDS)
def test_the_direction_of_a_measure_agrees_with_it_perfectly(kind: CorrelationKind) -> None:
    values = np.array([3.0, -1.0, 10.0, 4.0])
    along = direction(values, kind)
    assert along.sum() == pytest.approx(0, abs=1e-12)
    assert along @ along == pytest.approx(1, abs=1e-12)
    assert correlation(along, values, kind) == pytest.approx(1, abs=1e-12)
