"""The sandwich covariance against its definition, and where it must agree with the model's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.comparisons.comparisons import Comparisons
from analysis.scaling.fitting import fit_model
from analysis.scaling.laws import Davidson, Logistic, Model, Probit

Drawer = Callable[..., Comparisons]
THETA = np.array([0.7, 0.0, -0.3, -0.4])


@pytest.mark.parametrize(
    ("law", "model"), [(Logistic(), "bradley-terry"), (Davidson(), "davidson"), (Probit(), "thurstone")]
)
def test_it_is_a_sum_over_observers(draw: Drawer, law: Logistic | Davidson | Probit, model: Model) -> None:
    """Each observer's gradient by finite differences of their own likelihood, answer by answer."""
    comparisons = draw(law, THETA, k=-0.3, order=0.2, observers=5)
    fitted = fit_model(comparisons, model, order_effect=True)
    robust = fit_model(comparisons, model, order_effect=True, covariance="sandwich")
    at = np.r_[fitted.theta, [parameter.estimate for parameter in fitted.parameters]]

    def own(values: np.ndarray, observer: int) -> float:
        theta, k, order = values[:4], values[4] if model == "davidson" else 0.0, values[-1]
        total = 0.0
        tied = comparisons.tied
        sources = [(comparisons.winner, comparisons.loser, comparisons.observer, comparisons.winner_was_first, 0)]
        sources += [(tied.item_a, tied.item_b, tied.observer, tied.a_was_first, 2)] if model == "davidson" else []
        for ones, others, people, firsts, outcome in sources:
            for one, other, person, first in zip(ones, others, people, firsts, strict=True):
                if person == observer:
                    d = np.array([theta[one] - theta[other] + (order if first else -order)])
                    total += float(np.log(law.probabilities(d, k)[outcome][0]))
        return total

    meat = np.zeros((len(at), len(at)))
    for observer in range(5):
        steps = np.eye(len(at)) * 1e-6
        gradient = np.array([(own(at + step, observer) - own(at - step, observer)) / 2e-6 for step in steps])
        meat += np.outer(gradient, gradient)
    expected = fitted.joint_covariance @ meat @ fitted.joint_covariance * 5 / 4
    assert robust.joint_covariance == pytest.approx(expected, rel=1e-5, abs=1e-8)
    assert robust.theta == pytest.approx(fitted.theta, abs=1e-13)


def test_weights_all_multiplied_change_nothing(draw: Drawer) -> None:
    comparisons = draw(Logistic(), THETA, observers=8)
    heavier = replace(comparisons, count=comparisons.count * 7)
    once, more = (fit_model(source, covariance="sandwich") for source in (comparisons, heavier))
    assert more.se == pytest.approx(once.se, rel=1e-9)
    assert fit_model(heavier).se == pytest.approx(fit_model(comparisons).se / np.sqrt(7), rel=1e-9)


def test_with_many_like_observers_it_nears_the_models(draw: Drawer) -> None:
    comparisons = draw(Logistic(), THETA, observers=400)
    plain, robust = fit_model(comparisons), fit_model(comparisons, covariance="sandwich")
    assert robust.se == pytest.approx(plain.se, rel=0.12)


def test_observers_who_repeat_themselves_widen_it(draw: Drawer) -> None:
    """Answers given four times over are no new evidence: the model halves its errors, the sandwich keeps them."""
    comparisons = draw(Logistic(), THETA, observers=40)
    copied = replace(comparisons, count=comparisons.count * 4)
    ratio = fit_model(copied, covariance="sandwich").se / fit_model(copied).se
    assert (ratio > 1.6).all()
