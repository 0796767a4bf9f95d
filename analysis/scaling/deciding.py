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
from numpy.typing import NDArray

from analysis.scaling.counts import Counts
from analysis.scaling.laplacian import contrast_variances
from analysis.scaling.profile import COARSE_STEP, parts, scaled, signed_roots
from analysis.scaling.shrinkage import pseudo_inverses
from documents import count_work

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
Verdicts = Callable[[Floats], Flags]

IN_CACHE = 100_000  # numbers of an array that stays in a processor's cache beside some others
NEAR = (0.05, 0.1, 0.2, 0.4, 0.8)  # nats
BEYOND = 1.1  # how many times the difference two other strengths may change by


def verdicts(counts: Counts, top: Floats, spread: Floats, differ: Verdicts) -> Flags:
    """Return which of every two items ``differ`` in B sets of counts by |t(0)|, shape (B, P).

    Parameters
    ----------
    counts, top
        As `analysis.scaling.profile.signed_roots` has them.
    spread
        Shape (B, P): κ.
    differ
        Says by |t| (B, P) which pairs differ, of each set by itself, and of no fewer where |t| are larger.
    """
    bounds = _Bounds.of(counts, top)
    low, high = (scaled(root, spread) for root in bounds.wide())
    sure, possible = differ(low), differ(high)

    def narrow(left: Flags, ends: Callable[[Flags], tuple[Floats, Floats]]) -> None:
        ends_of = (scaled(root, spread[left]) for root in ends(left))
        low[left], high[left] = np.maximum(low[left], next(ends_of)), next(ends_of)
        sure[:], possible[:] = differ(low), differ(high)

    narrow(possible & ~sure, bounds.close)
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
    leverage
        Shape (B, n, n): h at the top.
    wins, totals
        Shapes (B, n) and (B, n, n): wins of each item and answers of each two, by the counts of S.
    inverse, variance
        Shape (B, n, n): the inverse information of S at the top, and its variances of differences.
    widest
        Shape (B,): the largest of these, and of those by the counts themselves.
    logs, value
        Shape (B, n, n): log(exp θ_i + exp θ_j) at the top; (B,), S there.
    """

    counts: Counts
    top: Floats
    leverage: Floats
    wins: Floats
    totals: Floats
    inverse: Floats
    variance: Floats
    widest: Floats
    logs: Floats
    value: Floats

    @classmethod
    def of(cls, counts: Counts, top: Floats) -> _Bounds:
        wins = counts.wins()
        totals, logs = wins + wins.transpose(0, 2, 1), _logs(top)
        chances = np.exp(_sums(top) - 2 * logs)
        apart = contrast_variances(_inverses(totals * chances))
        leverage = totals * chances * apart
        totals = totals + leverage
        inverse = _inverses(totals * chances)
        variance = contrast_variances(inverse)
        won = wins.sum(axis=2) + leverage.sum(axis=2) / 2
        widest = np.maximum(variance.max(axis=(1, 2)), apart.max(axis=(1, 2)))
        value = _likelihood(won, totals, top, logs)
        return cls(counts, top, leverage, won, totals, inverse, variance, widest, logs, value)

    def wide(self) -> tuple[Floats, Floats]:
        """Return bounds of |r(0)| of every two items, shapes (B, P), by their difference and its variance."""
        first, second = np.triu_indices(self.counts.n, 1)
        apart, variance = self.top[:, first] - self.top[:, second], self.variance[:, first, second]
        size = np.clip(np.abs(apart), 1e-3, 50.0)
        far = BEYOND * size
        rise = (np.expm1(size) - size) / size**2
        fall = (np.expm1(-far) + far) / far**2 - np.exp(2 * far) / 4 * self.widest[:, None]
        return _root(apart**2 / variance * fall), _root(apart**2 / variance * rise)

    def close(self, chosen: Flags) -> tuple[Floats, Floats]:
        """Return bounds of |r(0)| of the K pairs ``chosen`` (B, P), shapes (K,), one step of Newton's from the top."""
        row, pair = np.nonzero(chosen)
        first, second = (items[pair] for items in np.triu_indices(self.counts.n, 1))
        count_work("profiles_bounded", len(row))
        low, high = np.empty(len(row)), np.empty(len(row))
        for own in parts(len(row), self.counts.n**2, most=IN_CACHE):
            low[own], high[own] = self._close(row[own], first[own], second[own])
        return low, high

    def _close(self, row: Indices, first: Indices, second: Indices) -> tuple[Floats, Floats]:
        each, top, inverse, totals = np.arange(len(row)), self.top[row], self.inverse[row], self.totals[row]
        variance, widest = self.variance[row, first, second], self.widest[row]
        apart = (top[each, first] - top[each, second]) / variance
        moved = apart[:, None] * (inverse[each, second] - inverse[each, first])
        theta = top + moved
        logs = _logs(theta)
        fallen = self.value[row] - _likelihood(self.wins[row], totals, theta, logs)
        change = _sums(moved) - 2 * (logs - self.logs[row])
        weighted = self.leverage[row] * change
        scatter = (weighted * change).sum(axis=(1, 2)) / 2 - (weighted.sum(axis=(1, 2)) / 2) ** 2 / (self.counts.n - 1)
        slope = self.wins[row] - (totals * np.exp(theta[:, :, None] - logs)).sum(axis=2)
        step = (inverse @ slope[:, :, None])[:, :, 0]
        steep = (slope * step).sum(axis=1) - (step[each, first] - step[each, second]) ** 2 / variance
        least = change.min(axis=(1, 2))
        span, steep, scatter = change.max(axis=(1, 2)) - least, np.maximum(steep, 0), np.maximum(scatter, 0)
        gained = np.full(len(row), np.inf)
        for near in NEAR:  # the end of the profile is looked for no farther than so many nats from its start
            jensen = np.exp(span + 2 * near) / 4
            bend = np.exp(least) * (np.exp(-near) + near - 1) / near**2 - jensen * widest
            pull = np.sqrt(steep) + 2 * jensen * np.sqrt(scatter * widest)
            sure = pull * np.sqrt(widest) < 2 * bend * near
            gain = jensen * scatter + pull**2 / np.where(sure, 4 * bend, 1.0)
            gained = np.where(sure, np.minimum(gained, gain), gained)
        return _root(fallen - gained), _root(fallen)

    def exact(self, chosen: Flags) -> tuple[Floats, Floats]:
        """Return |r(0)| of the K pairs ``chosen`` (B, P) by their profiles, shape (K,), twice."""
        count_work("profiles_climbed", int(chosen.sum()))
        some = np.asarray(chosen.any(axis=1))
        counts, own = self.counts.select(some), chosen[some]
        roots = np.abs(signed_roots(counts, self.top[some], chosen=own, small=COARSE_STEP)[own])
        return roots, roots


def _root(fallen: Floats) -> Floats:
    """Return |r| where the likelihood is lower by so much."""
    return np.asarray(np.sqrt(np.maximum(2 * fallen, 0)))


def _sums(values: Floats) -> Floats:
    return np.asarray(values[:, :, None] + values[:, None, :])


def _logs(theta: Floats) -> Floats:
    return np.log(_sums(np.exp(theta)))


def _likelihood(won: Floats, totals: Floats, theta: Floats, logs: Floats) -> Floats:
    return np.asarray((won * theta).sum(axis=1) - np.einsum("kij,kij->k", totals, logs) / 2)


def _inverses(weights: Floats) -> Floats:
    """Return the pseudo-inverses of the information of pairs, shape (B, n, n)."""
    n = weights.shape[-1]
    information = np.negative(weights, order="C")
    information.reshape(-1, n * n)[:, :: n + 1] = weights.sum(axis=2)
    return pseudo_inverses(information)
