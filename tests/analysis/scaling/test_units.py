"""Units: constants against their definitions, and two items at 75 : 25 exactly one unit apart."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import norm

from analysis.comparisons import Answer, from_answers
from analysis.scaling import MODELS, Model, score
from analysis.scaling import laws as units


def test_constants_are_what_they_say() -> None:
    assert norm.cdf(units.STANDARD_DEVIATIONS_PER_JOD) == pytest.approx(0.75, abs=1e-15)
    assert expit(units.NATS_PER_JND) == pytest.approx(0.75, abs=1e-15)
    assert pytest.approx(1.4826, abs=5e-5) == units.JOD_PER_STANDARD_DEVIATION


def test_the_angular_law_of_iso_20462() -> None:
    share = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    assert units.iso_20462_jnd(share) == pytest.approx([-3, -1, 0, 1, 3], abs=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_three_of_four_answers_are_one_unit(model: Model) -> None:
    answers = [Answer("good", "bad", 75), Answer("bad", "good", 25)]
    if model in ("davidson", "rao-kupper"):
        answers.append(Answer("good", "bad", 1e-9, tie=True))
    told = score(from_answers(answers), model).to_json()["items"]
    assert told[0]["name"] == "good"
    assert told[0]["jnd"] - told[1]["jnd"] == pytest.approx(1, abs=1e-8)
    if model == "thurstone":
        assert told[0]["jod"] - told[1]["jod"] == pytest.approx(1, abs=1e-12)
        assert told[0]["score"] is None
    else:
        assert told[0]["score"] == pytest.approx(0.75)


def test_thurstone_and_bradley_terry_scales_are_nearly_alike_in_jnd() -> None:
    """On answers that follow one law the other's scale, in JND, is off by a few percent within two JND."""
    jod = np.array([1.0, 0.4, 0.0, -0.6, -0.8])
    answers = []
    for one, other in [(i, j) for i in range(5) for j in range(5) if i != j]:
        share = norm.cdf((jod[one] - jod[other]) * units.STANDARD_DEVIATIONS_PER_JOD)
        answers.append(Answer(f"{one}", f"{other}", 100 * share))
    comparisons = from_answers(answers, "01234")
    for model, tolerance in (("thurstone", 1e-10), ("bradley-terry", 0.06)):
        scores = score(comparisons, model)  # type: ignore[arg-type]  # a name out of a tuple
        assert scores.fit.theta / scores.jnd == pytest.approx(jod - jod.mean(), abs=tolerance)
