"""The multiverse of analyses, beside making each one from the start."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.inference import multiverse
from analysis.inference.multiverse_analysis import NOBODY
from analysis.scaling import fit_model, score
from analysis.scaling.scores import classes_of
from tests.analysis.conftest import answers_of
from tests.choice import nightly
from tests.kept import known

Maker = Callable[..., Comparisons]


def without(comparisons: Comparisons, person: str) -> Comparisons:
    return from_answers([one for one in answers_of(comparisons) if one.observer != person], comparisons.items)


@pytest.mark.parametrize("ties", [False, *nightly(True)])
def test_beside_one_by_one(make: Maker, ties: bool) -> None:
    theta = np.array([1.2, 0.4, 0.0, -1.3])
    comparisons = make(theta, 5, model="davidson" if ties else "bradley-terry", k=-0.5, sd=0.4, repeats=4)
    scores = score(comparisons)
    result = multiverse(scores, adjustments=["none", "holm", "bh"])
    assert not result.skipped
    assert len(result.analyses) == (4 if ties else 2) * 4 * 3 * 6
    assert (result.fits, result.fits + result.fits_spared) == ((4 if ties else 2) * 6, len(result.analyses))
    assert scores.classes is not None
    names = [comparisons.items[item] for item in scores.order]
    agree: Counter[tuple[str, str]] = Counter()
    for analysis in result.analyses:
        rest = comparisons
        if analysis.left_out != NOBODY:
            rest = without(comparisons, analysis.left_out.removeprefix("observer "))
        fit = fit_model(rest, analysis.model, covariance=analysis.covariance)
        slow = known(classes_of(fit, adjust=analysis.adjust))
        assert analysis.labels == tuple(slow.labels[item] for item in scores.order)
        assert analysis.number == len(slow.members)
        for pair in result.pairs:
            i, j = (comparisons.items.index(name) for name in (pair.first, pair.second))
            differs = slow.p[i, j] <= 0.05
            agree[pair.first, pair.second] += differs == pair.differs and (not differs or fit.theta[i] > fit.theta[j])
    for pair in result.pairs:
        i, j = (comparisons.items.index(name) for name in (pair.first, pair.second))
        assert scores.fit.theta[i] > scores.fit.theta[j]
        assert pair.differs == (scores.classes.p[i, j] <= 0.05)
        assert pair.stands == pytest.approx(agree[pair.first, pair.second] / len(result.analyses))
    for place, item in enumerate(result.by_item):
        same = [analysis.labels[place] == item.label for analysis in result.analyses]
        assert item.name == names[place]
        assert item.stands == pytest.approx(np.mean(same))
    assert sum(result.numbers.values()) == len(result.analyses)
    assert 0 < min(pair.stands for pair in result.pairs) < 1
    shares = [choice.stands for choice in result.choices if choice.choice == "left_out"]
    assert shares == sorted(shares)
    assert len(shares) == 6


def test_the_chosen_analysis_is_one_of_them(make: Maker) -> None:
    comparisons = make(np.array([0.9, 0.2, -0.3, -0.9]), 9, repeats=3)
    for covariance in ("model", "sandwich"):
        scores = score(comparisons, "thurstone", covariance=covariance, adjust="bh")
        result = multiverse(scores, models=["thurstone"], adjustments=["bh"])
        own = next(a for a in result.analyses if a.left_out == NOBODY and a.covariance == covariance)
        assert own.adjust == "bh"
        assert len(own.labels) == 4
        assert result.to_json()["number_of_classes"]["chosen"] == result.number


def test_separated_rows_are_skipped_and_named() -> None:
    """Only observer 2 ever prefers c."""
    lines = [Answer(w, x, 2, o) for o in "123456" for w, x in ("ab", "ba", "ac", "bc")]
    lines += [Answer("c", "a", 1, "2"), Answer("c", "b", 1, "2")]
    result = multiverse(score(from_answers(lines)))
    assert {name for name, _ in result.skipped} == {
        "bradley-terry, observer 2 left out",
        "thurstone, observer 2 left out",
    }
    assert "'c'" in result.skipped[0][1]
    assert len(result.analyses) == 2 * 4 * 4 * 6


def test_without_observers_there_is_one_fit_for_each_law() -> None:
    votes = {"ab": 30, "ba": 10, "bc": 30, "cb": 11, "ac": 35, "ca": 8}
    result = multiverse(score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()])))
    assert (result.fits, len(result.analyses), result.number_stands) == (2, 8, 1.0)
    assert all(pair.stands == 1 for pair in result.pairs)


def test_many_observers_are_left_out_in_parts(make: Maker) -> None:
    result = multiverse(score(make(np.array([0.5, 0.0, -0.5]), 101)), models=["bradley-terry"], adjustments=["none"])
    assert result.fits == 21
    assert {a.left_out for a in result.analyses} >= {NOBODY, "part 20 of 20 of the observers"}


def test_refusals(make: Maker) -> None:
    scores = score(make(np.zeros(3)))
    with pytest.raises(ResultsError, match="there is no 'logit'"):
        multiverse(scores, models=["logit"])  # type: ignore[list-item]  # wrong on purpose
    with pytest.raises(ResultsError, match="there is no 'hom'"):
        multiverse(scores, adjustments=["hom"])  # type: ignore[list-item]  # wrong on purpose
    with pytest.raises(ResultsError, match="separated"):
        multiverse(score(from_answers([Answer("a", "b", 3)])))
    with pytest.raises(ResultsError, match="No answer is a tie"):
        multiverse(scores, models=["davidson"])


def test_conclusions_of_a_minority_are_named_and_those_of_all_are_not(make: Maker) -> None:
    comparisons = make(np.array([0.45, 0.1, -0.1, -0.45]), 8, sd=0.7, repeats=3)
    lone = multiverse(score(comparisons, covariance="model", adjust="none"), adjustments=["holm"])
    few = [pair for pair in lone.pairs if pair.stands < 0.5]
    assert few
    assert all(pair.differs for pair in few)
    assert f"{len(few)} of 6 verdicts on pairs" in lone.warning
    assert lone.warning in lone.sentence
    assert lone.to_json()["warning"] == lone.warning
    clear = multiverse(score(make(np.array([1.5, 0.0, -1.5]), 12, repeats=9)), adjustments=["holm"])
    assert clear.warning == ""
    assert clear.sentence.endswith(".")
