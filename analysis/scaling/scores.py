"""Scores, standard errors and perceptual classes of a set of comparisons, item by item, best first."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.classes.classes import Classes, best_first, check_level, classes_if_few
from analysis.classes.multiplicity import Adjust
from analysis.comparisons.comparisons import Comparisons
from analysis.scaling.bradley_terry import BradleyTerryFit, Method, fit

if TYPE_CHECKING:
    from analysis.scaling.goodness import Goodness


@dataclass(frozen=True, slots=True)
class ItemScore:
    """One item's line: counts, strength in nats, score as a share of 1, perceptual class; None where there is none."""

    name: str
    wins: float
    comparisons: float
    theta: float | None
    se: float | None
    score: float | None
    log10_score: float | None
    label: str | None

    def to_json(self) -> dict[str, Any]:
        """Return the line with the keys that `cyclopean scores --json` prints."""
        return {
            "name": self.name,
            "wins": self.wins,
            "comparisons": self.comparisons,
            "theta": self.theta,
            "se": self.se,
            "score": self.score,
            "log10_score": self.log10_score,
            "class": self.label,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Scores:
    """The items' lines, best first, with the fit and the classes that they come from.

    ``order`` indexes the comparisons' items as the lines stand. ``classes`` is None if the items are separated or
    overlap in too many classes.
    """

    items: tuple[ItemScore, ...]
    order: tuple[int, ...]
    comparisons: Comparisons
    fit: BradleyTerryFit
    classes: Classes | None

    def goodness(self) -> Goodness | None:
        """Return how well the model fits, with a caveat where counts are small; None if the items are separated."""
        from analysis.scaling.cells import count_cells
        from analysis.scaling.goodness import goodness_of_fit
        from analysis.scaling.logistic import Logistic

        if not np.isfinite(self.fit.theta).all():
            return None
        cells, _ = count_cells(self.comparisons, ordered=False, ties=False)
        chances = Logistic().probabilities(cells.differences(self.fit.theta, 0.0), 0.0)
        return goodness_of_fit(cells, chances, cells.n - 1, ties=False)

    def to_json(self) -> dict[str, Any]:
        """Return what `cyclopean scores --json` prints: no NaN, null where there is no finite value."""
        goodness = self.goodness()
        return {
            "items": [item.to_json() for item in self.items],
            "log_likelihood": _finite(self.fit.log_likelihood),
            "deviance": _finite(self.fit.deviance),
            "df": self.fit.df,
            "goodness_of_fit": goodness.to_json() if goodness else None,
            "converged": self.fit.converged,
            "separated": [self.comparisons.items[item] for item in self.fit.separated_items],
        }


def score(comparisons: Comparisons, *, alpha: float = 0.05, adjust: Adjust = "holm", method: Method = "ml") -> Scores:
    """Fit strengths to ``comparisons`` and group the items into classes.

    Items stand by score, best first; where the items are separated, by the share of comparisons they won.

    Raises
    ------
    ResultsError
        If ``alpha`` is out of range.
    """
    check_level(alpha)
    fitted = fit(comparisons.wins, method=method)
    sound = bool(np.isfinite(fitted.theta).all())
    classes = classes_if_few(fitted.theta, fitted.covariance, alpha=alpha, adjust=adjust) if sound else None
    won = comparisons.wins.sum(axis=1)
    compared = comparisons.totals.sum(axis=1)
    merit = fitted.theta if sound else won / np.maximum(compared, np.finfo(np.float64).tiny)
    order = best_first(merit)
    items = tuple(
        ItemScore(
            name=comparisons.items[index],
            wins=float(won[index]),
            comparisons=float(compared[index]),
            theta=_finite(fitted.theta[index]),
            se=_finite(fitted.se[index]),
            score=_finite(fitted.score[index]),
            log10_score=_finite(fitted.log10_score[index]),
            label=classes.labels[index] if classes else None,
        )
        for index in order
    )
    return Scores(items, order, comparisons, fitted, classes)


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
