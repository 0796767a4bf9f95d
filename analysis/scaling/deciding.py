"""Which of many pairs differ, in many sets of counts: likelihood ratios are bounded, and profiled only near a verdict.

Firth's term is half the logarithm of Σ_T Π_{e in T} w_e over the spanning trees T of the compared pairs, w_e being a
pair's information. By Jensen's inequality ℓ* falls from its top by no more than the plain likelihood S of counts to
which half of each pair's leverage h_e is added on both sides, whose top is the same; and by no less than that but for

    g (√Q + √R s)², g = exp(range of c) / 4

at a distance s from strengths where the pairs' log w_e have changed by c_e: Q = Σ h_e (c_e − c̄)², and R is the largest
variance of a difference. For in a tree drawn by its weight, pairs have the chances h_e, and are the less likely the
more others are in it. S is self-concordant [Bach2010]: while no difference changes by more than u, it falls by at least
(exp(−u) + u − 1) / u² of the square of the distance, and by at most (exp(u) − u − 1) / u² of it.

Bounds at the start of a profile, one step of Newton's from the top, so hold the statistic of nearly every pair on one
side of what decides. Which pairs are left is found by testing twice, once by the lower and once by the upper bounds: no
verdict changes that is the same of both, since tests reject no fewer pairs as the statistics grow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from analysis.covariance.laplacian import contrast_variances, differences_of
from analysis.covariance.shrinkage import pseudo_inverses
from analysis.scaling.counts import Counts
from analysis.scaling.jeffreys import Jeffreys
from analysis.scaling.laws import probabilities
from analysis.scaling.profile import COARSE_STEP, climbed, parts, scaled, signed_roots
from documents import count_work
from documents.arrays import Flags, Floats, Indices

Verdicts = Callable[[Floats, Indices], Flags]

IN_CACHE = 100_000  # numbers of an array that stays in a processor's cache beside some others
NEAR = (0.05, 0.1, 0.2, 0.3, 0.45, 0.7)  # nats
LEAST = 1e-6
BEYOND = 1.1  # how many times the difference two other strengths may change by


def verdicts(counts: Counts, start: Floats, spread: Floats, differ: Verdicts) -> Flags:
    """Return which of every two items ``differ`` in B sets of counts by |t(0)|, shape (B, P).

    Parameters
    ----------
    counts
        Without ties or order, the items linked by comparisons.
    start
        Shape (B, n): strengths near those of largest penalised likelihood.
    spread
        Shape (B, P): κ.
    differ
        Says by |t| (K, P) of K of the sets (K,) which pairs differ, of no fewer where |t| are larger.
    """
    bounds = _Bounds.of(counts, climbed(Jeffreys(counts), start)[1])
    low, high = (scaled(root, spread) for root in bounds.wide())
    every = np.arange(len(low))
    sure, possible = differ(low, every), differ(high, every)

    def narrow(left: Flags, ends: Callable[[Flags], tuple[Floats, Floats]]) -> None:
        near, far = ends(left)
        low[left], high[left] = np.maximum(low[left], scaled(near, spread[left])), scaled(far, spread[left])
        rows = np.flatnonzero(left.any(axis=1))
        sure[rows], possible[rows] = differ(low[rows], rows), differ(high[rows], rows)

    for ends in (bounds.near, bounds.close):
        if (left := possible & ~sure).any():
            narrow(left, ends)
    while (left := possible & ~sure).any():
        inexact = low < high
        if not (left & inexact).any():  # their verdicts hang on those of the pairs beside them
            left = np.broadcast_to(left.any(axis=1, keepdims=True), left.shape)
        narrow(left & inexact, bounds.exact)
    return sure


@dataclass(frozen=True, slots=True, eq=False)
class _Bounds:
    """What the bounds are computed from, of B sets of counts of n items.

    Attributes
    ----------
    counts, top
        The counts, and the strengths (B, n) where the penalised likelihood is largest.
    chances, totals, leverage
        Shape (B, n, n): at the top, p of each item against each, answers by the counts of S, and h.
    inverse, variance
        Shape (B, n, n): the inverse information of S at the top, and its variances of differences.
    widest
        Shape (B,): the largest of these, and of those by the counts themselves.
    """

    counts: Counts
    top: Floats
    chances: Floats
    totals: Floats
    leverage: Floats
    inverse: Floats
    variance: Floats
    widest: Floats

    @classmethod
    def of(cls, counts: Counts, top: Floats) -> _Bounds:
        chances = probabilities(top)
        varied = chances * chances.transpose(0, 2, 1)
        totals = counts.matrix(counts.total)
        apart = contrast_variances(_inverses(totals * varied))
        leverage = totals * varied * apart
        totals = totals + leverage
        inverse = _inverses(totals * varied)
        variance = contrast_variances(inverse)
        widest = np.maximum(variance.max(axis=(1, 2)), apart.max(axis=(1, 2)))
        return cls(counts, top, chances, totals, leverage, inverse, variance, widest)

    def wide(self) -> tuple[Floats, Floats]:
        """Return bounds of |r(0)| of every two items, shapes (B, P), by their difference and its variance."""
        first, second = np.triu_indices(self.counts.n, 1)
        apart, variance = self.top[:, first] - self.top[:, second], self.variance[:, first, second]
        size = np.minimum(np.abs(apart), 50.0)
        far = BEYOND * size
        fall = _fall(-far) - np.exp(2 * far) / 4 * self.widest[:, None]
        return _root(apart**2 / variance * fall), _root(apart**2 / variance * _fall(size))

    def near(self, chosen: Flags) -> tuple[Floats, Floats]:
        """Return bounds of |r(0)| of the K pairs ``chosen`` (B, P), shapes (K,), one step of Newton's from the top.

        Of the likelihood's terms only those with one of the two items are computed: others change less.
        """
        return self._started(chosen, 2 * self.counts.n, every=False)

    def close(self, chosen: Flags) -> tuple[Floats, Floats]:
        """As `near`, by all terms."""
        return self._started(chosen, self.counts.n * (self.counts.n - 1) // 2, every=True)

    def _started(self, chosen: Flags, terms: int, *, every: bool) -> tuple[Floats, Floats]:
        row, pair = np.nonzero(chosen)
        count_work("profiles_bounded", len(row))
        low, high = np.empty(len(row)), np.empty(len(row))
        for own in parts(len(row), terms, most=IN_CACHE):
            low[own], high[own] = self._begun(row[own], pair[own], every=every)
        return low, high

    def _begun(self, row: Indices, pair: Indices, *, every: bool) -> tuple[Floats, Floats]:
        n, each, widest = self.counts.n, np.arange(len(row)), self.widest[row]
        one, two = np.triu_indices(n, 1)
        first, second = one[pair], two[pair]
        toward = (self.top[row, first] - self.top[row, second]) / self.variance[row, first, second]
        moved = toward[:, None] * (self.inverse[row, second] - self.inverse[row, first])
        length = toward**2 * self.variance[row, first, second]
        if every:
            change = moved[:, one] - moved[:, two]
        else:
            one, two = np.repeat(np.stack([first, second], axis=1), n, axis=1), np.tile(np.arange(n), 2)
            change = np.take_along_axis(moved, one, axis=1) - moved[:, two]
        cells = row[:, None], one * n + two
        totals, leverage, p = (part.reshape(-1, n * n)[cells] for part in (self.totals, self.leverage, self.chances))
        if not every:
            totals[each, n + first] = leverage[each, n + first] = 0  # the pair itself, a second time
        odds = np.exp(change)
        ratio = 1 + p * (odds - 1)
        logs = np.log(ratio)
        bent = change - 2 * logs
        fallen = (totals * (logs - p * change)).sum(axis=1)
        flow, scatter = p * (odds / ratio - 1), (leverage * bent**2).sum(axis=1)
        if every:
            far, rest = np.zeros(len(row)), np.zeros(len(row))
            slope = (totals * flow) @ differences_of(n, one, two)
            step = (self.inverse[row] @ slope[:, :, None])[:, :, 0]
            across = (step[each, first] - step[each, second]) ** 2 / self.variance[row, first, second]
            steep = np.maximum((slope * step).sum(axis=1) - across, 0)
            scatter = np.maximum(scatter - (leverage * bent).sum(axis=1) ** 2 / (n - 1), 0)
        else:
            far = _range_of_others(moved, first, second)
            rest = np.maximum(length - (totals * p * (1 - p) * change**2).sum(axis=1), 0)
            with np.errstate(divide="ignore", invalid="ignore"):
                strain = totals * (flow - p * (1 - p) * change) ** 2 / (p * (1 - p))
            strain[each, second] = 0
            steep = strain.sum(axis=1) + rest * (far * _fall(far)) ** 2
            scatter = scatter + widest * rest
        least, most = np.minimum(bent.min(axis=1), -far), np.maximum(bent.max(axis=1), far)
        gained = _gained(steep, scatter, least, most - least, widest)
        return _root(fallen + rest * _fall(-far) - gained), _root(fallen + rest * _fall(far))

    def exact(self, chosen: Flags) -> tuple[Floats, Floats]:
        """Return |r(0)| of the K pairs ``chosen`` (B, P) by their profiles, shape (K,), twice."""
        count_work("profiles_climbed", int(chosen.sum()))
        some = np.asarray(chosen.any(axis=1))
        counts, own = self.counts.select(some), chosen[some]
        roots = np.abs(signed_roots(Jeffreys(counts), self.top[some], chosen=own, small=COARSE_STEP)[own])
        return roots, roots


def _gained(steep: Floats, scatter: Floats, least: Floats, span: Floats, widest: Floats) -> Floats:
    """Return by how much more than at its start the likelihood may be at the end of a profile, shape (K,).

    ``steep`` is at least the square of the slope of S at the start, by the inverse information at the top, of which the
    information there is exp(``least``) at least; ``scatter`` is Q and ``widest`` R; changes c have the range ``span``.
    """
    gained = np.full(len(steep), np.inf)
    for near in NEAR:  # the end is looked for no farther than so many nats from the start
        jensen = np.exp(span + 2 * near) / 4
        bend = np.exp(least) * _fall(-near) - jensen * widest
        pull = np.sqrt(steep) + 2 * jensen * np.sqrt(scatter * widest)
        sure = pull * np.sqrt(widest) < 2 * bend * near
        gain = jensen * scatter + pull**2 / np.where(sure, 4 * bend, 1.0)
        gained = np.where(sure, np.minimum(gained, gain), gained)
    return gained


def _fall(change: Floats | float) -> Floats:
    """Return (exp x − 1 − x) / x²."""
    x = np.where(np.abs(change) < LEAST, LEAST, change)
    return np.asarray((np.expm1(x) - x) / x**2)


def _range_of_others(values: Floats, first: Indices, second: Indices) -> Floats:
    """Return the range of K rows of values without those of two items, shape (K,); 0 if there are no others."""
    each, high, low = np.arange(len(values)), values.copy(), values.copy()
    high[each, first] = high[each, second] = -np.inf
    low[each, first] = low[each, second] = np.inf
    return np.asarray(np.maximum(high.max(axis=1) - low.min(axis=1), 0))


def _root(fallen: Floats) -> Floats:
    """Return |r| where the likelihood is lower by so much."""
    return np.asarray(np.sqrt(np.maximum(2 * fallen, 0)))


def _inverses(weights: Floats) -> Floats:
    """Return the pseudo-inverses of the information of pairs, shape (B, n, n)."""
    n = weights.shape[-1]
    information = np.negative(weights, order="C")
    information.reshape(-1, n * n)[:, :: n + 1] = weights.sum(axis=2)
    return pseudo_inverses(information)
