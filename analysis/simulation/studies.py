"""Many simulated studies of a plan at once: answers, fits, tests, and widths of the intervals of log10 scores."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from analysis.bootstrap.fits import fit_each
from analysis.choices import Interval
from analysis.classes.multiplicity import significant_pairs
from analysis.covariance.laplacian import contrast_variances, differences_of, pseudo_inverse, without_rounding
from analysis.covariance.shrinkage import Clustered, Spread, shrink
from analysis.scaling.counts import Counts
from analysis.scaling.deciding import verdicts
from analysis.scaling.jeffreys import Jeffreys
from analysis.scaling.laws import probabilities
from analysis.scaling.newton import maximise
from analysis.scaling.penalty import FIRTH
from analysis.scaling.profile import (
    MOST_ITEMS_PROFILED,
    exchange_p,
    exchangeable_wins,
    scaled,
    signed_roots,
)
from analysis.scaling.result import Method
from analysis.simulation.plan import Plan
from documents.arrays import Flags, Floats, Indices

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
    covariance, freedom
        Shape (B, n, n): of ``theta``, of the kind that the plan names; and (B, P + n), the degrees of freedom of pairs,
        then of log scores, None for the model's.
    spread
        Shape (B, P): how many times the model's the variances of differences are, as `analysis.scaling.profile` has it.
    separated
        Shape (B,): whether the plain likelihood has no maximum.
    """

    plan: Plan
    observers: int
    won: Floats
    theta: Floats
    covariance: Floats
    freedom: Floats | None
    spread: Floats
    separated: Flags

    def only(self, chosen: Flags) -> Studies:
        """Return some of the studies."""
        if chosen.all():
            return self
        won, theta, covariance = (part[chosen] for part in (self.won, self.theta, self.covariance))
        freedom = None if self.freedom is None else self.freedom[chosen]
        spread, separated = self.spread[chosen], self.separated[chosen]
        return Studies(self.plan, self.observers, won, theta, covariance, freedom, spread, separated)

    def significant(self, critical_z: float) -> Flags:
        """Return which pairs differ at the plan's level, shape (B, P); ``critical_z`` is `Plan.critical_z`'s."""
        freedom = None if self.freedom is None else self.freedom[:, : self.spread.shape[1]]
        wins = None if self.plan.adjust == "maxz" else self._wins
        exact = None if wins is None else exchange_p(wins, most=self.plan.alpha)

        def differ(t: Floats, rows: Indices) -> Flags:
            if self.plan.adjust == "maxz":
                return np.asarray(t >= critical_z)
            own, second = (None if part is None else part[rows] for part in (freedom, exact))
            return significant_pairs(t, own, self.plan.adjust, self.plan.alpha, second)

        if len(self.plan.items) > MOST_ITEMS_PROFILED:
            return differ(np.abs(self.statistics()), np.arange(len(self.spread)))
        return verdicts(self._counts, self.theta, self.spread, differ)

    def statistics(self, bounds: Floats | float = 0.0) -> Floats:
        """Return t of the hypotheses that differences are ``bounds`` (P,) in nats, shape (B, P), as in a report."""
        first, second = self.plan.pairs
        if len(self.plan.items) <= MOST_ITEMS_PROFILED:
            counts = self._counts
            top = maximise(counts, penalty=FIRTH, start=self.theta).theta
            return scaled(signed_roots(Jeffreys(counts), top, bounds), self.spread)
        error = np.sqrt(contrast_variances(self.covariance)[:, first, second])
        apart = self.theta[:, first] - self.theta[:, second] - bounds
        return np.divide(apart, error, out=np.zeros_like(apart), where=error > 0)

    @property
    def _counts(self) -> Counts:
        totals = np.broadcast_to(self.plan.totals(self.observers).astype(np.float64), self.spread.shape)
        won = self.won.sum(axis=1)
        return Counts(len(self.plan.items), *self.plan.pairs, won, totals - won, np.zeros_like(won))

    @property
    def exchanged(self) -> Floats:
        """Shape (B, P): exact p values of the exchange of two items, as in a report; 1 where there is none."""
        return np.ones_like(self.spread) if self._wins is None else exchange_p(self._wins)

    @property
    def _wins(self) -> Floats | None:
        """Shape (B, S, n): how often each item won with each observer; None as in `analysis.scaling.profile`."""
        n = len(self.plan.items)
        if self.freedom is None or n > MOST_ITEMS_PROFILED:
            return None
        return exchangeable_wins(n, *self.plan.pairs, self.won, self.plan.design(self.observers) - self.won)


def run(plan: Plan, observers: int, replicates: int, random: np.random.Generator) -> Studies:
    """Simulate ``replicates`` studies by ``observers`` each, and fit them."""
    return analyse(plan, observers, draw(plan, observers, replicates, random))


def analyse(plan: Plan, observers: int, won: Floats) -> Studies:
    """Fit studies of which ``won`` says how often the first item of each pair won, as `Studies` has it."""
    replicates = len(won)
    totals = matrices(np.broadcast_to(plan.totals(observers).astype(np.float64), (replicates, len(plan.differs))))
    wins = np.tril(totals.transpose(0, 2, 1), -1)
    first, second = plan.pairs
    summed = won.sum(axis=1)
    wins[:, first, second] = summed
    wins[:, second, first] -= summed
    fits = fit_each(wins, "ml")
    p = probabilities(fits.theta)
    covariance = pseudo_inverse(totals * p * p.transpose(0, 2, 1))
    freedom, model = None, contrast_variances(covariance)[:, first, second]
    kind, if_separated = plan.kind(observers), plan.kind(observers, separated=True)
    if kind != "model" and if_separated != "model":
        freedom = np.empty((replicates, len(first) + len(plan.items)))
        for chosen, clustered in ((~fits.separated, kind), (fits.separated, if_separated)):
            if chosen.any():
                each = _clustered(plan, won[chosen], p[chosen], covariance[chosen], clustered)
                of_scores = each.degrees_of_freedom(_score_slopes(fits.theta[chosen]))
                covariance[chosen] = each.covariance
                freedom[chosen] = np.hstack([each.degrees_of_freedom(), of_scores])
    own = contrast_variances(covariance)[:, first, second]
    spread = np.divide(own, model, out=np.zeros_like(own), where=model > 0)
    return Studies(plan, observers, won, fits.theta, covariance, freedom, spread, fits.separated)


def draw(plan: Plan, observers: int, replicates: int, random: np.random.Generator) -> Floats:
    """Return how often the first item of each pair won: shape (B, S, P), or (B, 1, P) of all observers together."""
    if not plan.by_observer:
        totals = plan.totals(observers)
        return random.binomial(totals, plan.chances(plan.theta), (replicates, 1, len(totals))).astype(np.float64)
    size = (replicates, observers, len(plan.differs))
    own = plan.typical
    if plan.observer_sd > 0:
        own = own + random.normal(0, plan.observer_sd, (replicates, observers, len(plan.theta)))
    chances = np.broadcast_to(plan.chances(own), size)
    if (plan.times == 1).all():
        return (random.random(size) < chances).astype(np.float64)
    return random.binomial(plan.design(observers), chances).astype(np.float64)


def matrices(values: Floats) -> Floats:
    """Spread values of pairs over symmetric matrices. Shapes (B, P) to (B, n, n)."""
    n = (1 + int(np.sqrt(1 + 8 * values.shape[-1]))) // 2
    first, second = np.triu_indices(n, 1)
    spread = np.zeros((len(values), n, n))
    spread[:, first, second] = spread[:, second, first] = values
    return spread


def _clustered(plan: Plan, won: Floats, p: Floats, inverse: Floats, kind: Clustered) -> Spread:
    """Return each study's covariance by what each observer moves the strengths by, as in a report."""
    first, second = plan.pairs
    people, n = won.shape[1], p.shape[1]
    times = plan.design(people)
    pull = won - times * p[:, first, second][:, None, :]
    incidence = differences_of(n, first, second)
    slope = pull @ incidence
    slope = without_rounding(slope - slope.mean(axis=1, keepdims=True), times.astype(np.float64) @ np.abs(incidence))
    pulled = slope @ inverse * np.sqrt(people / (people - 1))
    return shrink(inverse, pulled, kind, freedom=people - 1, at_least_model=kind == "scaled")


def widths(studies: Studies, random: np.random.Generator) -> Floats:
    """Return the width of each item's interval of log10 score in each study, shape (B, n)."""
    return _WAYS[studies.plan.interval](studies, random)


def _wald(studies: Studies, random: np.random.Generator) -> Floats:
    """By the delta method, as in `analysis.report.estimate`: no limit is above 0."""
    from scipy.special import log_softmax, ndtri, stdtrit

    tail, pairs = (1 + studies.plan.level) / 2, len(studies.plan.differs)
    quantile = ndtri(tail) if studies.freedom is None else stdtrit(studies.freedom[:, pairs:], tail)
    slopes = _score_slopes(studies.theta)
    variance = ((slopes @ studies.covariance) * slopes).sum(axis=2)
    reach = quantile * np.sqrt(np.maximum(variance, 0)) / np.log(10)
    log10_score = log_softmax(studies.theta, axis=1) / np.log(10)
    return np.asarray(reach + np.minimum(reach, -log10_score))


def _score_slopes(theta: Floats) -> Floats:
    """Return the gradient of each log score, the unit vector minus scores. Shapes (B, n) to (B, n, n)."""
    from scipy.special import softmax

    return np.asarray(np.eye(theta.shape[1]) - softmax(theta, axis=1)[:, None, :])


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
        counts[:, second, first] = plan.design(people) - won
        method: Method = "firth" if separated else "ml"
        seed = int(random.integers(2**31))
        samples = resample_counts(counts, plan.items, names, replicates=BOOTSTRAPS, seed=seed, method=method)
        ends = intervals(samples, "log10_score", level=plan.level)
        width[place] = ends.high - ends.low
    return width


_WAYS: dict[Interval, Callable[[Studies, np.random.Generator], Floats]] = {"wald": _wald, "bootstrap": _bootstrap}
