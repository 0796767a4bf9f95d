"""What to do where there are no finite scores: each remedy is followed, and works."""

from __future__ import annotations

from itertools import product
from typing import get_args

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.scaling import MODELS, ModelMethod, problem_lines, score, score_blocks
from analysis.scaling.shown import remedies
from documents.pages import Paragraph


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


@pytest.mark.parametrize("comparisons", CASES.values(), ids=CASES)
def test_each_remedy_gives_finite_scores(comparisons: Comparisons) -> None:
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
    assert scores.fit.separation is not None
    assert scores.fit.separation.sentences == (
        "The answers are fitted ever better as the items draw apart: 'i0', then the other 39 items, best first.",
        "'i0': never lost to any of the other items (3 wins).",
    )
    assert scores.to_json()["separated"] == ["i0"]


def test_two_items_never_compared_with_many_are_named_alone() -> None:
    names = [f"i{item}" for item in range(40)]
    answers = [Answer("x", "y"), Answer("y", "x")]
    answers += [Answer(a, b) for a, b in zip(names, [*names[1:], names[0]], strict=True)]
    separation = score(from_answers(answers)).fit.separation
    assert separation is not None
    assert separation.sentences == ("'x', 'y': never compared with the other items.",)
