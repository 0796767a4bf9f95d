"""pwcmp's priors on the distance of two items [PerezOrtiz2017]: what is added to the likelihood of Thurstone's Case V.

pwcmp maximises, over both orders of every compared pair, Σ log p + Σ log(prior + 0.1); here each pair stands once, so
both sums are halved. p = Φ(d / 1.4826), d in JOD. Its priors, each a function of all distances:

- ``gaussian``, that of its present version: for a pair at distance d, Σ_l (L_l(d) + ε) / (Σ_k L_l(d_k) + ε), L_l being
  the likelihood of the answers to pair l and the sums over both orders. Unanimous answers count as one answer less.
  ε = 1e-8 makes the prior flat where pairs have about thirty answers or more.
- ``bounded``, that of 2017, with which its example results were computed: for a unanimous pair of n answers, with the
  range r of all scores and e = r + 1, max(0, 1/e − n/e²) in one order and 1/e in the other; 1 for other pairs.

Neither is concave: a fit ends where the objective cannot grow, which need not be the only such place. With
``gaussian`` there is none where an item always wins and few pairs say how far items are apart: the prior of a pair far
apart tends to a limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from analysis.choices import DistancePrior
from analysis.scaling import Counts, NoPenalty, Probit, Slopes
from documents.arrays import Floats

DISTANCE_PRIORS: tuple[DistancePrior, ...] = get_args(DistancePrior)
JOD_PER_SD = 1.4826  # pwcmp's figure for 1 / Φ⁻¹(3/4)
FLOOR, EPSILON = 0.1, 1e-8


@dataclass(frozen=True, slots=True)
class _FollowedDown(NoPenalty):
    """Steps shrink by a constant factor, since the prior's curvature is left out of them."""

    most_iterations: int = 300
    has_constant_curvature: bool = False

    def slack(self, size: Floats) -> Floats:
        """Return more than rounding of the likelihood."""
        return 1e-13 * (1 + size)

    def has_settled(self, size: Floats, last_size: Floats) -> NDArray[np.bool_]:
        """Follow the steps down to rounding."""
        return np.asarray((size <= 1e-11) | ((size <= 1e-8) & (size >= last_size)))


@dataclass(frozen=True, slots=True)
class GaussianDistances(_FollowedDown):
    """The normalised sum of the likelihoods of all pairs' answers."""

    def value(self, counts: Counts, theta: Floats, slopes: Callable[[], Slopes]) -> Floats:
        """Return Σ log(prior + 0.1) over the pairs."""
        prior = _Likelihoods.at(counts, counts.differences(theta)).prior()
        return np.asarray(np.log(np.where(counts.total > 0, prior, 1.0) + FLOOR).sum(axis=1))

    def slopes(self, counts: Counts, d: Floats, slopes: Slopes) -> Slopes:
        """Return the slopes with the prior's; of its curvature, what each pair's own is worth where that is above 0."""
        own, bend = _Likelihoods.at(counts, d).slopes(d)
        return Slopes(slopes.d + own, slopes.dd + np.maximum(bend, 0))


@dataclass(frozen=True, slots=True, eq=False)
class _Likelihoods:
    """L of m pairs' distances by the answers of K kinds of pairs, in both orders, for B replicates.

    ``there`` and ``back`` have shape (B, m, K): Φ(d)^a Φ(−d)^b and the same of −d, 0 where a pair was not ``compared``
    (B, m, 1); ``a``, ``b`` and ``weight`` (B, 1, K) are the answers of a kind, and how many pairs have them.
    """

    compared: NDArray[np.bool_]
    a: Floats
    b: Floats
    weight: Floats
    there: Floats
    back: Floats

    @classmethod
    def at(cls, counts: Counts, d: Floats) -> _Likelihoods:
        from scipy.special import log_ndtr

        compared = (counts.total > 0)[:, :, None]
        a, b, weight = _kinds(counts)
        ahead, behind = log_ndtr(d)[:, :, None], log_ndtr(-d)[:, :, None]
        there, back = np.exp(a * ahead + b * behind), np.exp(a * behind + b * ahead)
        return cls(compared, a, b, weight, there * compared, back * compared)

    def prior(self) -> Floats:
        both = self.there + self.back
        scale = self.weight / (both.sum(axis=1, keepdims=True) + EPSILON)
        return np.asarray(((both + 2 * EPSILON) * scale).sum(axis=2))

    def slopes(self, d: Floats) -> tuple[Floats, Floats]:
        """Return the slope of Σ log(prior + 0.1) by each distance, and its curvature with the sign changed."""
        both = self.there + self.back
        total = both.sum(axis=1, keepdims=True) + EPSILON
        scale = self.weight / total
        pull = self.compared / (((both + 2 * EPSILON) * scale).sum(axis=2, keepdims=True) + FLOOR)
        ahead, behind = Probit.hazard(d)[:, :, None], Probit.hazard(-d)[:, :, None]
        there, back = self.a * ahead - self.b * behind, self.b * ahead - self.a * behind
        rise = self.there * there + self.back * back
        shared = (pull * (both + 2 * EPSILON)).sum(axis=1, keepdims=True) / total
        own = (scale * (pull - shared) * rise).sum(axis=2)
        reach = d[:, :, None]
        bent = ahead * (ahead + reach), behind * (behind - reach)
        curve = self.there * (there * there - self.a * bent[0] - self.b * bent[1])
        curve += self.back * (back * back - self.b * bent[0] - self.a * bent[1])
        bend = (scale * (pull - shared) * curve).sum(axis=2) - ((scale * rise).sum(axis=2) * pull[:, :, 0]) ** 2
        return np.asarray(own), np.asarray(-bend)


def _kinds(counts: Counts) -> tuple[Floats, Floats, Floats]:
    """Return the answers of the kinds of pairs of each replicate and how many pairs have them, each (B, 1, K)."""
    a, b = np.maximum(counts.won, counts.lost), np.minimum(counts.won, counts.lost)
    compared, unanimous = a > 0, (b == 0) & (a > 0)
    a, b = np.where(unanimous, a - 1, a), np.where(unanimous, 1, b)
    kind = np.where(compared, a * (b.max(initial=0.0) + 1) + b, -1.0)
    order = np.argsort(kind, axis=1)
    a, b, kind = (np.take_along_axis(part, order, axis=1) for part in (a, b, kind))
    place = np.cumsum(np.diff(kind, axis=1, prepend=-1.0) > 0, axis=1)  # from 1; 0 where nothing was compared
    batch, most = len(kind), int(place.max(initial=0))
    weight, own_a, own_b = np.zeros((3, batch, most + 1))
    row = np.broadcast_to(np.arange(batch)[:, None], place.shape)
    np.add.at(weight, (row, place), 1.0)
    own_a[row, place], own_b[row, place] = a, b
    return own_a[:, None, 1:], own_b[:, None, 1:], weight[:, None, 1:]


@dataclass(frozen=True, slots=True)
class Bounded(_FollowedDown):
    """The prior of 2017 on the range of the scores, for counts that list all pairs of items.

    It has kinks, where the maximum may lie: steps then no longer shrink, and the fit ends without having converged.
    """

    most_iterations: int = 200

    def value(self, counts: Counts, theta: Floats, slopes: Callable[[], Slopes]) -> Floats:
        """Return Σ log(prior + 0.1) over the pairs, half of it from each order."""
        answers, e = _unanimous(counts), 1 + np.ptp(theta, axis=1, keepdims=True) * JOD_PER_SD
        logs = np.log(np.maximum(1 / e - answers / e**2, 0) + FLOOR) + np.log(1 / e + FLOOR)
        return np.asarray(np.where(answers > 0, logs, 2 * np.log(1 + FLOOR)).sum(axis=1) / 2)

    def slopes(self, counts: Counts, d: Floats, slopes: Slopes) -> Slopes:
        """Return the slopes with the prior's, which pulls on the two items at the ends of the scale."""
        answers, rows, place = _unanimous(counts), np.arange(len(d)), np.abs(d).argmax(axis=1)
        e = 1 + np.abs(d[rows, place])[:, None] * JOD_PER_SD
        first, second = 1 / e - answers / e**2, 1 / e
        pull = np.where(first > 0, (2 * answers / e**3 - 1 / e**2) / (first + FLOOR), 0) - 1 / e**2 / (second + FLOOR)
        own = np.zeros_like(d)
        own[rows, place] = np.where(answers > 0, pull, 0).sum(axis=1) * (JOD_PER_SD / 2) * np.sign(d[rows, place])
        return Slopes(slopes.d + own, slopes.dd)


def _unanimous(counts: Counts) -> Floats:
    """Return the number of answers to each unanimous pair, 0 for others; shape (B, m)."""
    return np.where((counts.won == 0) | (counts.lost == 0), counts.won + counts.lost, 0.0)


def all_pairs(wins: Floats) -> Counts:
    """List all pairs of items, also those that were never compared, with their counts; ``wins`` has shape (B, n, n)."""
    first, second = np.triu_indices(wins.shape[1], 1)
    won, lost = wins[:, first, second], wins[:, second, first]
    return Counts(wins.shape[1], first, second, won, lost, np.zeros_like(won))


PRIORS: dict[DistancePrior, NoPenalty] = {"gaussian": GaussianDistances(), "bounded": Bounded(), "none": NoPenalty()}
