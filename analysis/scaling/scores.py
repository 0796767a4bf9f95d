"""Scores, standard errors and perceptual classes of a set of comparisons, item by item, best first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypedDict, Unpack

import numpy as np

from analysis.choices import Adjust, CovarianceChoice
from analysis.classes.classes import Classes, best_first, check_level, classes_if_few, classify
from analysis.classes.multiplicity import check_adjustment
from analysis.comparisons.comparisons import Comparisons
from analysis.scaling.fitting import DEFAULT_PRIOR_SD, fit_model
from analysis.scaling.lack_of_fit import lack_of_fit
from analysis.scaling.laws import LAWS, Model
from analysis.scaling.profile import profiles_of, why_by_standard_errors
from analysis.scaling.result import Fit, ModelMethod
from analysis.scaling.separation import are_apart
from documents.arrays import Floats
from documents.text import JsonResult, finite

if TYPE_CHECKING:
    from analysis.scaling.quasi import QuasiVariances


class FittingOptions(TypedDict, total=False):
    """How `score` fits: the options of `analysis.scaling.fitting.fit_model`, whose defaults stand there."""

    method: ModelMethod | Literal["auto"]
    prior_sd: float
    order_effect: bool
    covariance: CovarianceChoice


MOST_ITEMS_PENALISED = 1000  # unless asked for: the penalty needs dense equations


@dataclass(frozen=True, slots=True)
class ItemScore(JsonResult):
    """One item's line: counts, strength in nats, score as a share of 1, perceptual class; None where there is none.

    ``theta`` and ``se`` are in standard deviations of a difference where the model is ``thurstone``, which has no
    scores; ``quasi_se`` is the root of the item's quasi-variance, None unless it was asked for.
    """

    name: str
    wins: float
    comparisons: float
    theta: float | None
    se: float | None
    score: float | None
    log10_score: float | None
    label: str | None
    quasi_se: float | None = None
    json_keys: ClassVar = {"label": "class", "quasi_se": None}


@dataclass(frozen=True, eq=False)
class Scores:
    """The items' lines, best first, with the fit and the classes that they come from.

    Attributes
    ----------
    order
        Indices of the comparisons' items in the order of the lines.
    comparisons, fit
        What was fitted, and how.
    find_classes
        What returns the classes; it is called when they, or the lines, are read first.
    quasi
        Quasi-variances in the order of the comparisons' items; None unless they were asked for.
    items
        One line for each item.
    classes
        None if there is no maximum, or the items overlap in too many classes to list.
    """

    order: tuple[int, ...]
    comparisons: Comparisons
    fit: Fit
    find_classes: Callable[[], Classes | None]
    quasi: QuasiVariances | None = None

    @cached_property
    def classes(self) -> Classes | None:
        """The perceptual classes, found when they are read first."""
        return self.find_classes()

    @cached_property
    def items(self) -> tuple[ItemScore, ...]:
        """One line for each item, best first."""
        return _lines(self)

    @property
    def jnd(self) -> float:
        """Length of one JND (75 : 25) in the units of the strengths; one JOD in Thurstone's law."""
        return LAWS[self.fit.model].jnd

    def item_rows(self) -> list[dict[str, Any]]:
        """Return the items' lines as plain values; how well the fit fits, which takes longer, is not computed."""
        return [item.to_json() | self._in_jnd(item) for item in self.items]

    def to_json(self) -> dict[str, Any]:
        """Return what `cyclopean scores --json` prints: no NaN, null where there is no finite value."""
        separation, names = self.fit.separation, self.comparisons.items
        values = {
            "items": self.item_rows(),
            **self.fit.to_json(),
            "tests": "standard errors" if why_by_standard_errors(self.fit) else "likelihood ratios",
            "separated": [names[item] for item in self.fit.separated_items],
            "why": list(separation.sentences) if separation else [],
        }
        if values["goodness_of_fit"]:
            tested = lack_of_fit(self.comparisons, self.fit)
            values["goodness_of_fit"]["by_observers"] = tested.to_json() if tested else None
        if self.quasi is not None:
            quasi = self.quasi.to_json()
            by_item = dict(zip(names, quasi.pop("variances"), strict=True))
            values["quasi_variances"] = {"by_item": by_item, **quasi}
        return values

    def _in_jnd(self, item: ItemScore) -> dict[str, float | None]:
        strength = None if item.theta is None else item.theta / self.jnd
        error = None if item.se is None else item.se / self.jnd
        values = {"jnd": strength, "jnd_se": error}
        return values | {"jod": strength, "jod_se": error} if LAWS[self.fit.model].unit != "nats" else values


def score(
    comparisons: Comparisons,
    model: Model = "bradley-terry",
    *,
    alpha: float = 0.05,
    adjust: Adjust = "holm",
    quasi_variances: bool = False,
    **fitting: Unpack[FittingOptions],
) -> Scores:
    """Fit ``model`` to ``comparisons`` as `analysis.scaling.fitting.fit_model` does, and group the items into classes.

    Items are ordered by strength, best first; where there is no maximum, by the share of comparisons that they won, a
    tie being half a win. ``comparisons`` of an item counts its ties too where the model has a place for them.

    Parameters
    ----------
    alpha, adjust
        Significance level of a difference, and correction for multiple comparisons, as
        `analysis.classes.classes.classify` has them.
    quasi_variances
        Compute quasi-variances too, where there is a finite maximum.
    **fitting
        ``method``, ``prior_sd``, ``order_effect`` and ``covariance`` as `fit_model` has them; the method ``auto`` is
        ``ml``, or ``firth`` where only that gives scores: where some items, of 1000 at most, always won, and
        comparisons link all of them.

    Returns
    -------
    Scores
        A line for each item, best first, with the fit and the classes; ``to_json()`` is what the command prints.

    Raises
    ------
    ResultsError
        If ``alpha`` is out of range, or as `fit_model`; with ``quasi_variances`` also with fewer than three items.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> answers = [Answer("a", "b", 30), Answer("b", "a", 10), Answer("b", "c", 30), Answer("c", "b", 10)]
    >>> [(item.name, item.label) for item in score(from_answers(answers)).items]
    [('a', '1'), ('b', '2'), ('c', '3')]
    """
    check_level(alpha)
    check_adjustment(adjust)
    prior_sd, ordered = fitting.get("prior_sd", DEFAULT_PRIOR_SD), fitting.get("order_effect", False)
    fit, covariance = partial(fit_model, comparisons, model, order_effect=ordered), fitting.get("covariance", "auto")
    method = fitting.get("method", "ml")
    fitted = fit(method="ml" if method == "auto" else method, prior_sd=prior_sd, covariance=covariance)
    few = fitted.counts.n <= MOST_ITEMS_PENALISED
    if method == "auto" and fitted.separation and few and not are_apart(fitted.counts):
        fitted = fit(method="firth", covariance=covariance if covariance in ("model", "scaled") else "auto")
    sound = fitted.separation is None and bool(np.isfinite(fitted.theta).all())
    find_classes = partial(classes_of, fitted, alpha=alpha, adjust=adjust) if sound else partial(_known, None)
    quasi = fitted.quasi_variances() if sound and quasi_variances else None
    return Scores(_order(comparisons, fitted), comparisons, fitted, find_classes, quasi)


def classes_of(fitted: Fit, *, alpha: float = 0.05, adjust: Adjust = "holm") -> Classes | None:
    """Return the classes of a fit's items, by its covariance and degrees of freedom; None where there are too many."""
    spread = fitted.clustered.spread if fitted.clustered else None
    how = partial(classify, alpha=alpha, adjust=adjust, df=fitted.pair_freedom, spread=spread)
    return classes_if_few(partial(how, fitted.theta, fitted.covariance, profiles=profiles_of(fitted)))


def rescored(scores: Scores, fitted: Fit, classes: Classes | None) -> Scores:
    """Return the lines of the same comparisons by another fit, such as one with another covariance."""
    order = _order(scores.comparisons, fitted)
    return Scores(order, scores.comparisons, fitted, partial(_known, classes))


def _known(classes: Classes | None) -> Classes | None:
    return classes


def _counts(comparisons: Comparisons, fitted: Fit) -> tuple[Floats, Floats, Floats]:
    """Return how often each item won, was compared and was tied, each of shape (n,)."""
    won, compared = comparisons.won, comparisons.compared
    ties = comparisons.tied_with if LAWS[fitted.model].parameter else np.zeros(len(won))
    return won, compared + ties, ties


def _order(comparisons: Comparisons, fitted: Fit) -> tuple[int, ...]:
    if fitted.separation is None and bool(np.isfinite(fitted.theta).all()):
        return best_first(fitted.theta)
    won, compared, ties = _counts(comparisons, fitted)
    return best_first((won + ties / 2) / np.maximum(compared, np.finfo(np.float64).tiny))


def _lines(scores: Scores) -> tuple[ItemScore, ...]:
    comparisons, fitted, classes, quasi = scores.comparisons, scores.fit, scores.classes, scores.quasi
    won, compared, _ = _counts(comparisons, fitted)
    se, shares, log10_shares = fitted.se, fitted.score, fitted.log10_score
    if LAWS[fitted.model].unit != "nats":
        shares = log10_shares = np.full(len(won), np.nan)
    with np.errstate(invalid="ignore"):  # the root of a quasi-variance below zero is NaN: there is none
        quasi_se = np.full(len(won), np.nan) if quasi is None else np.sqrt(quasi.variances)
    return tuple(
        ItemScore(
            name=comparisons.items[index],
            wins=float(won[index]),
            comparisons=float(compared[index]),
            theta=finite(fitted.theta[index]),
            se=finite(se[index]),
            score=finite(shares[index]),
            log10_score=finite(log10_shares[index]),
            label=classes.labels[index] if classes else None,
            quasi_se=finite(quasi_se[index]),
        )
        for index in scores.order
    )
