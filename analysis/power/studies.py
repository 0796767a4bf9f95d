"""Many simulated studies of a plan at once: answers, fits, tests, and widths of the intervals of log10 scores."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap.fits import fit_each
from analysis.classes.multiplicity import corrected, two_sided_p
from analysis.power.plan import Interval, Plan
from analysis.scaling.laplacian import contrast_variances, pseudo_inverse, without_rounding
from analysis.scaling.laws import probabilities
from analysis.scaling.result import Method

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
BOOTSTRAPS = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Studies:
    """B studies by S observers each, fitted.

    Attributes
    ----------
    plan, observers
        Their plan, and S.
    won
        Shape (B, S, P), or (B, 1, P) where it does not matter who answered: how often the first item of each pair won.
    theta
        Shape (B, n): strengths in nats, mean 0; by Firth's fit where items are separated, as in a report; NaN where no
        fit converged.
    covariance
        Shape (B, n, n): of ``theta``, of the kind that the plan names.
    separated
        Shape (B,): whether the plain likelihood has no maximum.
    """

    plan: Plan
    observers: int
    won: Floats
    theta: Floats
    covariance: Floats
    separated: Flags

    def only(self, chosen: Flags) -> Studies:
        """Return some of the studies."""
        if chosen.all():
            return self
        won, theta, covariance = (part[chosen] for part in (self.won, self.theta, self.covariance))
        return Studies(self.plan, self.observers, won, theta, covariance, self.separated[chosen])

    def significant(self, critical_z: float) -> Flags:
        """Return which pairs differ at the plan's level, shape (B, P); ``critical_z`` is `Plan.critical_z`'s."""
        first, second = self.plan.pairs
        error = np.sqrt(contrast_variances(self.covariance)[:, first, second])
        off = np.abs(self.theta[:, first] - self.theta[:, second])
        z = np.divide(off, error, out=np.zeros_like(off), where=error > 0)
        if self.plan.adjust == "maxz":
            return np.asarray(z >= critical_z)
        p = two_sided_p(z, self.plan.degrees_of_freedom(self.observers))
        return np.asarray(corrected(p, self.plan.adjust) <= self.plan.alpha)


def run(plan: Plan, observers: int, replicates: int, random: np.random.Generator) -> Studies:
    """Simulate ``replicates`` studies by ``observers`` each, and fit them."""
    won = draw(plan, observers, replicates, random)
    totals = matrices(np.broadcast_to(plan.times * float(observers), (replicates, len(plan.times))))
    wins = np.tril(totals.transpose(0, 2, 1), -1)
    first, second = plan.pairs
    summed = won.sum(axis=1)
    wins[:, first, second] = summed
    wins[:, second, first] -= summed
    fits = fit_each(wins, "ml")
    p = probabilities(fits.theta)
    covariance = pseudo_inverse(totals * p * p.transpose(0, 2, 1))
    if plan.covariance == "sandwich":
        # Observers who agree without exception do not vary: only the model's covariance is left.
        kept = fits.separated
        covariance[~kept] = _sandwich(plan, won[~kept], p[~kept], covariance[~kept])
    return Studies(plan, observers, won, fits.theta, covariance, fits.separated)


def draw(plan: Plan, observers: int, replicates: int, random: np.random.Generator) -> Floats:
    """Return how often the first item of each pair won: shape (B, S, P), or (B, 1, P) of all observers together."""
    if not plan.by_observer:
        totals = plan.times * observers
        return random.binomial(totals, plan.chances(plan.theta), (replicates, 1, len(totals))).astype(np.float64)
    size = (replicates, observers, len(plan.times))
    own = plan.theta
    if plan.observer_sd > 0:
        own = own + random.normal(0, plan.observer_sd, (replicates, observers, len(plan.theta)))
    chances = np.broadcast_to(plan.chances(own), size)
    if (plan.times == 1).all():
        return (random.random(size) < chances).astype(np.float64)
    return random.binomial(plan.times, chances).astype(np.float64)


def matrices(values: Floats) -> Floats:
    """Spread values of pairs over symmetric matrices. Shapes (B, P) to (B, n, n)."""
    n = (1 + int(np.sqrt(1 + 8 * values.shape[-1]))) // 2
    first, second = np.triu_indices(n, 1)
    spread = np.zeros((len(values), n, n))
    spread[:, first, second] = spread[:, second, first] = values
    return spread


def _sandwich(plan: Plan, won: Floats, p: Floats, inverse: Floats) -> Floats:
    """Return S/(S − 1) H⁻¹ Σ g_s g_sᵀ H⁻¹ of each study, g_s being the slope of observer s's log likelihood."""
    first, second = plan.pairs
    people, n = won.shape[1], p.shape[1]
    pull = won - (plan.times * p[:, first, second])[:, None, :]
    incidence = np.zeros((len(first), n))
    incidence[np.arange(len(first)), first] = 1
    incidence[np.arange(len(first)), second] = -1
    slope = without_rounding(pull @ incidence, plan.times.astype(np.float64) @ np.abs(incidence))
    pulled = slope @ inverse
    spread = pulled.transpose(0, 2, 1) @ pulled
    return np.asarray(spread * (people / (people - 1)))


def widths(studies: Studies, random: np.random.Generator) -> Floats:
    """Return the width of each item's interval of log10 score in each study, shape (B, n)."""
    return _WAYS[studies.plan.interval](studies, random)


def _wald(studies: Studies, random: np.random.Generator) -> Floats:
    """Twice a quantile times the standard error by the delta method, as in `analysis.report.summary`."""
    from scipy.special import ndtri, softmax, stdtrit

    tail = (1 + studies.plan.level) / 2
    df = studies.plan.degrees_of_freedom(studies.observers)
    quantile = float(ndtri(tail) if df is None else stdtrit(df, tail))
    score = softmax(studies.theta, axis=1)
    # The gradient of log s_i is e_i − s: its variance is C_ii − 2 (C s)_i + sᵀ C s.
    pulled = (studies.covariance @ score[:, :, None])[:, :, 0]
    variance = np.diagonal(studies.covariance, axis1=1, axis2=2) - 2 * pulled
    variance = variance + (score * pulled).sum(axis=1, keepdims=True)
    return np.asarray(2 * quantile * np.sqrt(np.maximum(variance, 0)) / np.log(10))


def _bootstrap(studies: Studies, random: np.random.Generator) -> Floats:
    """The default of `analysis.bootstrap.confidence_intervals`, with 1000 bootstrap samples for each study."""
    from analysis.bootstrap.confidence_intervals import intervals
    from analysis.bootstrap.replicates import resample_counts

    plan, people = studies.plan, studies.observers
    first, second = plan.pairs
    names = [f"{number:04d}" for number in range(people)]
    width = np.empty_like(studies.theta)
    for place, (won, separated) in enumerate(zip(studies.won, studies.separated, strict=True)):
        counts = np.zeros((people, len(plan.items), len(plan.items)))
        counts[:, first, second] = won
        counts[:, second, first] = plan.times - won
        method: Method = "firth" if separated else "ml"
        seed = int(random.integers(2**31))
        samples = resample_counts(counts, plan.items, names, replicates=BOOTSTRAPS, seed=seed, method=method)
        ends = intervals(samples, "log10_score", level=plan.level)
        width[place] = ends.high - ends.low
    return width


_WAYS: dict[Interval, Callable[[Studies, np.random.Generator], Floats]] = {"wald": _wald, "bootstrap": _bootstrap}
