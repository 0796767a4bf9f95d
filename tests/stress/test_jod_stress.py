"""JOD as pwcmp has them, over many sparse, unanimous and lopsided tables: the objective's slope is 0 at every fit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr

from analysis.jod.fits import fit_jod
from analysis.scaling import compared_groups
from analysis.scaling.separation import strong_groups
from documents.arrays import Floats

pytestmark = pytest.mark.stress


def objective(q: Floats, wins: Floats) -> float:
    """Return what pwcmp minimises, both orders of each pair."""
    rows, columns = np.nonzero(wins + wins.T)
    won, lost = wins[rows, columns], wins[columns, rows]
    shifted = np.where(won == 0, 1.0, np.where(lost == 0, won - 1, won))
    d = (q[rows] - q[columns]) / 1.4826
    likelihood = np.exp(shifted * log_ndtr(d)[:, None] + (won + lost - shifted) * log_ndtr(-d)[:, None])
    prior = ((likelihood + 1e-8) / (likelihood.sum(axis=0) + 1e-8)).sum(axis=1)
    logs = won * log_ndtr(d) + lost * log_ndtr(-d) + np.log(prior + 0.1)
    return float(0.01 * np.mean(q) ** 2 - logs.sum())


@pytest.mark.parametrize("n", [2, 3, 6, 12])
@pytest.mark.parametrize("answers", [1, 2, 5, 20, 200])
def test_no_table_is_answered_worse_than_by_scipy(n: int, answers: int) -> None:
    random = np.random.default_rng(100 * n + answers)
    first, second = np.triu_indices(n, 1)
    checked = 0
    for sd in (0.3, 1.0, 4.0):
        for share in (0.4, 1.0):
            jod = random.normal(0, sd, n)
            total = answers * (random.random(len(first)) < share)
            won = random.binomial(total, ndtr((jod[first] - jod[second]) / 1.4826))
            wins = np.zeros((n, n))
            wins[first, second], wins[second, first] = won, total - won
            if len(compared_groups(wins)) > 1:
                continue
            fit = fit_jod(wins[None], "gaussian")
            if not fit.converged[0]:  # only where items are separated: the plain likelihood has no maximum either
                assert len(strong_groups(wins)) > 1
                assert np.isnan(fit.jod).all()
                continue
            (ours,) = fit.jod
            found = minimize(objective, ours, args=(wins,), method="BFGS", jac="3-point", options={"gtol": 1e-7}).x
            assert np.abs(found - found.mean() - ours).max() < 1e-4  # what SciPy can still find is rounding
            assert objective(ours, wins) <= objective(found, wins) + 1e-8
            checked += 1
    assert checked or answers < 3
