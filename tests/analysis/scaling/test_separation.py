"""Separation in every model, and what to do where there are no finite scores."""

from __future__ import annotations

from itertools import combinations, product
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.scaling import (
    MODELS,
    Model,
    ModelMethod,
    are_connected,
    compared_groups,
    count_pairs,
    fit_model,
    maximise,
    problem_lines,
    score,
    score_blocks,
)
from analysis.scaling.laws import Davidson
from analysis.scaling.separation import find_separation, separated_items, separation_sentences, strong_groups
from analysis.scaling.shown import remedies
from documents.pages import Paragraph
from tests.kept import known


# Ford's condition, against reachability by hand.
def graphs(n: int = 6) -> st.SearchStrategy[NDArray[np.float64]]:
    return st.lists(st.sampled_from([0, 0, 0, 1, 2]), min_size=n * n, max_size=n * n).map(
        lambda values: np.array(values, dtype=float).reshape(n, n) * (1 - np.eye(n))
    )


def reaches(wins: NDArray[np.float64], start: int) -> set[int]:
    met, waiting = {start}, [start]
    while waiting:
        for item in np.flatnonzero(wins[waiting.pop()] > 0).tolist():
            if item not in met:
                met.add(item)
                waiting.append(item)
    return met


@given(graphs())
def test_groups_are_what_reaches_each_other_and_no_group_loses_to_a_later_one(wins: NDArray[np.float64]) -> None:
    groups = strong_groups(wins)
    reach = [reaches(wins, item) for item in range(6)]
    place = {item: number for number, group in enumerate(groups) for item in group}
    assert sorted(place) == list(range(6))
    for a in range(6):
        for b in range(6):
            assert (place[a] == place[b]) == (b in reach[a] and a in reach[b])
            if wins[a, b]:
                assert place[a] <= place[b]
    assert are_connected(wins[None])[0] == (len(groups) == 1)


@given(graphs())
def test_compared_groups_do_not_look_at_who_won(wins: NDArray[np.float64]) -> None:
    groups = compared_groups(wins)
    assert {frozenset(group) for group in groups} == {frozenset(reaches(wins + wins.T, item)) for item in range(6)}


@pytest.mark.parametrize(
    ("groups", "items"),
    [
        (((0, 1, 2),), ()),
        ((), ()),
        (((0,), (1, 2, 3)), (0,)),
        (((2,), (0, 1), (3,)), (2, 3)),
        (((0, 1), (2, 3)), (0, 1, 2, 3)),
        (((1,), (0,)), (0, 1)),
    ],
)
def test_separated_items_stand_outside_the_one_largest_group(
    groups: tuple[tuple[int, ...], ...], items: tuple[int, ...]
) -> None:
    assert separated_items(groups) == items


def test_sentences_say_who_never_lost_or_won_or_met_the_others() -> None:
    chain = np.array([[0, 2, 0], [0, 0, 3], [0, 0, 0]], dtype=float)
    assert separation_sentences(strong_groups(chain), chain, "abc") == [
        "'a': never lost to any of the other items (2 wins).",
        "'b': never won against 'a', never lost to 'c'.",
        "'c': never won against any of the other items (3 losses).",
    ]
    apart = np.zeros((3, 3))
    apart[0, 1] = apart[1, 0] = 1
    assert separation_sentences(strong_groups(apart), apart, "abc") == [
        "'a', 'b': never compared with the other items.",
        "'c': never compared with the other items.",
    ]


# Separation in every model: against a slow criterion, and what is said of it.

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
    assert known(fitted.separation).groups == ((0,), (1, 2))
    assert "'a', then 'b', 'c'" in known(fitted.separation).sentences[0]
    assert np.isnan(fitted.theta).all()
    assert not fitted.converged
    assert fitted.to_json()["log_likelihood"] is None


@pytest.mark.parametrize("model", ["bradley-terry", "thurstone", "davidson"])
def test_items_never_compared_are_named(model: Model) -> None:
    answers = [
        Answer(pair[0], pair[1], tie=tie) for pair in ("ab", "ba", "cd", "dc", "ce", "ec") for tie in (False, True)
    ]
    fitted = fit_model(from_answers(answers), model)
    assert known(fitted.separation).sentences == ("'a', 'b': never compared with the other items.",)


def test_ties_alone_can_leave_the_items_free() -> None:
    """The one win can be made certain, and both ties too, by moving c midway and making ties ever more likely."""
    answers = [Answer("a", "b"), Answer("b", "c", tie=True), Answer("a", "c", tie=True)]
    fitted = fit_model(from_answers(answers), "davidson")
    assert "ties grow more likely" in known(fitted.separation).sentences[0]
    assert fit_model(from_answers(answers), "davidson", method="map").converged


def test_ties_and_nothing_else_say_so() -> None:
    only = from_answers([Answer("a", "b", 4, tie=True), Answer("b", "c", 4, tie=True)])
    for method in METHODS:
        fitted = fit_model(only, "rao-kupper", method=method)
        assert known(fitted.separation).sentences == ("Every answer is a tie: nothing distinguishes the items.",)


def test_a_place_that_always_wins_says_so() -> None:
    answers = [Answer("a", "b", first="a"), Answer("b", "a", first="b"), Answer("b", "c", first="b")]
    answers += [Answer("c", "b", first="c")]
    for method in METHODS:
        fitted = fit_model(from_answers(answers), order_effect=True, method=method)
        assert known(fitted.separation).sentences == ("The item shown first won every comparison that was decided.",)


def test_an_order_that_follows_the_items_says_so() -> None:
    answers = [Answer("a", "b", first="a"), Answer("b", "a", first="a"), Answer("b", "c", first="b")]
    answers += [Answer("c", "b", first="b")]
    fitted = fit_model(from_answers(answers), order_effect=True)
    assert "cannot be distinguished" in known(fitted.separation).sentences[0]


def test_two_groups_of_which_one_always_won_are_separated_in_whatever_order_they_were_shown() -> None:
    pairs = ["ab", "ba", "cd", "dc", "ac", "ad", "bc", "bd"]
    answers = [Answer(pair[0], pair[1], first=first) for pair in pairs for first in pair]
    fitted = fit_model(from_answers(answers), order_effect=True)
    assert fitted.separation is not None


# What to do where there are no finite scores: each remedy is followed, and works.
def table(*lines: str) -> Comparisons:
    """Answers such as "a>b" with the first item shown first, "b<a" with the second, and "a=b" for a tie."""
    answers = []
    for line in lines:
        sign = next(sign for sign in "><=" if sign in line)
        first, second = line.split(sign)
        pair = (second, first) if sign == "<" else (first, second)
        answers.append(Answer(*pair, first=first, tie=sign == "="))
    return from_answers(answers)


BOTH = ("a>b", "a<b", "b>a", "b<a")
CASES = {
    "never compared": table(*BOTH, "c>d", "c<d", "d>c", "d<c"),
    "never compared, with ties": table(*BOTH, "c>d", "c<d", "c=d", "d>c", "d<c"),
    "always won": table("a>b", "b<a", "b>c", "c<b"),
    "always won, with ties": table("a>b", "b<a", "b>c", "c<b", "a=b", "b=c"),
    "the first won": table("a>b", "b>a"),
    "the first won, with ties": table("a>b", "b>a", "a=b"),
    "one order": table("a>b", "a<b", "b>c", "b<c"),
    "ties only": table("a=b", "b=c"),
    "no two linked": table("a>b", "c=d"),
}
BY_DAY = ("never compared", "always won, with ties", "one order", "ties only")


@pytest.mark.parametrize(
    "name", [name if name in BY_DAY else pytest.param(name, marks=pytest.mark.nightly) for name in CASES]
)
def test_each_remedy_gives_finite_scores(name: str) -> None:
    comparisons = CASES[name]
    for model, method, order_effect in product(MODELS, get_args(ModelMethod), (False, True)):
        try:
            scores = score(comparisons, model, method=method, order_effect=order_effect)
        except ResultsError:
            continue
        if not scores.fit.separation:
            continue
        ways, told = remedies(scores), problem_lines(scores)[-1]
        assert ways or not comparisons.count.any()
        for words, wish in ways.items():
            assert words in told
            followed = score(comparisons, **wish)
            assert not problem_lines(followed)
            assert np.isfinite(followed.fit.theta).all()
            # The words say what the arguments say.
            assert f"--method {wish['method']}" in words or wish["method"] == method
            assert f"--model {wish['model']}" in words or wish["model"] == model
            assert ("without --order-effect" in words) == (order_effect and not wish["order_effect"])


def test_strengths_put_items_in_order_and_shares_of_wins_where_there_are_none() -> None:
    """The second won more of its answers than the third, but against the last."""
    answers = [Answer("a", "b", 3.0), Answer("b", "a", 1.0), Answer("a", "c", 5.0), Answer("c", "a", 4.0)]
    answers += [Answer("c", "b", 2.0), Answer("b", "d", 9.0), Answer("d", "b", 1.0)]
    fitted = score(from_answers(answers))
    assert [fitted.comparisons.items[item] for item in fitted.order] == ["a", "c", "b", "d"]
    unlinked = score(from_answers(answers[4:]))
    assert unlinked.fit.separation is not None
    assert [unlinked.comparisons.items[item] for item in unlinked.order] == ["c", "b", "d"]


def test_items_never_compared_are_not_sent_to_firth() -> None:
    lines = problem_lines(score(CASES["never compared"]))
    assert "--method firth" not in lines[-1]
    assert "--method map" in lines[-1]
    assert "Compare items of different groups" in lines[-1]
    assert "firth" in problem_lines(score(CASES["always won"]))[-1]


def test_a_fit_with_a_prior_has_no_degrees_below_zero() -> None:
    for comparisons in CASES.values():
        scores = score(comparisons, method="map")
        assert scores.fit.df >= 0
        assert scores.to_json()["df"] >= 0
        if scores.fit.separation:
            continue
        summary = next(block.text for block in score_blocks(scores) if isinstance(block, Paragraph))
        assert "-" not in summary.split("deviance")[1].split(";")[0]


def test_one_unbeaten_item_of_many_is_named_alone() -> None:
    names = [f"i{item}" for item in range(40)]
    answers = [Answer("i0", other) for other in names[1:4]]
    answers += [Answer(a, b) for a, b in zip(names[1:], [*names[2:], names[1]], strict=True)]
    scores = score(from_answers(answers, names))
    assert [names[item] for item in scores.fit.separated_items] == ["i0"]
    assert known(scores.fit.separation).sentences == (
        "The likelihood rises without end as items draw apart: 'i0', then the other 39 items, best first.",
        "'i0': never lost to any of the other items (3 wins).",
    )
    assert scores.to_json()["separated"] == ["i0"]


def test_two_items_never_compared_with_many_are_named_alone() -> None:
    names = [f"i{item}" for item in range(40)]
    answers = [Answer("x", "y"), Answer("y", "x")]
    answers += [Answer(a, b) for a, b in zip(names, [*names[1:], names[0]], strict=True)]
    separation = known(score(from_answers(answers)).fit.separation)
    assert separation.sentences == ("'x', 'y': never compared with the other items.",)
