"""Effects of the stimuli's factors on their strengths: a structured Bradley-Terry model [Springall1973]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np

from analysis.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.scaling import (
    DEFAULT_PRIOR_SD,
    Answers,
    Columns,
    Counts,
    Jeffreys,
    Profiles,
    compared_groups,
    count_pairs,
    outweighed,
)
from documents import Finding, one_blas_thread
from documents.arrays import Floats
from extensions.factors.aliasing import choose_terms
from extensions.factors.explained import explain
from extensions.factors.fit import TermsFit, fit_terms
from extensions.factors.likelihood_ratio import NO_SPREAD, factor_tests, interaction_tests, robust_wald, slopes_at
from extensions.factors.result import Effect, FactorEffects, FactorMethod, Tested, by_standard_error, effect
from extensions.factors.separation import separated_effects
from extensions.factors.terms import Coding, Term, main_term
from extensions.factors.values import FactorOptions, Value, read_factors

MOST_ITEMS_PROFILED = 200


@one_blas_thread()
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
    tests_alone: bool = False,
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
        ``ml``, or ``map`` with a Gaussian prior on each strength, as `analysis.scaling.fitting.fit_model` has it.
    prior_sd
        Standard deviation of that prior, in nats.
    tests_alone
        Leave out effects, their intervals and what is explained: for tests of many sets of answers.

    Returns
    -------
    FactorEffects
        The effect of each level or number with its standard error, and tests of each factor, of every interaction and
        of lack of fit: by likelihood ratio, and with the observer as the unit.

    Raises
    ------
    ResultsError
        If an item has no factors, a name or a level is unknown, no factor varies, a number is unfit, or there is no
        such coding, method or prior.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> answers = from_answers([Answer("flat", "stereo", 10), Answer("stereo", "flat", 30)])
    >>> stereo = factor_effects(answers, {"flat": {"view": "flat"}, "stereo": {"view": "stereo"}}).effects[0]
    >>> stereo.level, round(stereo.estimate, 3)  # log 3
    ('stereo', 1.099)
    """
    _check(comparisons, coding, method, prior_sd)
    items = comparisons.items
    counts, answers = count_pairs(comparisons)
    read, left_out = read_factors(items, factors, FactorOptions(use, categorical, log, references))
    groups = compared_groups(comparisons.wins)
    terms, aliased = choose_terms([main_term(factor, coding) for factor in read], groups)
    left_out += aliased
    if not terms:
        why = "; ".join(f"'{factor.name}': {factor.reason}" for factor in left_out) or "the stimuli have none"
        raise ResultsError(Finding(f"there is no factor whose effect could be estimated: {why}", remedy="use another"))
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
    estimate, covariance, sandwich, robust = _estimates(counts, answers, terms, fit, observers)
    tested = method == "ml" and fit.converged
    slopes = slopes_at(counts, answers, fit)
    effects: tuple[Effect, ...] = ()
    if not tests_alone:
        known = method == "ml" and counts.n <= MOST_ITEMS_PROFILED and not outweighed(counts, Columns(fit.basis))
        profiles = _profiles(counts, terms, fit) if known else None
        effects = _effects(terms, estimate, covariance, sandwich, observers, profiles)
    return FactorEffects(
        **shared,
        effects=effects,
        joint_covariance=covariance,
        sandwich_covariance=sandwich,
        tests=factor_tests(counts, answers, terms, fit, robust) if tested else (),
        interactions=interaction_tests(counts, slopes, kept, terms, fit, groups) if tested else (),
        explained=None if tests_alone else explain(counts, comparisons.wins, fit, slopes if tested else None),
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


def _estimates(
    counts: Counts, answers: Answers, terms: Sequence[Term], fit: TermsFit, observers: int
) -> tuple[Floats, Floats, Floats | None, list[tuple[float, float] | None]]:
    """Return all effects, their covariance by the model and by observers, and Wald's robust test of each term."""
    basis, to_beta = fit.basis, _to_beta(terms, fit)
    beta = to_beta @ fit.gamma
    beta_covariance = to_beta @ fit.inverse @ to_beta.T
    contrasts = _block_diagonal([term.contrasts for term in terms])
    covariance = contrasts @ beta_covariance @ contrasts.T
    none: list[tuple[float, float] | None] = [None] * len(terms)
    if observers < 2:
        return contrasts @ beta, covariance, None, none
    half = slopes_at(counts, answers, fit) @ basis @ fit.inverse @ to_beta.T
    beta_sandwich = half.T @ half * (observers / (observers - 1))
    starts = np.cumsum([0, *(term.width for term in terms)])
    se = np.sqrt(np.diag(beta_covariance))
    robust = []
    for term, start in zip(terms, starts, strict=False):
        own = np.arange(start, start + term.width)
        robust.append(robust_wald(beta[own], beta_sandwich[np.ix_(own, own)], se[own], observers))
    return contrasts @ beta, covariance, contrasts @ beta_sandwich @ contrasts.T, robust


def _to_beta(terms: Sequence[Term], fit: TermsFit) -> Floats:
    """Return what makes β of γ, where θ = basis @ γ = centred columns @ β."""
    columns = np.hstack([term.columns for term in terms])
    return np.asarray(np.linalg.inv(fit.basis.T @ (columns - columns.mean(axis=0))))


def _profiles(counts: Counts, terms: Sequence[Term], fit: TermsFit) -> Profiles:
    """Return the profiles of all effects, with the model's variance."""
    contrasts = _block_diagonal([term.contrasts for term in terms]) @ _to_beta(terms, fit) @ fit.basis.T
    likelihood = Jeffreys(counts, basis=fit.basis)
    return Profiles(likelihood, fit.theta, contrasts, np.ones(len(contrasts)), None)


def _effects(
    terms: Sequence[Term],
    estimate: Floats,
    covariance: Floats,
    sandwich: Floats | None,
    observers: int,
    profiles: Profiles | None,
) -> tuple[Effect, ...]:
    """Return the effects, term by term, with their tests and intervals."""
    named = [(term.names[0], label, term.reference) for term in terms for label in term.labels]
    se = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    plain = _tested(estimate, se, None, profiles)
    robust: list[tuple[float, Tested] | None] = [None] * len(named)
    if sandwich is not None:
        robust_se = np.sqrt(np.maximum(np.diag(sandwich), 0.0))
        ratio = np.divide(robust_se, se, out=np.zeros_like(se), where=se > 0) ** 2
        freedom = np.full(len(se), observers - 1.0)
        by_observers = None if profiles is None else profiles.by(ratio, freedom)
        known = robust_se > NO_SPREAD * se
        found = _tested(estimate, np.where(known, robust_se, se), observers - 1, by_observers)
        robust = [(float(robust_se[place]), found[place]) if known[place] else None for place in range(len(named))]
    return tuple(
        effect(name, float(estimate[place]), float(se[place]), plain[place], robust[place])
        for place, name in enumerate(named)
    )


def _tested(estimate: Floats, se: Floats, df: float | None, profiles: Profiles | None) -> list[Tested]:
    """Test each effect; where its profile has no end, as with two or three observers, that by the standard error is."""
    plain = [by_standard_error(*both, df) for both in zip(estimate.tolist(), se.tolist(), strict=True)]
    if profiles is None:
        return plain
    low, high = profiles.interval().T
    low = np.where(np.isfinite(low), low, [one[0] for one in plain])
    high = np.where(np.isfinite(high), high, [one[1] for one in plain])
    ends = np.minimum(low, estimate), np.maximum(high, estimate)  # the estimate is without Firth's term
    return [(float(low), float(high), float(p)) for low, high, p in zip(*ends, profiles.p, strict=True)]


def _block_diagonal(blocks: Sequence[Floats]) -> Floats:
    whole = np.zeros((sum(len(block) for block in blocks), sum(block.shape[1] for block in blocks)))
    row = column = 0
    for block in blocks:
        whole[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return whole
