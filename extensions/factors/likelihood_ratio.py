"""Likelihood-ratio tests of type II: each factor against the model of all the others.

An interaction is tested against the model of all factors without interactions, one at a time. Likelihood ratios take
all answers for independent. Beside each stands the score test of `analysis.scaling.robust_tests`, with the observer as
the unit: with A and A₀ the covariances of θ by the larger model and the smaller, both at the smaller one's maximum, and
u_g the slope of observer g's log likelihood there, the observers' contributions have the inner products
u_gᵀ (A − A₀) u_h. Beside the tests of factors stands Wald's with the sandwich covariance too: with G observers and r
effects, W (G − r) / (r (G − 1)) is compared with the F distribution of r and G − r degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import ClassVar

import numpy as np

from analysis.classes import Conclusion, concluded, holm
from analysis.scaling import (
    LOGISTIC,
    Answers,
    Columns,
    Counts,
    Groups,
    ModelDesign,
    ObserverTest,
    Point,
    from_factors,
    observer_slopes,
)
from documents.arrays import Floats
from documents.text import JsonResult
from extensions.factors.aliasing import rank_gained
from extensions.factors.fit import TermsFit, fit_terms
from extensions.factors.separation import is_separated
from extensions.factors.terms import Term, empty_cell, interaction_term
from extensions.factors.values import Factor

NO_SPREAD = 1e-6
WORST_CONDITION = 1e12


@dataclass(frozen=True, slots=True)
class FactorTest(JsonResult):
    """Test of one factor.

    Attributes
    ----------
    name
        The factor.
    statistic, df, p
        Twice the log likelihood lost without it, its degrees of freedom, and the χ² chance of as much by accident.
    robust_statistic, robust_p
        Wald's statistic with the sandwich covariance, as F, and its p; None where there are too few observers.
    by_observers
        The score test with the observer as the unit, to judge by; None with fewer than five observers.
    compared
        Of a factor with one effect between two levels, which, such as ": stereo over flat".
    """

    name: str
    statistic: float
    df: int
    p: float
    robust_statistic: float | None
    robust_p: float | None
    by_observers: ObserverTest | None = None
    compared: str = ""
    type: ClassVar = "II"
    json_keys: ClassVar = {"conclusion.verdict": "verdict", "compared": None}
    json_also: ClassVar = ("type", "conclusion.verdict")

    @property
    def observer_p(self) -> float | None:
        """The p value by observers; Wald's with fewer than five of them."""
        return self.by_observers.p if self.by_observers else self.robust_p

    @property
    def conclusion(self) -> Conclusion:
        """What is concluded at the level 0.05: by observers with five of them or more, else by the likelihood ratio."""
        question = f"effect of '{self.name}'{self.compared}"
        return concluded(question, self.by_observers.p if self.by_observers else None, self.p)


@dataclass(frozen=True, slots=True)
class InteractionTest(JsonResult):
    """Test of two factors' interaction, or why there is none.

    ``p`` is that of the likelihood ratio, ``by_observers`` the test with the observer as the unit, None with fewer than
    five observers. ``p_holm`` and ``observer_p_holm`` are after Holm's adjustment for all the interactions that were
    tested.
    """

    names: tuple[str, str]
    statistic: float | None
    df: int | None
    p: float | None
    p_holm: float | None
    not_fitted: str | None
    by_observers: ObserverTest | None = None
    observer_p_holm: float | None = None
    json_keys: ClassVar = {"conclusion.verdict": "verdict"}
    json_also: ClassVar = ("conclusion.verdict",)

    @property
    def conclusion(self) -> Conclusion:
        """What is concluded at the level 0.05 after Holm's adjustment: by observers where there is such a test."""
        question = f"interaction of '{self.names[0]}' and '{self.names[1]}'"
        return concluded(question, self.observer_p_holm if self.by_observers else None, self.p_holm)


def statistic(larger: TermsFit, smaller: TermsFit) -> float:
    """Return twice the gain in log likelihood, summed by pair, so that little is lost where counts are huge."""
    return max(0.0, float(2 * (larger.pair_terms - smaller.pair_terms).sum()))


def chance(value: float, df: int) -> float:
    """Return the chance of at least ``value`` by the χ² distribution; ``df`` above zero."""
    from scipy.special import gammaincc

    return float(gammaincc(df / 2, value / 2))


def slopes_at(counts: Counts, answers: Answers, fit: TermsFit) -> Floats:
    """Return the slope of each observer's log likelihood at ``fit``, shape (G, n)."""
    nothing = np.zeros((1, 1))
    return observer_slopes(counts, answers, LOGISTIC, Point(fit.theta[None], nothing, nothing))


def observer_test(slopes: Floats, larger: Floats, smaller: TermsFit, df: int) -> ObserverTest | None:
    """Test what a larger model adds: ``larger`` (n, n) is its covariance of θ at ``smaller``, as are ``slopes``."""
    return from_factors(df, (slopes, larger - smaller.covariance))


def covariance_at(counts: Counts, design: ModelDesign, fit: TermsFit) -> Floats:
    """Return the covariance (n, n) of strengths that are free to do what ``design`` lets them, at those of ``fit``."""
    weight = LOGISTIC.slopes(counts, counts.differences(fit.theta[None]), 0.0).dd
    return np.asarray(design.covariance(counts, weight, 0.0)[0])


def factor_tests(
    counts: Counts,
    answers: Answers,
    terms: Sequence[Term],
    full: TermsFit,
    robust: Sequence[tuple[float, float] | None],
) -> tuple[FactorTest, ...]:
    """Test each factor of the fit ``full``; ``robust`` are Wald's F and p of each."""
    tests = []
    for place, (term, wald) in enumerate(zip(terms, robust, strict=True)):
        others = [other for other in terms if other is not terms[place]]
        without = fit_terms(counts, others)
        lost = statistic(full, without)
        larger = covariance_at(counts, Columns(full.basis), without)
        by_observers = observer_test(slopes_at(counts, answers, without), larger, without, term.width)
        f, robust_p = wald or (None, None)
        p = chance(lost, term.width)
        compared = f": {term.labels[0]} over {term.reference}" if term.reference and len(term.labels) == 1 else ""
        tests.append(FactorTest(term.names[0], lost, term.width, p, f, robust_p, by_observers, compared))
    return tuple(tests)


def robust_wald(effects: Floats, covariance: Floats, model_se: Floats, observers: int) -> tuple[float, float] | None:
    """Return F and its p for ``effects`` (r,) with a sandwich covariance (r, r).

    None with no more observers than effects, or where observers hardly differ: the sandwich then says nothing.
    """
    from scipy.special import fdtrc

    r = len(effects)
    if observers <= r:
        return None
    scale = np.sqrt(np.diag(covariance))
    if not (scale > NO_SPREAD * model_se).all():
        return None
    correlation = covariance / scale / scale[:, None]
    if np.linalg.cond(correlation) > WORST_CONDITION:
        return None
    z = effects / scale
    ratio = float(z @ np.linalg.solve(correlation, z)) * (observers - r) / (r * (observers - 1))
    return ratio, float(fdtrc(r, observers - r, ratio))


def interaction_tests(
    counts: Counts, slopes: Floats, factors: Sequence[Factor], terms: Sequence[Term], full: TermsFit, groups: Groups
) -> tuple[InteractionTest, ...]:
    """Test every two factors' interaction, each added alone to ``full``, where the observers have ``slopes``."""
    tests = [
        _interaction(counts, slopes, (factors[i], factors[j]), (terms[i], terms[j]), terms, full, groups)
        for i, j in combinations(range(len(terms)), 2)
    ]
    fitted = [place for place, test in enumerate(tests) if test.p is not None]
    adjusted = holm(np.array([tests[place].p for place in fitted], dtype=np.float64))
    for place, p in zip(fitted, adjusted.tolist(), strict=True):
        tests[place] = replace(tests[place], p_holm=p)
    own = {place: test.by_observers.p for place, test in enumerate(tests) if test.by_observers}
    for place, p in zip(own, holm(np.array(list(own.values()), dtype=np.float64)).tolist(), strict=True):
        tests[place] = replace(tests[place], observer_p_holm=p)
    return tuple(tests)


def _interaction(
    counts: Counts,
    slopes: Floats,
    factors: tuple[Factor, Factor],
    pair: tuple[Term, Term],
    terms: Sequence[Term],
    full: TermsFit,
    groups: Groups,
) -> InteractionTest:
    names = (factors[0].name, factors[1].name)
    empty = empty_cell(*factors)
    if empty:
        return InteractionTest(names, None, None, None, None, empty)
    added = interaction_term(*pair)
    if rank_gained(terms, added, groups) < added.width:
        return InteractionTest(names, None, None, None, None, "the factors already explain all or part of it")
    whole = [*terms, added]
    if is_separated(counts, whole):
        why = "with it the likelihood rises without end: it has no finite maximum"
        return InteractionTest(names, None, None, None, None, why)
    fit = fit_terms(counts, whole)
    if not fit.converged:
        return InteractionTest(names, None, None, None, None, f"the fit did not converge in {fit.iterations} steps")
    gained = statistic(fit, full)
    by_observers = observer_test(slopes, covariance_at(counts, Columns(fit.basis), full), full, added.width)
    return InteractionTest(names, gained, added.width, chance(gained, added.width), None, None, by_observers)
