"""What reviewers ask, at the edges: levels and power by simulation, many observers, many items, huge counts."""

from __future__ import annotations

from time import process_time

import numpy as np
import pytest

from analysis.comparisons import Answer, from_answers
from analysis.inference import compare_models, equivalence, multiverse, pair_probabilities, pair_residuals, transitivity
from analysis.scaling import score
from benchmarks.reviewers import OBSERVERS, SPREADS, levels
from benchmarks.simulated_studies import Design, as_comparisons
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress


@pytest.mark.parametrize("observers", OBSERVERS)
@pytest.mark.parametrize("spread", SPREADS)
def test_levels_and_power(observers: int, spread: float) -> None:
    studies = how_many(120, 300)
    shares = {str(row["series"]): float(str(row["share"])) for row in levels(observers, spread, studies)}
    most = 0.05 + 3 * np.sqrt(0.05 * 0.95 / studies)
    for name, share in shares.items():
        if name.startswith("false"):
            assert share <= most, name
    if observers >= 15:
        assert shares["equal pairs called equivalent, 1.5 JND, Holm"] > 0.95
        assert shares["planted circle: weak transitivity"] > 0.85
        assert shares["planted circle: the pair flagged"] > 0.98


def test_a_thousand_observers() -> None:
    scores = score(as_comparisons(next(Design(np.linspace(-1, 1, 12), 1000, 0.7).studies(1, 1))))
    start = process_time()
    assert compare_models(scores.comparisons).folds == 10
    assert multiverse(scores, adjustments=("holm",)).fits == 2 * 21
    assert len(pair_residuals(scores).pairs) == 66
    result = transitivity(scores)
    assert result is not None
    assert result.triples == 220
    assert process_time() - start < 60


def test_a_hundred_items() -> None:
    scores = score(as_comparisons(next(Design(np.linspace(-1, 1, 100), 8).studies(1, 2))))
    start = process_time()
    result = transitivity(scores)
    assert result is not None
    assert result.triples == 161_700
    assert result.replicates == 123
    assert len(pair_probabilities(scores).pairs) == len(equivalence(scores, "1jnd").pairs) == 4950
    assert sum(pair.flagged for pair in pair_residuals(scores).pairs) <= 1
    assert process_time() - start < 120


def test_huge_and_tiny_counts() -> None:
    for size in (1e-3, 1e9):
        votes = {"ab": 3, "ba": 1, "bc": 5, "cb": 2, "ac": 9, "ca": 1.5}
        answers = [Answer(pair[0], pair[1], count * size) for pair, count in votes.items()]
        scores = score(from_answers(answers))
        for pair in pair_probabilities(scores).pairs:
            assert 0 <= pair.first_preferred.low <= pair.first_preferred.value <= pair.first_preferred.high <= 1
        assert all(pair.p is not None and 0 <= pair.p <= 1 for pair in pair_residuals(scores).pairs)
        result = transitivity(scores, replicates=200)
        assert result is not None
        assert result.strong.broken in (0, 1)
