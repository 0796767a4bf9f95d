"""Goodness of fit against its definition, and its word of caution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, chisquare

from analysis.comparisons import Comparisons
from analysis.scaling import count_pairs, fit_model
from analysis.scaling.laws import Davidson
from analysis.scaling.result import goodness_of_fit


@pytest.mark.promise("believable-scores")
def test_deviance_and_pearson_are_sums_over_the_answers_to_each_pair(pudding: Comparisons) -> None:
    fitted = fit_model(pudding, "davidson")
    cells, _ = count_pairs(pudding, ties=True)
    deviance = pearson = 0.0
    k = fitted.parameters[0].estimate
    for i, j, *observed in zip(cells.first, cells.second, cells.won[0], cells.lost[0], cells.tied[0], strict=True):
        chances = Davidson().probabilities(np.array([fitted.theta[i] - fitted.theta[j]]), k)
        expected = np.concatenate(chances) * sum(observed)
        deviance += 2 * float((observed * np.log(observed / expected)).sum())
        pearson += float(chisquare(observed, expected).statistic)
    goodness = fitted.goodness
    assert goodness is not None
    assert goodness.deviance == pytest.approx(deviance, rel=1e-10)
    assert goodness.pearson == pytest.approx(pearson, rel=1e-10)
    assert goodness.p_pearson == pytest.approx(chi2.sf(pearson, 24), rel=1e-9)
    assert goodness.caveat is None


def test_small_counts_are_told_and_no_freedom_has_no_p(pudding: Comparisons) -> None:
    cells, _ = count_pairs(pudding)
    half = np.full((1, len(cells.first)), 0.5)
    few = type(cells)(6, cells.first, cells.second, cells.won / 20, cells.lost / 20, cells.tied)
    goodness = goodness_of_fit(few, (half, half, 0 * half), 5, ties=False)
    assert goodness.share_small == 1
    assert goodness.caveat is not None
    assert "100%" in goodness.caveat
    assert goodness_of_fit(cells, (half, half, 0 * half), 15, ties=False).p_deviance is None
