"""Effects of the stimuli's factors on their strengths: a structured Bradley-Terry model [Springall1973]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np

from analysis.comparisons.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.factors.aliasing import choose_terms
from analysis.factors.estimates import effects, estimates
from analysis.factors.explained import explain
from analysis.factors.fit import fit_terms
from analysis.factors.likelihood_ratio import factor_tests, interaction_tests
from analysis.factors.result import FactorEffects, FactorMethod
from analysis.factors.separation import separated_effects
from analysis.factors.terms import Coding, main_term
from analysis.factors.values import Value, Wishes, read_factors
from analysis.scaling.counts import count_pairs
from analysis.scaling.fit import DEFAULT_PRIOR_SD
from analysis.scaling.separation import compared_groups
from documents import Finding


def factor_effects(
    comparisons: Comparisons,
    factors: Mapping[str, Mapping[str, Value]],
    *,
    use: Sequence[str] | None = None,
    categorical: Sequence[str] = (),
    log: Sequence[str] = (),
    references: Mapping[str, Value] | None = None,
    coding: Coding = "treatment",
    method: FactorMethod = "ml",
    prior_sd: float = DEFAULT_PRIOR_SD,
) -> FactorEffects:
    """Fit θ = X β, X being made of the stimuli's factors.

    Parameters
    ----------
    factors
        The factors of each item: text, or numbers. More items than were compared do no harm.
    use
        Which factors, in which order; by default all, as they are met. Of aliased factors the first stays.
    categorical
        Factors with numbers that are to be taken as levels.
    log
        Factors whose logarithm counts; the effect is then per doubling.
    references
        Reference levels; a factor with one is categorical. By default the level that is met first, or the least number.
    coding
        ``treatment``: effects are differences from the reference level; ``sum``: from the mean of all levels.
    method
        ``ml``, or ``map`` with a Gaussian prior on each strength, as `analysis.scaling.fit.fit_model` has it.
    prior_sd
        Standard deviation of that prior, in nats.

    Raises
    ------
    ResultsError
        If an item has no factors, a name or a level is unknown, no factor varies, a number is unfit, or there is no
        such coding, method or prior.
    """
    _check(comparisons, coding, method, prior_sd)
    items = comparisons.items
    counts, answers = count_pairs(comparisons)
    read, left_out = read_factors(items, factors, Wishes(use, categorical, log, references))
    groups = compared_groups(comparisons.wins)
    terms, aliased = choose_terms([main_term(factor, coding) for factor in read], groups)
    left_out += aliased
    if not terms:
        why = "; ".join(f"'{one.name}': {one.reason}" for one in left_out) or "the stimuli have none"
        raise ResultsError(Finding(f"there is no factor whose effect could be told: {why}", remedy="use another"))
    names = [term.names[0] for term in terms]
    kept = [factor for factor in read if factor.name in names]
    prior = prior_sd if method == "map" else None
    runaway = separated_effects(counts, terms)
    observers = len(np.unique(answers.observer))
    shared: dict[str, Any] = {
        "items": items,
        "factors": tuple(kept),
        "left_out": tuple(left_out),
        "coding": coding,
        "method": method,
        "prior_sd": prior,
        "observers": observers,
        "ties_left_out": comparisons.ties,
    }
    if runaway and prior is None:
        return _unfitted(shared, runaway)
    fit = fit_terms(counts, terms, prior)
    estimate, covariance, sandwich, robust = estimates(counts, answers, terms, fit, observers)
    tested = method == "ml" and fit.converged
    return FactorEffects(
        **shared,
        effects=effects(terms, estimate, covariance, sandwich, observers),
        joint_covariance=covariance,
        sandwich_covariance=sandwich,
        tests=factor_tests(counts, terms, fit, robust) if tested else (),
        interactions=interaction_tests(counts, kept, terms, fit, groups) if tested else (),
        explained=explain(counts, comparisons.wins, fit, tested=tested),
        theta=fit.theta,
        log_likelihood=fit.log_likelihood,
        converged=fit.converged,
        iterations=fit.iterations,
        separation=(),
        held_by_prior=runaway,
    )


def _unfitted(shared: dict[str, Any], separation: tuple[str, ...]) -> FactorEffects:
    return FactorEffects(
        **shared,
        effects=(),
        joint_covariance=np.empty((0, 0)),
        sandwich_covariance=None,
        tests=(),
        interactions=(),
        explained=None,
        theta=np.full(len(shared["items"]), np.nan),
        log_likelihood=float("nan"),
        converged=False,
        iterations=0,
        separation=separation,
        held_by_prior=(),
    )


def _check(comparisons: Comparisons, coding: str, method: str, prior_sd: float) -> None:
    for what, value, known in (("coding", coding, get_args(Coding)), ("method", method, get_args(FactorMethod))):
        if value not in known:
            raise ResultsError(Finding(f"there is no {what} '{value}'", remedy="expected one of: " + ", ".join(known)))
    if method == "map" and not (np.isfinite(prior_sd) and prior_sd > 0):
        raise ResultsError(Finding(f"the prior's standard deviation is {prior_sd:g}", remedy="give one above zero"))
    if len(comparisons.items) < 2 or not comparisons.count.any():
        raise ResultsError(Finding("no two items were compared with an outcome", remedy="compare two items at least"))
