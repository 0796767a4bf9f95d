"""Separation in every model: against a slow criterion, and what is said of it."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.scaling import Model, ModelMethod, count_pairs, fit_model, maximise
from analysis.scaling.laws import Davidson
from analysis.scaling.separation import find_separation, strong_groups

NAMES = "abcd"
METHODS: tuple[ModelMethod, ...] = ("ml", "map")
PAIRS = list(combinations(range(4), 2))


def built(counts: list[tuple[int, int, int]]) -> Comparisons:
    answers = []
    for (one, other), (won, lost, tied) in zip(PAIRS, counts, strict=True):
        pair = NAMES[one], NAMES[other]
        answers += [Answer(*pair, won), Answer(*pair[::-1], lost), Answer(*pair, tied, tie=True)]
    return from_answers(answers, NAMES)


def is_held_by_ties_and_wins(comparisons: Comparisons) -> bool:
    """Say whether no direction (a, t) of recession exists.

    With t = 0 the items joined by wins and ties must hang together; with t = 1 the differences a_i − a_j ≥ 1 of wins
    and ≥ −1 of ties, both ways, have no solution exactly if some cycle of them has a positive length.
    """
    ties, wins = comparisons.tie_counts > 0, comparisons.wins > 0
    if len(strong_groups((ties | wins).astype(float))) > 1:
        return False
    longest = np.where(wins, 1.0, np.where(ties, -1.0, -np.inf))
    for middle in range(len(longest)):
        longest = np.maximum(longest, longest[:, [middle]] + longest[[middle], :])
    return bool((np.diag(longest) > 0).any())


@settings(max_examples=50)
@given(st.lists(st.tuples(*[st.integers(0, 1)] * 3), min_size=6, max_size=6))
def test_ties_and_wins_are_judged_as_by_cycles(counts: list[tuple[int, int, int]]) -> None:
    if not any(tied for _, _, tied in counts):
        return
    comparisons = built(counts)
    cells, _ = count_pairs(comparisons, ties=True)
    held = is_held_by_ties_and_wins(comparisons)
    assert (find_separation(cells, comparisons.items, ties=True) is None) == held
    if held:
        top = maximise(cells, Davidson())
        assert top.converged.all()
        assert np.abs(top.theta).max() < 20


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.permutations(range(3)), st.booleans()), min_size=3, max_size=14))
def test_where_an_order_effect_is_held_it_is_found(trials: list[tuple[list[int], bool]]) -> None:
    """Where it is not, ever wider priors give ever larger numbers."""
    answers = [Answer(NAMES[order[1 - won]], NAMES[order[won]], first=NAMES[order[0]]) for order, won in trials] + [
        Answer("a", "b", first="a"),
        Answer("c", "a", first="a"),
        Answer("b", "c", first="c"),
    ]
    comparisons = from_answers(answers, "abc")
    fitted = fit_model(comparisons, order_effect=True)
    wide, wider = (fit_model(comparisons, method="map", prior_sd=sd, order_effect=True) for sd in (1e2, 1e4))
    if wide.separation or wider.separation:
        assert fitted.separation
        return
    reach = [abs(f.parameters[0].estimate) + np.abs(f.theta).max() for f in (wide, wider)]
    if fitted.separation:
        assert reach[1] > reach[0] + 1
    else:
        assert fitted.converged
        assert reach[1] == pytest.approx(reach[0], rel=0.1, abs=0.1)


@pytest.mark.parametrize("model", ["bradley-terry", "thurstone", "davidson", "rao-kupper"])
def test_an_item_that_always_wins_is_named(model: Model) -> None:
    answers = [Answer("a", "b", 5), Answer("b", "c", 2), Answer("c", "b", 3), Answer("b", "c", 1, tie=True)]
    fitted = fit_model(from_answers(answers), model)
    assert fitted.separation is not None
    assert fitted.separation.groups == ((0,), (1, 2))
    assert "'a', then 'b', 'c'" in fitted.separation.sentences[0]
    assert np.isnan(fitted.theta).all()
    assert not fitted.converged
    assert fitted.to_json()["log_likelihood"] is None


@pytest.mark.parametrize("model", ["bradley-terry", "thurstone", "davidson"])
def test_items_never_compared_are_named(model: Model) -> None:
    answers = [
        Answer(pair[0], pair[1], tie=tie) for pair in ("ab", "ba", "cd", "dc", "ce", "ec") for tie in (False, True)
    ]
    fitted = fit_model(from_answers(answers), model)
    assert fitted.separation is not None
    assert fitted.separation.sentences == ("'a', 'b': never compared with the other items.",)


def test_ties_alone_can_leave_the_items_free() -> None:
    """The one win can be made certain, and both ties too, by moving c midway and making ties ever more likely."""
    answers = [Answer("a", "b"), Answer("b", "c", tie=True), Answer("a", "c", tie=True)]
    fitted = fit_model(from_answers(answers), "davidson")
    assert fitted.separation is not None
    assert "ties grow more likely" in fitted.separation.sentences[0]
    assert fit_model(from_answers(answers), "davidson", method="map").converged


def test_ties_and_nothing_else_say_so() -> None:
    only = from_answers([Answer("a", "b", 4, tie=True), Answer("b", "c", 4, tie=True)])
    for method in METHODS:
        fitted = fit_model(only, "rao-kupper", method=method)
        assert fitted.separation is not None
        assert fitted.separation.sentences == ("Every answer is a tie: nothing distinguishes the items.",)


def test_a_place_that_always_wins_says_so() -> None:
    answers = [Answer("a", "b", first="a"), Answer("b", "a", first="b"), Answer("b", "c", first="b")]
    answers += [Answer("c", "b", first="c")]
    for method in METHODS:
        fitted = fit_model(from_answers(answers), order_effect=True, method=method)
        assert fitted.separation is not None
        assert fitted.separation.sentences == ("The item shown first won every comparison that was decided.",)


def test_an_order_that_follows_the_items_says_so() -> None:
    answers = [Answer("a", "b", first="a"), Answer("b", "a", first="a"), Answer("b", "c", first="b")]
    answers += [Answer("c", "b", first="b")]
    fitted = fit_model(from_answers(answers), order_effect=True)
    assert fitted.separation is not None
    assert "cannot be distinguished" in fitted.separation.sentences[0]


def test_two_groups_of_which_one_always_won_are_separated_in_whatever_order_they_were_shown() -> None:
    pairs = ["ab", "ba", "cd", "dc", "ac", "ad", "bc", "bd"]
    answers = [Answer(pair[0], pair[1], first=first) for pair in pairs for first in pair]
    fitted = fit_model(from_answers(answers), order_effect=True)
    assert fitted.separation is not None
