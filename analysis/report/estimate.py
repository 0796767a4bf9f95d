"""The scores in a report: method of the fit, standard errors for the classes, intervals, stability of the classes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from analysis.bootstrap.replicates import Replicates, resample
from analysis.bootstrap.stability import Stability, class_stability
from analysis.choices import Adjust, CovarianceChoice
from analysis.comparisons.comparisons import Comparisons
from analysis.report.words import COVARIANCE_WORDS
from analysis.scaling.clustered import by_observer
from analysis.scaling.counts import count_pairs
from analysis.scaling.laws import LOGISTIC
from analysis.scaling.learnt_prior import Posterior, learnt_posterior
from analysis.scaling.newton import Point
from analysis.scaling.profile import profiles_of
from analysis.scaling.result import TWO_SIDED_95, CovarianceKind, Fit
from analysis.scaling.scores import Scores, classes_of, rescored, score
from analysis.scaling.separation import compared_groups
from documents.arrays import Floats

ScoreMethod = Literal["ml", "firth", "learnt_prior"]
# Above these numbers of items, a thousand bootstrap samples, or their classes, take too long.
MOST_ITEMS_DRAWN, MOST_ITEMS_CLASSED = 60, 30


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
    covariance
        Kind of standard errors.
    log10_interval
        Shape (items, 2): 95 % limits of log10 score in the order of the scores' items, by ``covariance``.
    stability
        Stability of the classes over the bootstrap samples; None without them.
    """

    scores: Scores
    plain: Fit
    method: ScoreMethod
    prior_sd: float | None
    covariance: CovarianceKind
    log10_interval: Floats
    stability: Stability | None

    @property
    def by_likelihood(self) -> bool:
        """Whether two stimuli are tested by likelihood ratios; otherwise by their standard errors alone."""
        return profiles_of(self.scores.fit) is not None

    @property
    def error_words(self) -> str:
        """How two stimuli are tested, whose standard errors the tests use, and by which law."""
        fit = self.scores.fit
        errors = f"standard errors by {COVARIANCE_WORDS[self.covariance]}"
        if self.by_likelihood:
            errors = f"penalised likelihood ratios by {COVARIANCE_WORDS[self.covariance]}"
        if fit.clustered is not None:
            errors += f", and Student's t with {fit.clustered.freedom_words}"
        exact = self.by_likelihood and fit.wins_by_observer is not None
        return errors + (" (or, where that is smaller, the exact p of exchanging the two)" if exact else "")


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
        As `analysis.scaling.fitting.fit_model` has it; Firth's fits have ``scaled`` in place of ``sandwich`` and
        ``shrinkage``.
    chosen
        Whether pairs were chosen by earlier answers: scores are then the posterior under a normal prior whose standard
        deviation is learnt, since maximum likelihood overestimates differences from such pairs.
    draw
        Whether to make the bootstrap over observers, for the stability of the classes.
    """
    scores = score(comparisons, alpha=alpha, adjust=adjust, covariance=_possible(covariance, comparisons))
    plain, prior_sd = scores.fit, None
    method: ScoreMethod = "ml"
    linked = len(compared_groups(comparisons.wins)) == 1
    if chosen and linked:
        scores, learnt = _under_prior(comparisons, alpha, adjust, _possible(covariance, comparisons))
        limits = learnt.log10_score_limits(wider=_student_to_normal(scores.fit))[list(scores.order)]
        return Estimate(scores, plain, "learnt_prior", learnt.prior_sd, scores.fit.covariance_kind, limits, None)
    if plain.separated and linked:
        firth: CovarianceChoice = "model" if covariance == "model" else "auto"
        scores, method = score(comparisons, alpha=alpha, adjust=adjust, method="firth", covariance=firth), "firth"
    kind = scores.fit.covariance_kind
    fitted = bool(np.isfinite(scores.fit.theta).all())
    stable = None
    if fitted and draw and len(comparisons.items) <= MOST_ITEMS_CLASSED:
        replicates = _resampled(comparisons, method)
        if replicates is not None:
            stable = class_stability(replicates, alpha=alpha, adjust=adjust, covariance=kind)
    return Estimate(scores, plain, method, prior_sd, kind, _log10_interval(scores), stable)


def _possible(choice: CovarianceChoice, comparisons: Comparisons) -> CovarianceChoice:
    """Return ``choice``, or the model's covariance where there are too few observers for it."""
    return choice if len(np.unique(comparisons.observer)) > 1 else "model"


def _resampled(comparisons: Comparisons, method: ScoreMethod) -> Replicates | None:
    if len(comparisons.observers) < 2 or len(comparisons.items) > MOST_ITEMS_DRAWN:
        return None
    return resample(comparisons, method="firth" if method == "firth" else "ml")


def _under_prior(
    comparisons: Comparisons, alpha: float, adjust: Adjust, choice: CovarianceChoice
) -> tuple[Scores, Posterior]:
    """Return scores and their posterior under the learnt prior, as wide as observers differ.

    With two observers or more, the covariance is the posterior's, ``scaled`` by how much more observers' answers vary
    than the law says: pairs that follow from the answers leave too little for a sandwich.
    """
    scores = score(comparisons, alpha=alpha, adjust=adjust, method="firth")
    learnt, clustered = learnt_posterior(comparisons.wins), None
    if choice != "model":
        without = np.zeros((1, 1))
        point = Point(learnt.theta[None], without, without)
        clustered = by_observer("scaled", *count_pairs(comparisons), LOGISTIC, point, learnt.covariance)
        learnt = replace(learnt, covariance=clustered.joint)
    fitted = replace(
        scores.fit,
        covariance_kind="model" if clustered is None else "scaled",
        clustered=clustered,
        method="map",
        prior_sd=learnt.prior_sd,
        theta=learnt.theta,
        joint_covariance=learnt.covariance,
        log_likelihood=learnt.log_likelihood,
        iterations=learnt.iterations,
        converged=learnt.converged,
    )
    return rescored(scores, fitted, classes_of(fitted, alpha=alpha, adjust=adjust)), learnt


def _student_to_normal(fit: Fit) -> float:
    """Return how many times as wide as by the normal law intervals are, by the median of the degrees of freedom."""
    from scipy.special import stdtrit

    free = fit.pair_freedom
    return 1.0 if free is None else float(stdtrit(float(np.median(free)), 0.975)) / TWO_SIDED_95


def _log10_interval(scores: Scores) -> Floats:
    return log10_interval(scores.fit)[list(scores.order)]


def log10_interval(fit: Fit) -> Floats:
    """Return 95 % limits (n, 2) of log10 score by the delta method: the gradient is the unit vector minus scores.

    By Student's law with the degrees of freedom of the covariance; no limit is above 0.
    """
    from scipy.special import stdtrit

    gradient = np.eye(len(fit.score)) - fit.score[None, :]
    variance = np.einsum("ij,jk,ik->i", gradient, fit.covariance, gradient)
    free = fit.freedom(gradient)
    quantile = TWO_SIDED_95 if free is None else stdtrit(free, 0.975)
    half_width = quantile * np.sqrt(np.maximum(variance, 0)) / np.log(10)
    return np.stack([fit.log10_score - half_width, np.minimum(fit.log10_score + half_width, 0.0)], axis=1)
