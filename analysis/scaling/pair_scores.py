"""Scores and perceptual classes under any model of paired comparison, item by item, best first."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.classes.classes import Classes, best_first, check_level, classes_if_few
from analysis.classes.multiplicity import Adjust
from analysis.comparisons.comparisons import Comparisons
from analysis.scaling.pair_fit import DEFAULT_PRIOR_SD, CovarianceKind, Model, ModelFit, ModelMethod, fit_model
from analysis.scaling.scores import ItemScore
from analysis.scaling.separation import separated_items
from analysis.scaling.units import NATS_PER_JND, STANDARD_DEVIATIONS_PER_JOD


@dataclass(frozen=True, slots=True, eq=False)
class ModelScores:
    """The items' lines, best first, with the fit and the classes that they come from.

    ``order`` indexes the comparisons' items as the lines stand. ``classes`` is None where there is no maximum. Of a
    Thurstone fit the lines have neither score nor log10 score.
    """

    items: tuple[ItemScore, ...]
    order: tuple[int, ...]
    comparisons: Comparisons
    fit: ModelFit
    classes: Classes | None

    @property
    def unit(self) -> float:
        """Length of one JND (75 : 25) in the units of the strengths; one JOD in Thurstone's law."""
        return STANDARD_DEVIATIONS_PER_JOD if self.fit.model == "thurstone" else NATS_PER_JND

    def to_json(self) -> dict[str, Any]:
        """Return what `cyclopean scores --json` prints: no NaN, null where there is no finite value."""
        separation = self.fit.separation
        outside = separated_items(separation.groups) if separation else ()
        return {
            "items": [item.to_json() | self._in_jnd(item) for item in self.items],
            **self.fit.to_json(),
            "separated": [self.comparisons.items[item] for item in outside],
            "why": list(separation.sentences) if separation else [],
        }

    def _in_jnd(self, item: ItemScore) -> dict[str, float | None]:
        strength = None if item.theta is None else item.theta / self.unit
        error = None if item.se is None else item.se / self.unit
        told = {"jnd": strength, "jnd_se": error}
        return told | {"jod": strength, "jod_se": error} if self.fit.model == "thurstone" else told


def score_model(
    comparisons: Comparisons,
    model: Model = "bradley-terry",
    *,
    alpha: float = 0.05,
    adjust: Adjust = "holm",
    method: ModelMethod = "ml",
    prior_sd: float = DEFAULT_PRIOR_SD,
    order_effect: bool = False,
    covariance: CovarianceKind = "model",
) -> ModelScores:
    """Fit ``model`` to ``comparisons`` as `analysis.scaling.pair_fit.fit_model` does, and group the items into classes.

    Items stand by strength, best first; where there is no maximum, by the share of comparisons that they won, a tie
    being half a win. ``comparisons`` of an item counts its ties too where the model has a place for them.

    Raises
    ------
    ResultsError
        If ``alpha`` is out of range, or as `fit_model`.
    """
    check_level(alpha)
    fitted = fit_model(
        comparisons, model, method=method, prior_sd=prior_sd, order_effect=order_effect, covariance=covariance
    )
    sound = fitted.separation is None and bool(np.isfinite(fitted.theta).all())
    classes = classes_if_few(fitted.theta, fitted.covariance, alpha=alpha, adjust=adjust) if sound else None
    ties = comparisons.tie_counts.sum(axis=1) if model in ("davidson", "rao-kupper") else 0.0
    won = comparisons.wins.sum(axis=1)
    compared = comparisons.totals.sum(axis=1) + ties
    merit = fitted.theta if sound else (won + ties / 2) / np.maximum(compared, np.finfo(np.float64).tiny)
    order = best_first(merit)
    log_score = np.full(len(won), np.nan)
    if model != "thurstone":
        with np.errstate(invalid="ignore"):  # of items that are separated, inf - inf
            log_score = fitted.theta - np.logaddexp.reduce(fitted.theta)
    items = tuple(
        ItemScore(
            name=comparisons.items[index],
            wins=float(won[index]),
            comparisons=float(compared[index]),
            theta=_finite(fitted.theta[index]),
            se=_finite(fitted.se[index]),
            score=_finite(float(np.exp(log_score[index]))),
            log10_score=_finite(log_score[index] / np.log(10)),
            label=classes.labels[index] if classes else None,
        )
        for index in order
    )
    return ModelScores(items, order, comparisons, fitted, classes)


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
