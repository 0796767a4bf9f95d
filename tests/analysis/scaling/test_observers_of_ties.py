"""Who prefers neither throughout has no answer to a model without ties, and counts for no covariance there."""

from __future__ import annotations

import pytest

from analysis.choices import CovarianceChoice
from analysis.comparisons import Answer, from_answers
from analysis.report import estimate_scores
from analysis.scaling import fit_model

ANSWERS = [Answer("a", "b", 3, "01"), Answer("b", "a", 1, "01"), Answer("a", "b", 4, "02", tie=True)]


def test_one_observer_with_preferences_has_the_model_s_covariance() -> None:
    assert fit_model(from_answers(ANSWERS)).covariance_kind == "model"
    assert fit_model(from_answers(ANSWERS), "davidson").covariance_kind != "model"


@pytest.mark.parametrize("choice", ["auto", "sandwich", "shrinkage", "scaled", "model"])
@pytest.mark.parametrize("answers", [ANSWERS, [ANSWERS[0], ANSWERS[2]]])
def test_a_report_on_them_has_scores(choice: CovarianceChoice, answers: list[Answer]) -> None:
    estimate = estimate_scores(from_answers(answers), alpha=0.05, adjust="holm", covariance=choice)
    assert estimate.covariance == "model"
