"""Studies whose truth is known: how often intervals contain it, and how often tests report a false difference.

Observers are alike, or each has strengths of their own, normal about the common ones. The truth that intervals are to
contain is then what the fit would give with endless observers: the strengths fitted to the mean probabilities, which
lie closer together than the common strengths.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap.confidence_intervals import Kind, intervals
from analysis.bootstrap.influence import influences, sandwich
from analysis.bootstrap.replicates import Name, Quantity, Replicates, resample_counts
from analysis.classes.multiplicity import Adjust, corrected, single_step, two_sided_p
from analysis.scaling.fitting import fit
from analysis.scaling.laplacian import contrast_variances
from analysis.scaling.result import Fit, Method

Floats = NDArray[np.float64]
MAXZ_SAMPLES = 10_000


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """``observers`` answer every pair once; each one's strengths are ``theta`` (n,) plus N(0, ``observer_sd``) nats."""

    theta: Floats
    observers: int
    observer_sd: float = 0.0

    def truth(self) -> Floats:
        """Return what endless observers would give, shape (n,), in nats, with mean 0."""
        from scipy.special import expit

        difference = self.theta[:, None] - self.theta[None, :]
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        reach = np.sqrt(2) * self.observer_sd * nodes
        mean = (expit(difference[:, :, None] + reach) * weights).sum(axis=2) / weights.sum()
        np.fill_diagonal(mean, 0)
        return fit(mean).theta

    def studies(self, count: int, seed: int) -> Iterator[Floats]:
        """Yield the counts of each observer, shape (observers, n, n), of ``count`` simulated studies."""
        random = np.random.default_rng(seed)
        n = len(self.theta)
        for _ in range(count):
            own = self.theta + random.normal(0, self.observer_sd, (self.observers, n))
            ahead = random.random((self.observers, n, n)) < 1 / (1 + np.exp(own[:, None, :] - own[:, :, None]))
            upper = np.triu(ahead, 1)
            yield (upper | np.tril(~upper.transpose(0, 2, 1), -1)).astype(np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """How one kind of interval did: shares of all intervals (0 to 1), and their mean width.

    ``covered`` contained the truth; ``worst`` is the least of that among the k values; ``too_high`` and ``too_low`` lay
    wholly above or below it. ``standard_error`` is that of ``covered``, between studies. ``width`` is a median.
    """

    quantity: Name
    kind: Kind
    covered: float
    standard_error: float
    worst: float
    too_high: float
    too_low: float
    width: float


def coverage(
    design: Design,
    kinds: Sequence[Kind],
    quantities: Sequence[Name],
    *,
    studies: int,
    replicates: int = 1000,
    level: float = 0.95,
    seed: int = 2016,
) -> list[Coverage]:
    """Simulate studies and count how often each kind of interval of each quantity contains the truth.

    A study that is separated is fitted by Firth's, as the report does.
    """
    truth = design.truth()
    ends_by_kind: dict[tuple[Name, Kind], list[Floats]] = {}
    for number, by_observer in enumerate(design.studies(studies, seed)):
        drawn = _drawn(by_observer, replicates, seed + number)
        for quantity in quantities:
            value = Quantity.of_items(quantity, len(truth)).values(truth)
            for kind in kinds:
                interval = intervals(drawn, quantity, kind=kind, level=level)
                ends = np.stack([interval.low > value, interval.high < value, interval.high - interval.low])
                ends_by_kind.setdefault((quantity, kind), []).append(ends)
    return [_summary(quantity, kind, np.array(ends)) for (quantity, kind), ends in ends_by_kind.items()]


def family_error(
    design: Design, adjustments: Sequence[tuple[Adjust, str]], *, studies: int, alpha: float = 0.05, seed: int = 2016
) -> dict[tuple[Adjust, str], float]:
    """Return the share of studies with any significant pair, for each adjustment and covariance.

    With strengths that are all equal, that is the family-wise error. The covariance is ``model``, ``sandwich`` (tested
    by the t distribution, observers − 1 degrees of freedom), ``sandwich, normal law``, or ``bootstrap`` (that of 1000
    replicates, Student's law).
    """
    hits = dict.fromkeys(adjustments, 0)
    first, second = np.triu_indices(len(design.theta), 1)
    for number, by_observer in enumerate(design.studies(studies, seed)):
        fitted = _fitted(by_observer)
        for adjust, source in adjustments:
            covariance = _covariance(by_observer, fitted, source, seed + number)
            error = np.sqrt(contrast_variances(covariance)[first, second])
            z = np.abs(fitted.theta[first] - fitted.theta[second]) / error
            df = design.observers - 1 if source in ("sandwich", "bootstrap") else None
            hits[adjust, source] += _least_p(z, covariance, adjust, df) <= alpha
    return {case: times / studies for case, times in hits.items()}


def _least_p(absolute_z: Floats, covariance: Floats, adjust: Adjust, df: float | None) -> float:
    """Return the smallest p value, as `analysis.classes.multiplicity.adjusted_p` has it; with fewer draws for
    ``maxz``."""
    if adjust == "maxz":
        return float(single_step(absolute_z.max(keepdims=True), covariance, df, MAXZ_SAMPLES)[0])
    return float(corrected(two_sided_p(absolute_z, df), adjust).min())


def _covariance(by_observer: Floats, fitted: Fit, source: str, seed: int) -> Floats:
    if source == "model":
        return fitted.covariance
    if source == "bootstrap":
        drawn = _drawn(by_observer, 1000, seed)
        return np.asarray(np.cov(drawn.theta[~drawn.without_fit].T))
    ones = np.ones((1, len(by_observer)))
    return np.asarray(sandwich(influences(by_observer, ones, fitted.theta[None]), ones)[0])


def _drawn(by_observer: Floats, replicates: int, seed: int) -> Replicates:
    people, n, _ = by_observer.shape
    items, observers = [f"item {item}" for item in range(n)], [f"{number:04d}" for number in range(people)]
    method: Method = "firth" if fit(by_observer.sum(axis=0)).separated else "ml"
    return resample_counts(by_observer, items, observers, replicates=replicates, seed=seed, method=method)


def _fitted(by_observer: Floats) -> Fit:
    wins = by_observer.sum(axis=0)
    plain = fit(wins)
    return fit(wins, method="firth") if plain.separated else plain


def _summary(quantity: Name, kind: Kind, ends: Floats) -> Coverage:
    above, below, width = ends[:, 0], ends[:, 1], ends[:, 2]
    covered = 1 - above - below
    return Coverage(
        quantity=quantity,
        kind=kind,
        covered=float(covered.mean()),
        standard_error=float(covered.mean(axis=1).std(ddof=1) / np.sqrt(len(covered))),
        worst=float(covered.mean(axis=0).min()),
        too_high=float(above.mean()),
        too_low=float(below.mean()),
        width=float(np.median(width)),
    )
