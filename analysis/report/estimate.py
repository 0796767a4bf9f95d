"""The scores in a report: method of the fit, standard errors for the classes, intervals, stability of the classes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap.confidence_intervals import DEFAULT, intervals
from analysis.bootstrap.replicates import Replicates, resample
from analysis.bootstrap.stability import Covariance, Stability, class_stability
from analysis.classes.classes import classify
from analysis.classes.multiplicity import Adjust
from analysis.comparisons.comparisons import Comparisons
from analysis.scaling.fitting import fit_model
from analysis.scaling.learnt_prior import learnt_posterior
from analysis.scaling.result import Fit
from analysis.scaling.scores import Scores, rescored, score
from analysis.scaling.separation import compared_groups

Floats = NDArray[np.float64]
CovarianceChoice = Literal["auto", "model", "sandwich"]
COVARIANCE_CHOICES: tuple[CovarianceChoice, ...] = get_args(CovarianceChoice)
ScoreMethod = Literal["ml", "firth", "learnt_prior"]
FEWEST_FOR_SANDWICH = 10
# Above these numbers of items, a thousand bootstrap samples, or their classes, take too long. Standard errors clustered
# by observer give no simple order: the classes of hundreds of items are then too many to list.
MOST_ITEMS_DRAWN, MOST_ITEMS_CLASSED, MOST_ITEMS_FOR_SANDWICH = 60, 30, 60
TWO_SIDED_95 = 1.959963984540054


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """The scores and how they were estimated.

    Attributes
    ----------
    scores
        Items best first; standard errors and classes by ``covariance``.
    plain
        The fit by maximum likelihood.
    method
        ``ml``; ``firth`` in case of complete separation; ``learnt_prior`` if pairs were chosen by the answers.
    prior_sd
        Standard deviation of the learnt prior, in nats; None without a prior.
    covariance, df
        Kind of standard errors, and their degrees of freedom; None for the model's.
    log10_interval, interval_kind
        Shape (items, 2): 95 % limits of log10 score in the order of the scores' items; ``expanded-bca`` by
        bootstrap over observers, or ``model``.
    stability
        Stability of the classes over the bootstrap samples; None without them.
    """

    scores: Scores
    plain: Fit
    method: ScoreMethod
    prior_sd: float | None
    covariance: Covariance
    df: int | None
    log10_interval: Floats
    interval_kind: Literal["expanded-bca", "model"]
    stability: Stability | None


def estimate_scores(
    comparisons: Comparisons,
    *,
    alpha: float,
    adjust: Adjust,
    covariance: CovarianceChoice = "auto",
    chosen: bool = False,
    draw: bool = True,
) -> Estimate:
    """Fit scores, and compute classes, intervals and the stability of the classes.

    Parameters
    ----------
    covariance
        ``model``, ``sandwich``, or ``auto``: ``sandwich`` from 10 observers, up to 60 items. If observers agree without
        exception about an item, or with fewer than two observers, the model's standard errors are used.
    chosen
        Whether pairs were chosen by earlier answers: scores are then the posterior under a normal prior whose standard
        deviation is learnt, since maximum likelihood overestimates differences from such pairs.
    draw
        Whether to make the bootstrap over observers, for intervals and stability.
    """
    scores = score(comparisons, alpha=alpha, adjust=adjust)
    plain, prior_sd = scores.fit, None
    method: ScoreMethod = "ml"
    linked = len(compared_groups(comparisons.wins)) == 1
    if chosen and linked:
        scores, prior_sd = _under_prior(comparisons, alpha, adjust)
        limits = delta_interval(scores.fit.score, scores.fit.log10_score, scores.fit.covariance)
        ordered = limits[list(scores.order)]
        return Estimate(scores, plain, "learnt_prior", prior_sd, "model", None, ordered, "model", None)
    if plain.separated and linked:
        scores, method = score(comparisons, alpha=alpha, adjust=adjust, method="firth"), "firth"
    fitted = bool(np.isfinite(scores.fit.theta).all())
    replicates = _resampled(comparisons, method) if fitted and draw else None
    limits = delta_interval(scores.fit.score, scores.fit.log10_score, scores.fit.covariance)
    if replicates is not None:
        ends = intervals(replicates, "log10_score")
        limits = np.stack([ends.low, ends.high], axis=1)
    used, df = _covariance(covariance, comparisons, method, fitted)
    if df is not None:
        scores = _with_sandwich(scores, alpha, adjust, df)
    stable = None
    if replicates is not None and len(comparisons.items) <= MOST_ITEMS_CLASSED:
        stable = class_stability(replicates, alpha=alpha, adjust=adjust, covariance=used)
    kind = cast("Literal['expanded-bca', 'model']", DEFAULT if replicates is not None else "model")
    return Estimate(scores, plain, method, prior_sd, used, df, limits[list(scores.order)], kind, stable)


def _covariance(
    choice: CovarianceChoice, comparisons: Comparisons, method: ScoreMethod, fitted: bool
) -> tuple[Covariance, int | None]:
    people = len(comparisons.observers)
    if not fitted or method != "ml" or people < 2 or choice == "model":
        return "model", None
    enough = people >= FEWEST_FOR_SANDWICH and len(comparisons.items) <= MOST_ITEMS_FOR_SANDWICH
    if choice == "sandwich" or enough:
        return "sandwich", people - 1
    return "model", None


def _resampled(comparisons: Comparisons, method: ScoreMethod) -> Replicates | None:
    if len(comparisons.observers) < 2 or len(comparisons.items) > MOST_ITEMS_DRAWN:
        return None
    return resample(comparisons, method="firth" if method == "firth" else "ml")


def _with_sandwich(scores: Scores, alpha: float, adjust: Adjust, df: int) -> Scores:
    robust = fit_model(scores.comparisons, covariance="sandwich")
    fitted = replace(scores.fit, joint_covariance=robust.joint_covariance, covariance_kind="sandwich")
    return _classed(scores, fitted, alpha, adjust, df)


def _under_prior(comparisons: Comparisons, alpha: float, adjust: Adjust) -> tuple[Scores, float]:
    scores = score(comparisons, alpha=alpha, adjust=adjust, method="firth")
    learnt = learnt_posterior(comparisons.wins)
    fitted = replace(
        scores.fit,
        method="map",
        prior_sd=learnt.prior_sd,
        theta=learnt.theta,
        joint_covariance=learnt.covariance,
        log_likelihood=learnt.log_likelihood,
        iterations=learnt.iterations,
        converged=learnt.converged,
    )
    return _classed(scores, fitted, alpha, adjust, None), learnt.prior_sd


def _classed(scores: Scores, fitted: Fit, alpha: float, adjust: Adjust, df: int | None) -> Scores:
    """Return the scores by another fit of the same comparisons, with the order and classes that follow."""
    classes = classify(fitted.theta, fitted.covariance, alpha=alpha, adjust=adjust, df=df)
    return rescored(scores, fitted, classes)


def delta_interval(score: Floats, log10_score: Floats, covariance: Floats) -> Floats:
    """Return 95 % limits (n, 2) of log10 score by the delta method: the gradient is the unit vector minus scores."""
    gradient = np.eye(len(score)) - score[None, :]
    variance = np.einsum("ij,jk,ik->i", gradient, covariance, gradient)
    half_width = TWO_SIDED_95 * np.sqrt(np.maximum(variance, 0)) / np.log(10)
    return np.stack([log10_score - half_width, log10_score + half_width], axis=1)
