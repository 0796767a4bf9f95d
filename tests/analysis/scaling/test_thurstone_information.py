"""Thurstone's standard errors by the observed and the expected information, which are not the same."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from analysis.covariance import pair_variances
from analysis.scaling import Counts, Probit, maximise
from analysis.scaling.newton import joint_covariance
from analysis.scaling.separation import items_are_linked


def test_thurstones_errors_by_observed_information_are_near_those_by_the_expected() -> None:
    rng = np.random.default_rng(1)
    law, n, answers = Probit(), 10, 5
    worst: list[float] = []
    first, second = np.triu_indices(n, 1)
    while len(worst) < 100:
        theta = rng.normal(0, 0.7, n)
        won = rng.binomial(answers, ndtr(theta[first] - theta[second])).astype(np.float64)[None]
        counts = Counts(n, first, second, won, answers - won, 0 * won)
        if not items_are_linked(counts):
            continue
        top = maximise(counts, law)
        chance = ndtr(counts.differences(top.theta))
        expected = Counts(n, first, second, answers * chance, answers * (1 - chance), 0 * won)
        variances = [pair_variances(joint_covariance(one, law, top.point)[0]) for one in (counts, expected)]
        worst.append(float(np.abs(np.sqrt(variances[0] / variances[1]) - 1).max()))
    assert min(worst) > 0.005
    assert 0.05 < max(worst) < 0.08
