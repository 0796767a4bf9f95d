"""Which place each observer chose, and how often they said the same again."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from analysis.comparisons.comparisons import Answer, from_answers
from analysis.observers.repeats import self_agreements
from analysis.observers.sides import side_biases


def test_the_share_of_the_first_position_with_its_interval_and_chance() -> None:
    answers = [Answer("a", "b", 7, "01", "a"), Answer("b", "a", 2, "01", "a"), Answer("a", "b", 3, "02")]
    leaning, unknown = side_biases(from_answers(answers))
    assert unknown is None
    assert leaning is not None
    assert (leaning.first, leaning.answers) == (7, 9)
    assert leaning.p == pytest.approx(2 * binom(9, 0.5).sf(6))
    # Wilson's limits are where the observed share lies 1.96 standard errors away.
    for limit in (leaning.low, leaning.high):
        assert abs(7 / 9 - limit) == pytest.approx(1.959964 * np.sqrt(limit * (1 - limit) / 9), rel=1e-5)
    assert leaning.to_json()["share"] == 7 / 9


def test_ties_say_nothing_of_sides() -> None:
    (side,) = side_biases(from_answers([Answer("a", "b", 1, first="a"), Answer("a", "b", 5, first="a", tie=True)]))
    assert side is not None
    assert side.answers == 1


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["ab", "ba", "bc", "ca"]), st.booleans(), st.integers(0, 1)), max_size=20))
def test_every_two_answers_to_a_pair_are_held_against_each_other(given_answers: list[tuple[str, bool, int]]) -> None:
    answers = [Answer(pair[0], pair[1], 1.0, str(person), tie=tie) for pair, tie, person in given_answers]
    if not answers:
        return
    comparisons = from_answers(answers)
    for name, found in zip(comparisons.observers, self_agreements(comparisons), strict=True):
        own = [answer for answer in answers if answer.observer == name]
        outcomes = [(frozenset((one.winner, one.loser)), "tie" if one.tie else one.winner) for one in own]
        twos = [(one, other) for one, other in combinations(outcomes, 2) if one[0] == other[0]]
        if not twos:
            assert found is None
            continue
        assert found is not None
        assert found.twos == len(twos)
        assert found.alike == sum(one == other for one, other in twos)
        assert found.repeated == sum(count > 1 for count in Counter(pair for pair, _ in outcomes).values())
        assert 0 <= found.share <= 1


def test_weights_are_no_repetitions() -> None:
    assert self_agreements(from_answers([Answer("a", "b", 1.5), Answer("b", "a", 0.7)])) == (None,)
    assert self_agreements(from_answers([Answer("a", "b", 1)])) == (None,)
