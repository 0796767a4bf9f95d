"""Cross-validation over observers, beside fitting and predicting one by one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.inference import compare_models
from analysis.scaling import LAWS, Model, fit_model
from tests.analysis.conftest import answers_of

Maker = Callable[..., Comparisons]
THETA = np.array([0.9, 0.3, -0.2, -1.0])


def slowly(comparisons: Comparisons, model: Model, order_effect: bool) -> dict[str, float]:
    """Return the log probability of each observer's answers by a fit without them, answer by answer."""
    law, lines = LAWS[model], answers_of(comparisons)
    totals = {}
    for person in comparisons.observers:
        rest = [line for line in lines if line.observer != person]
        fit = fit_model(from_answers(rest, comparisons.items), model, order_effect=order_effect)
        values = {parameter.name: parameter.estimate for parameter in fit.parameters}
        share = (sum(line.tie for line in rest) + 0.5) / (len(rest) + 1)
        total = 0.0
        for line in (line for line in lines if line.observer == person):
            i, j = (comparisons.items.index(name) for name in (line.winner, line.loser))
            side = values.get("order", 0.0) * (1 if line.first == line.winner else -1)
            d = np.array([fit.theta[i] - fit.theta[j] + side])
            won, _, tied = (float(p[0]) for p in law.probabilities(d, values.get(law.parameter or "", 0.0)))
            if law.parameter or not comparisons.ties:
                total += np.log(tied if line.tie else won)
            else:
                total += np.log(share if line.tie else (1 - share) * won)
        totals[person] = total
    return totals


@pytest.mark.parametrize("ties", [False, True])
def test_beside_one_by_one(make: Maker, ties: bool) -> None:
    comparisons = make(THETA, 6, model="davidson" if ties else "bradley-terry", k=-0.5, repeats=3)
    result = compare_models(comparisons)
    assert len(result.models) == (8 if ties else 4)
    assert (result.folds, result.penalised_folds, result.left_out) == (6, 0, ())
    slow = {(m.model, m.order_effect): slowly(comparisons, m.model, m.order_effect) for m in result.models}
    best = slow[result.models[0].model, result.models[0].order_effect]
    for column, line in enumerate(result.models):
        own = slow[line.model, line.order_effect]
        assert result.by_observer[:, column] == pytest.approx([own[o] for o in comparisons.observers], abs=1e-8)
        assert line.log_likelihood == pytest.approx(sum(own.values()), abs=1e-8)
        behind = [own[person] - best[person] for person in own]
        assert line.difference == pytest.approx(np.mean(behind), abs=1e-9)
        assert line.difference_se == pytest.approx(np.std(behind, ddof=1) / np.sqrt(6), abs=1e-9)
    assert [m.log_likelihood for m in result.models] == sorted((m.log_likelihood for m in result.models), reverse=True)


def test_an_order_effect_is_seen(make: Maker) -> None:
    plain = make(np.zeros(4), 20, repeats=2)
    lines = [
        Answer(a.winner, a.loser, 1, a.observer, a.winner if number % 5 else a.loser)
        for number, a in enumerate(answers_of(plain))
    ]
    result = compare_models(from_answers(lines, plain.items), ["bradley-terry"])
    assert result.models[0].order_effect
    assert result.models[1].difference + 2 * result.models[1].difference_se < 0
    assert "clearly worse: bradley-terry." in result.sentence
    assert result.models[0].per_answer > result.chance > result.models[1].per_answer


def test_separated_folds_are_fitted_under_a_prior() -> None:
    """Without observer 3 nobody prefers c."""
    lines = [Answer(w, x, 1, o) for o in "12345" for w, x in ("ab", "ba", "ac", "bc", "ac")]
    lines += [Answer("c", "a", 1, "3"), Answer("c", "b", 1, "3")]
    result = compare_models(from_answers(lines))
    assert result.penalised_folds == 1
    assert np.isfinite(result.by_observer).all()
    everywhere = compare_models(from_answers([line for line in lines if line.winner != "c"]))
    assert everywhere.penalised_folds == 5
    assert len(everywhere.models) == 2


def test_a_model_that_cannot_be_fitted_is_named() -> None:
    """Each pair was shown in one order only."""
    votes = {"1": "abbcac", "2": "bacbca", "3": "abcbac", "4": "babcca"}
    lines = [Answer(v[i], v[i + 1], 1, o, min(v[i], v[i + 1])) for o, v in votes.items() for i in (0, 2)]
    result = compare_models(from_answers(lines))
    assert {name for name, _ in result.left_out} == {"bradley-terry with order effect", "thurstone with order effect"}
    assert "only shown in one order" in result.left_out[0][1]


def test_folds_do_not_depend_on_the_order_of_lines(make: Maker) -> None:
    comparisons = make(THETA, 7, repeats=2)
    lines = answers_of(comparisons)
    forward = compare_models(comparisons, folds=3)
    backward = compare_models(from_answers(lines[::-1], comparisons.items[::-1]), folds=3)
    assert forward.folds == backward.folds == 3
    assert forward.models[0].log_likelihood == pytest.approx(backward.models[0].log_likelihood, abs=1e-8)


def test_refusals(make: Maker) -> None:
    comparisons = make(THETA, 4)
    for wrong, words in (({"folds": 5}, "5 folds"), ({"models": ["logit"]}, "no model 'logit'")):
        with pytest.raises(ResultsError, match=words):
            compare_models(comparisons, **wrong)
    with pytest.raises(ResultsError, match="there are 2"):
        compare_models(make(THETA, 2))
    with pytest.raises(ResultsError, match="No answer is a tie"):
        compare_models(comparisons, ["davidson"])
