"""Ten observers, from which on the report takes standard errors by observer, are enough for them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from analysis.bootstrap.stability import Covariance
from analysis.comparisons.comparisons import Answer, from_answers
from analysis.report.estimate import FEWEST_FOR_SANDWICH, estimate_scores

pytestmark = pytest.mark.stress
STUDIES, ITEMS = 600, 10


def false_differences(observer_sd: float, covariance: Covariance, seed: int) -> float:
    """Return the share of studies of equal items in which any two are told apart at 0.05, by Holm's correction."""
    rng = np.random.default_rng(seed)
    names = [f"item {number}" for number in range(ITEMS)]
    wrong = studies = 0
    while studies < STUDIES:
        answers = []
        for observer in range(FEWEST_FOR_SANDWICH):
            own = rng.normal(0, observer_sd, ITEMS)
            for one, other in combinations(range(ITEMS), 2):
                better = rng.random() < 1 / (1 + np.exp(own[other] - own[one]))
                pair = (one, other) if better else (other, one)
                answers.append(Answer(names[pair[0]], names[pair[1]], 1.0, str(observer), names[one], False))
        comparisons = from_answers(answers, names)
        found = estimate_scores(comparisons, alpha=0.05, adjust="holm", covariance=covariance, draw=False)
        if found.method == "ml" and found.scores.classes is not None:
            studies += 1
            wrong += len(found.scores.classes.members) > 1
    return wrong / STUDIES


@pytest.mark.parametrize("observer_sd", [0.0, 0.7])
def test_by_observer_the_level_holds(observer_sd: float) -> None:
    """Holm's bound is 5 %; the standard error of 600 studies is 0.9 %."""
    assert false_differences(observer_sd, "sandwich", 1) <= 0.05 + 2 * 0.009


def test_by_the_model_it_does_not_where_observers_differ() -> None:
    assert false_differences(0.7, "model", 2) > 0.15
