"""Stochastic transitivity, beside counting by fractions and loops."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import combinations, permutations

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.inference import transitivity
from analysis.scaling import score
from tests.analysis.conftest import answers_of
from tests.kept import known

Maker = Callable[..., Comparisons]


def by_loops(comparisons: Comparisons) -> tuple[int, list[int], list[float], set[frozenset[str]]]:
    """Return the number of triples, how many break each property and by how much, and which break the strong one."""
    wins, ties, names = comparisons.wins, comparisons.tie_counts, comparisons.items
    half = Fraction(1, 2)

    def share(i: int, j: int) -> Fraction:
        total = Fraction(wins[i, j] + wins[j, i] + ties[i, j])
        return (Fraction(wins[i, j]) + Fraction(ties[i, j]) / 2) / total

    number, counts, which = 0, [0, 0, 0], set()
    short = [Fraction(0)] * 3
    for triple in combinations(range(len(names)), 3):
        if any(not (wins[i, j] + wins[j, i] + ties[i, j]) for i, j in combinations(triple, 2)):
            continue
        number += 1
        worst = [Fraction(0)] * 3
        for a, b, c in permutations(triple):
            ab, bc, ac = share(a, b), share(b, c), share(a, c)
            if ab >= half and bc >= half:
                for kind, bound in enumerate((half, min(ab, bc), max(ab, bc))):
                    worst[kind] = max(worst[kind], bound - ac)
        counts = [count + (fall > 0) for count, fall in zip(counts, worst, strict=True)]
        short = [total + fall for total, fall in zip(short, worst, strict=True)]
        if worst[2]:
            which.add(frozenset(names[item] for item in triple))
    return number, counts, [float(total) for total in short], which


@pytest.mark.parametrize(("gaps", "model"), [(0.0, "bradley-terry"), (0.6, "bradley-terry"), (0.3, "davidson")])
def test_counts_beside_loops(make: Maker, gaps: float, model: str) -> None:
    comparisons = make(np.linspace(-0.6, 0.6, 7), 4, gaps=gaps, model=model, k=-0.2, seed=3)
    result = transitivity(score(comparisons, model, method="map"), replicates=50)  # type: ignore[arg-type]  # a name out of a tuple
    assert result is not None
    number, counts, short, which = by_loops(comparisons)
    assert result.triples == number
    assert [test.broken for test in result.properties] == counts
    assert [test.shortfall for test in result.properties] == pytest.approx(short, abs=1e-9)
    assert {frozenset(triple.items) for triple in result.broken} == which
    if not gaps:
        assert number == 35
    assert 0 < counts[0] < counts[2]
    for triple in result.broken:
        ab, bc, ac = triple.shares
        assert min(ab, bc) >= 0.5
        assert triple.depth == pytest.approx(max(ab, bc) - ac)
        assert triple.depth > 0
    assert sum(times for _, _, times in result.pairs) == len(which)


def test_shares_that_are_equal_break_nothing() -> None:
    votes = {"ab": 3, "ba": 1, "bc": 6, "cb": 2, "ac": 9, "ca": 3}  # all 3 of 4: equal to the larger is strong enough
    result = transitivity(
        score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()])), replicates=20
    )
    assert result is not None
    assert [test.broken for test in result.properties] == [0, 0, 0]
    assert result.broken == ()


def test_a_planted_circle_is_more_than_chance(make: Maker) -> None:
    plain = make(np.array([1.5, 0.9, 0.3, -0.3, -0.9, -1.5]), 25)
    within = known(transitivity(score(plain), replicates=400))
    assert not any(test.exceeds for test in within.properties)
    worst, best = plain.items[5], plain.items[0]
    answers = [one for one in answers_of(plain) if {one.winner, one.loser} != {worst, best}]
    answers += [Answer(worst, best, 1, observer) for observer in plain.observers]
    result = known(transitivity(score(from_answers(answers, plain.items)), replicates=400))
    assert result.weak.broken >= 4
    assert result.weak.exceeds
    assert result.pairs[0][:2] == (best, worst)
    assert "Distinguished from chance: weak" in result.sentence
    assert result.weak.expected < 2


def test_without_observers_or_triples(make: Maker) -> None:
    votes = {"ab": 3, "ba": 1, "bc": 6, "cb": 2}
    assert transitivity(score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()]))) is None
    votes |= {"ac": 3, "ca": 2}
    result = transitivity(
        score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()])), replicates=30
    )
    assert result is not None
    assert result.strong.p_observers is None
    with pytest.raises(ResultsError, match="0 replicates"):
        transitivity(score(make(np.zeros(3))), replicates=0)
