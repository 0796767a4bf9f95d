"""Influence and sandwich against sums written out, and against leaving observers out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from analysis.bootstrap.influence import influences, standard_errors
from analysis.bootstrap.replicates import counts_by_observer
from analysis.comparisons import Comparisons
from analysis.scaling import fit, probabilities

Study = Callable[..., Comparisons]
STRENGTHS = (-0.8, -0.2, 0.1, 0.9)


def test_the_sandwich_is_bread_meat_bread(study: Study) -> None:
    by_observer, _ = counts_by_observer(study(STRENGTHS))
    weights = np.random.default_rng(1).integers(0, 3, 12).astype(float)
    wins = np.tensordot(weights, by_observer, 1)
    fitted = fit(wins)
    meat = np.zeros((4, 4))
    for counts, weight in zip(by_observer, weights, strict=True):
        slope = (counts - (counts + counts.T) * probabilities(fitted.theta)).sum(axis=1)
        meat += weight * np.outer(slope, slope)
    people = weights.sum()
    expected = people / (people - 1) * fitted.covariance @ meat @ fitted.covariance
    pulled = influences(by_observer, weights[None], fitted.theta[None])
    drawn = pulled[0] * np.sqrt(weights * people / (people - 1))[:, None]
    assert drawn.T @ drawn == pytest.approx(expected, abs=1e-12)
    assert standard_errors(pulled, weights[None])[0] == pytest.approx(np.sqrt(np.diag(expected)), abs=1e-12)


def test_an_influence_is_what_an_observer_more_or_less_changes(study: Study) -> None:
    by_observer, _ = counts_by_observer(study(STRENGTHS))
    total = by_observer.sum(axis=0)
    fitted = fit(total)
    pulled = influences(by_observer, np.ones((1, 12)), fitted.theta[None])[0]
    assert pulled.sum(axis=0) == pytest.approx(np.zeros(4), abs=1e-12)
    for counts, moved in zip(by_observer, pulled, strict=True):
        nudged = (fit(total + 1e-5 * counts).theta - fit(total - 1e-5 * counts).theta) / 2e-5
        assert moved == pytest.approx(nudged, abs=1e-6)


def test_observers_who_all_saw_other_pairs(study: Study) -> None:
    """Each observer answers one pair only: the expected part differs between observers."""
    by_observer = np.zeros((6, 3, 3))
    for person, (winner, loser) in enumerate([(0, 1), (1, 0), (1, 2), (2, 1), (0, 2), (2, 0)]):
        by_observer[person, winner, loser] = 1
    pulled = influences(by_observer, np.ones((1, 6)), np.zeros((1, 3)))
    # Two answers for each pair, all items equal: H is 1.5 times the identity on what sums to zero, and the slope ±1/2.
    assert pulled[0, 0] == pytest.approx([1 / 3, -1 / 3, 0])
    assert pulled[0, 3] == pytest.approx([0, -1 / 3, 1 / 3])


def test_observers_who_all_answer_alike_pull_nowhere() -> None:
    """After a penalised fit each alone has a slope; what is left of them about their mean is rounding, and is 0."""
    own = np.triu(np.ones((5, 5)), 1)
    theta = fit(13 * own, method="firth").theta
    assert not influences(np.tile(own, (13, 1, 1)), np.ones((1, 13)), theta[None]).any()
