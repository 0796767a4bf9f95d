"""Tests and intervals of the difference of two strengths that hold at the edge: profiles of the penalised likelihood.

The evidence of a Wald test *falls* where one item is nearly always preferred, since its standard error grows faster
than the estimate [Hauck1977]. That of a likelihood ratio does not. With ℓ* the likelihood that Firth's term makes
finite everywhere [Firth1993], and the maximum of ℓ* where θ_i − θ_j = δ,

    r(δ) = ± √(2 (max ℓ* − max ℓ* at δ)),  t(δ) = r(δ) / √κ

where κ is how many times as large as the model's the variance of θ_i − θ_j is by observers [Rotnitzky1990]. t has
Student's law with the degrees of freedom of that variance. Inverted, it gives profile intervals [Heinze2002],
[Venzon1988].

Where all observers answered every pair as often, a second test is exact if two items are alike: exchanging their names
in all answers of one observer then changes no chance, so that each observer's difference of wins has either sign with
the same chance. The smaller p is taken; `benchmarks/interval_coverage.py` shows that both together keep the level.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.counts import Answers, Counts
from analysis.scaling.laplacian import contrast_variances
from analysis.scaling.laws import LOGISTIC, Model
from analysis.scaling.newton import maximise
from analysis.scaling.penalty import FIRTH
from analysis.scaling.separation import strong_groups

if TYPE_CHECKING:
    from analysis.scaling.result import Fit

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]

MOST_ITEMS_PROFILED = 40
MOST_OBSERVERS_EXCHANGED = 100
MOST_NUMBERS = 2_000_000
MOST_STEPS = 100
SMALL_STEP = 1e-6  # the likelihood is then exact to about its square
COARSE_STEP = 0.02  # nats; what is left is far less, and the likelihood exact to about its square
LONG_STEP = 0.5  # nats; only after longer ones is the likelihood compared
SMALL_ROOT = 1e-8  # from the end of an interval, in standard deviations
LEAST_WITHIN_ONE_SD = 0.1
RIDGE = 1e-14
FARTHEST = 30.0  # nats beyond which an interval has no end: a chance of 1 less 1e-13


@dataclass(frozen=True, eq=False)
class Profiles:
    """Profiles of the likelihood along K contrasts of n strengths, such as the differences of every two items.

    Attributes
    ----------
    counts
        One set of counts of Bradley and Terry's law.
    start
        Shape (n,): strengths near those of largest penalised likelihood.
    contrasts
        Shape (K, n): what of the strengths each is; its value is ``contrasts @ theta``, in nats.
    spread
        Shape (K,): κ, how many times the model's variance the one by observers is; 1 for the model's.
    freedom
        Shape (K,): degrees of freedom; None for the model's variance.
    basis
        Shape (n, p): what the strengths are free to do, columns that are orthonormal and sum to 0; None if each item
        has a strength of its own.
    unbounded
        Shape (K,): 1 where no answers bound the value from above, such as that of an item that never lost; -1 where
        none bound it from below; else 0.
    wins
        Of differences of every two items, shape (S, n): how often each item won with each observer, where all answered
        every pair as often; else None.
    """

    counts: Counts
    start: Floats
    contrasts: Floats
    spread: Floats
    freedom: Floats | None
    basis: Floats | None = None
    unbounded: Floats | float = 0.0
    wins: Floats | None = None

    @cached_property
    def _restricted(self) -> _Restricted:
        if self.basis is None:
            top = maximise(self.counts, penalty=FIRTH, start=self.start[None]).theta
        else:
            top = _climbed(self.counts, self.start[None], None, self.basis)[1]
        return _Restricted.of(self.counts, top, self.basis)

    def by(self, spread: Floats, freedom: Floats) -> Profiles:
        """Return the profiles with another variance; what the likelihood alone says is not computed again."""
        others = replace(self, spread=spread, freedom=freedom)
        others.__dict__["_restricted"] = self._restricted
        return others

    @cached_property
    def at_zero(self) -> Floats:
        """Shape (K,): t(0), of the hypotheses that the values are 0; positive where they are above it."""
        return self.at(0.0)

    def at(self, bound: Floats | float) -> Floats:
        """Return t(δ), shape (K,), of the value ``bound`` in nats; positive where the value is above it."""
        none = np.zeros(len(self.contrasts), dtype=np.intp)
        bounds = np.broadcast_to(np.asarray(bound, dtype=np.float64), none.shape)
        return scaled(self._restricted.roots(none, self.contrasts, bounds)[0], self.spread)

    @cached_property
    def p(self) -> Floats:
        """Shape (K,): two-sided p values of the hypotheses that the values are 0."""
        from scipy.special import ndtr, stdtr

        t = -np.abs(self.at_zero)
        p = 2 * (ndtr(t) if self.freedom is None else stdtr(self.freedom, t))
        return np.asarray(np.minimum(p, self.exchanged))

    @cached_property
    def exchanged(self) -> Floats:
        """Shape (K,): exact p values of the exchange of two items; 1 where there is none."""
        return np.ones(len(self.spread)) if self.wins is None else exchange_p(self.wins[None])[0]

    def interval(self, level: float = 0.95) -> Floats:
        """Return the ends of the profile intervals of the values in nats, shape (K, 2); ±inf where there is no end.

        Where the exchange of the two items refuses 0 at this level, it refuses all differences beyond 0 on that side
        too, which have still less chance of such answers: the interval then ends at 0. Where only Firth's term bounds
        a difference, the interval has no end on that side.
        """
        from scipy.special import ndtri, stdtrit

        tail = (1 + level) / 2
        reach = np.full(len(self.spread), ndtri(tail)) if self.freedom is None else stdtrit(self.freedom, tail)
        low, high = self._ends(np.asarray(reach * np.sqrt(self.spread), dtype=np.float64))
        refused = self.exchanged <= 1 - level
        low = np.where(refused & (self.at_zero > 0), np.maximum(low, 0.0), low)
        high = np.where(refused & (self.at_zero < 0), np.minimum(high, 0.0), high)
        low, high = np.where(self.unbounded < 0, -np.inf, low), np.where(self.unbounded > 0, np.inf, high)
        return np.stack([low, high], axis=1)

    def _ends(self, reach: Floats) -> Floats:
        """Return below and above where r(δ) is ±``reach``, shape (2, K): bracketed, then by Illinois's secants."""
        restricted, number = self._restricted, len(reach)
        contrasts, side = np.tile(self.contrasts, (2, 1)), np.repeat([-1.0, 1.0], number)
        reach, none = np.tile(reach, 2), np.zeros(2 * number, dtype=np.intp)
        along, apart, width = restricted.along(none, contrasts)
        nat = 1 / np.ptp(along, axis=1)  # by what a value changes where no two strengths come a nat farther apart
        most = np.maximum(FARTHEST * nat - side * apart, nat)
        near, below = np.zeros(2 * number), -reach
        far = np.where(reach > 0, np.minimum(reach * np.sqrt(width), most), np.inf)  # the Wald interval's
        above = np.full(2 * number, np.nan)
        end, theta = far.copy(), np.repeat(restricted.top, 2 * number, axis=0)
        left = np.flatnonzero(np.isfinite(far))
        for _ in range(MOST_STEPS):
            at = apart[left] + side[left] * end[left]
            roots, theta[left] = restricted.roots(none[left], contrasts[left], at, theta[left])
            value = -side[left] * roots - reach[left]
            beyond = value >= 0
            # Illinois: the end that stays for a second time counts half.
            below[left] = np.where(beyond, np.where(np.isnan(above[left]), 1, 0.5) * below[left], value)
            above[left] = np.where(beyond, value, above[left] / 2)
            near[left], far[left] = np.where(beyond, near[left], end[left]), np.where(beyond, end[left], far[left])
            left = left[np.abs(value) > SMALL_ROOT]
            open_ = np.isnan(above[left])
            end[left[open_]] = np.where(end[left] < most[left], np.minimum(2 * end[left], most[left]), np.inf)[open_]
            left = left[np.isfinite(end[left])]
            if not len(left):
                break
            closed = left[~np.isnan(above[left])]
            inside = (near[closed] * above[closed] - far[closed] * below[closed]) / (above[closed] - below[closed])
            end[closed] = np.clip(inside, near[closed], far[closed])
        return np.asarray((apart + side * end).reshape(2, number))


def profiles_of(fit: Fit) -> Profiles | None:
    """Return the profiles of a fit's differences, pairs i < j as in ``numpy.triu_indices``; None where there are none.

    Tests are by standard errors for laws other than Bradley and Terry's, with an order effect, under a prior, for more
    than 40 items, and where there is no fit.
    """
    counts = fit.counts
    if fit.method == "map" or not profiled(counts, fit.model) or fit.separation or not np.isfinite(fit.theta).all():
        return None
    first, second = pairs = np.triu_indices(counts.n, 1)
    contrasts = differences_of(counts.n, first, second)
    if fit.clustered is None:
        spread, freedom, wins = np.ones(len(first)), None, None
    else:
        found = fit.clustered.spread
        own, model = contrast_variances(found.covariance[0])[pairs], contrast_variances(found.model[0])[pairs]
        spread, freedom, wins = own / model, fit.pair_freedom, fit.wins_by_observer
    unbounded = _unbounded(fit, first, second) if fit.held_by_penalty else 0.0
    return Profiles(counts, fit.theta, contrasts, spread, freedom, None, unbounded, wins)


def differences_of(n: int, first: Indices, second: Indices) -> Floats:
    """Return the contrasts (K, n) of ``n`` strengths that are the differences of two items each."""
    contrasts, each = np.zeros((len(first), n)), np.arange(len(first))
    contrasts[each, first], contrasts[each, second] = 1, -1
    return contrasts


def _unbounded(fit: Fit, first: Indices, second: Indices) -> Floats:
    place = np.empty(fit.counts.n)
    for number, group in enumerate(strong_groups(fit.counts.wins()[0])):
        place[list(group)] = number
    return np.asarray(np.sign(place[second] - place[first]))


def profiled(counts: Counts, model: Model) -> bool:
    """Return whether the pairs of a law's ``counts`` are tested by profiles."""
    return model == "bradley-terry" and not counts.ordered and counts.n <= MOST_ITEMS_PROFILED


def penalised_top(counts: Counts, start: Floats) -> Floats:
    """Return where B penalised likelihoods are largest, to about a millionth of a nat; shapes (B, n)."""
    return _climbed(counts, start, None, None)[1]


def scaled(roots: Floats, spread: Floats) -> Floats:
    """Return t = r / √κ, shape (B, P); 0 where κ is 0: no variance is no evidence of how much observers vary."""
    return np.asarray(np.divide(roots, np.sqrt(spread), out=np.zeros_like(roots), where=spread > 0))


def signed_roots(
    counts: Counts,
    top: Floats,
    bounds: Floats | float = 0.0,
    *,
    chosen: Flags | None = None,
    small: float = SMALL_STEP,
) -> Floats:
    """Return r(δ) of every two items in B sets of counts, shape (B, P).

    Parameters
    ----------
    counts
        Without ties or order, the items linked by comparisons.
    top
        Shape (B, n): the strengths that maximise the penalised likelihood.
    bounds
        Shape (B, P): δ of each pair i < j, in nats; or one of all.
    chosen
        Shape (B, P): which are wanted; 0 is returned of the others.
    small
        Steps below so many nats are the last.
    """
    batch, n = top.shape
    first, second = np.triu_indices(n, 1)
    chosen = np.ones((batch, len(first)), dtype=np.bool_) if chosen is None else chosen
    row, pair = np.nonzero(chosen)
    bounds = np.broadcast_to(np.asarray(bounds, dtype=np.float64), chosen.shape)[chosen]
    restricted = _Restricted.of(counts, top, None)
    roots, found = np.zeros(chosen.shape), np.empty(len(row))
    for own in parts(len(row), n * n):
        contrasts = differences_of(n, first[pair[own]], second[pair[own]])
        found[own] = restricted.roots(row[own], contrasts, bounds[own], small=small)[0]
    roots[chosen] = found
    return roots


def parts(number: int, size: int, most: int = MOST_NUMBERS) -> Iterator[slice]:
    """Yield so many of ``number`` tasks at a time that with ``size`` numbers each they are at most ``most``."""
    many = max(1, most // size)
    for start in range(0, number, many):
        yield slice(start, start + many)


@dataclass(frozen=True, slots=True, eq=False)
class _Restricted:
    """What is largest of the penalised likelihoods of B sets of counts where the value of one contrast is given.

    ``top`` (B, n) are the strengths where they are largest of all, ``highest`` (B,), ``inverse`` (B, n, n) the
    inverse information there.
    """

    counts: Counts
    top: Floats
    highest: Floats
    inverse: Floats
    basis: Floats | None

    @classmethod
    def of(cls, counts: Counts, top: Floats, basis: Floats | None) -> _Restricted:
        return cls(counts, top, _objective(counts, top, basis), _inverse(counts, top, basis), basis)

    def along(self, row: Indices, contrasts: Floats) -> tuple[Floats, Floats, Floats]:
        """Return of each of K contrasts how strengths change with its value (K, n), the value and its variance."""
        along = (self.inverse[row] @ contrasts[:, :, None])[:, :, 0]
        width = (contrasts * along).sum(axis=1)
        return along / width[:, None], (contrasts * self.top[row]).sum(axis=1), width

    def roots(
        self,
        row: Indices,
        contrasts: Floats,
        bounds: Floats,
        start: Floats | None = None,
        small: float = SMALL_STEP,
    ) -> tuple[Floats, Floats]:
        """Return r(δ) of K contrasts (K, n), shape (K,), and the strengths, (K, n), that are likeliest at δ.

        ``start`` (K, n) are strengths to begin from, those of ``top`` where None; steps below ``small`` are the last.
        """
        n = self.counts.n
        roots, found = np.empty(len(row)), np.empty((len(row), n))
        for own in parts(len(row), max(len(self.counts.first), n * n)):
            theta = self.top[row[own]] if start is None else start[own]
            roots[own], found[own] = self._block(row[own], contrasts[own], bounds[own], theta, small)
        return roots, found

    def _block(
        self, row: Indices, contrasts: Floats, bounds: Floats, theta: Floats, small: float
    ) -> tuple[Floats, Floats]:
        along, value, _ = self.along(row, contrasts)
        toward = bounds - (contrasts * theta).sum(axis=1)
        start = theta + toward[:, None] * along
        reached, theta = _climbed(_rows(self.counts, row), start, contrasts, self.basis, small)
        return np.sign(value - bounds) * np.sqrt(np.maximum(2 * (self.highest[row] - reached), 0)), theta


def _climbed(
    counts: Counts, theta: Floats, contrasts: Floats | None, basis: Floats | None, small: float = SMALL_STEP
) -> tuple[Floats, Floats]:
    """Return the largest penalised likelihood (K,), and where, with the values of ``contrasts`` (K, n) as they are."""
    highest, found = np.empty(len(theta)), np.empty_like(theta)
    active = np.arange(len(theta))
    for iteration in range(MOST_STEPS):
        inverse = _inverse(counts, theta, basis)
        step = (inverse @ _slope(counts, theta, inverse)[:, :, None])[:, :, 0]
        if contrasts is not None:
            along = (inverse @ contrasts[:, :, None])[:, :, 0]
            step -= along * ((contrasts * step).sum(axis=1) / (contrasts * along).sum(axis=1))[:, None]
        longest = np.abs(step).max(axis=1)
        theta = theta + _shortened(counts, theta, step, longest, basis) * step
        done = (longest < small) | ~np.isfinite(longest) | (iteration == MOST_STEPS - 1)
        if done.any():
            found[active[done]] = theta[done]
            highest[active[done]] = _objective(_rows(counts, np.flatnonzero(done)), theta[done], basis)
            left = ~done
            if not left.any():
                break
            active, theta, counts = active[left], theta[left], counts.select(left)
            contrasts = None if contrasts is None else contrasts[left]
    return highest, found


def _shortened(counts: Counts, theta: Floats, step: Floats, longest: Floats, basis: Floats | None) -> Floats:
    """Return which share of each step to take, shape (K, 1): halved while the likelihood falls on a long step."""
    share = np.ones((len(theta), 1))
    doubtful = np.flatnonzero(longest > LONG_STEP)
    if not len(doubtful):
        return share
    some = _rows(counts, doubtful)
    here = _objective(some, theta[doubtful], basis)
    for _ in range(30):
        there = _objective(some, theta[doubtful] + share[doubtful] * step[doubtful], basis)
        falls = ~(there >= here - 1e-9 * (1 + np.abs(here)))
        if not falls.any():
            break
        share[doubtful[falls]] /= 2
    return share


def _rows(counts: Counts, rows: Indices) -> Counts:
    won, lost, tied = (part[rows] for part in (counts.won, counts.lost, counts.tied))
    return Counts(counts.n, counts.first, counts.second, won, lost, tied)


def _slope(counts: Counts, theta: Floats, inverse: Floats) -> Floats:
    d = counts.differences(theta)
    slopes = LOGISTIC.slopes(counts, d, 0.0)
    variance = np.diagonal(inverse, axis1=1, axis2=2)
    first, second = counts.first, counts.second
    apart = variance[:, first] + variance[:, second] - 2 * inverse[:, first, second]
    return counts.net_flows(slopes.d - slopes.dd * apart / 2 * np.tanh(d / 2), exact=False)


def _information(counts: Counts, theta: Floats) -> Floats:
    weights = counts.matrix(LOGISTIC.slopes(counts, counts.differences(theta), 0.0).dd)
    n = counts.n
    information: Floats = np.negative(weights, order="C")
    information.reshape(-1, n * n)[:, :: n + 1] = weights.sum(axis=2)
    return information


def _inverse(counts: Counts, theta: Floats, basis: Floats | None) -> Floats:
    """Return the pseudo-inverses of the information on what the strengths are free to do, shape (K, n, n)."""
    n, information = counts.n, _information(counts, theta)
    size = np.einsum("kii->k", information)[:, None, None] / n
    information += RIDGE * size * np.eye(n)  # far out some weights are no longer distinguished from 0
    if basis is not None:
        return np.asarray(basis @ np.linalg.inv(basis.T @ information @ basis) @ basis.T)
    return np.asarray(np.linalg.inv(information + size / n) - 1 / (size * n))


def _objective(counts: Counts, theta: Floats, basis: Floats | None) -> Floats:
    """Return the likelihood with Firth's term, up to a constant, shape (K,)."""
    plain = LOGISTIC.log_likelihood(counts, counts.differences(theta), 0.0).sum(axis=1)
    information = _information(counts, theta)
    free = information[:, 1:, 1:] if basis is None else basis.T @ information @ basis
    return np.asarray(plain + np.linalg.slogdet(free)[1] / 2)


def wins_by_observer(counts: Counts, answers: Answers) -> Floats | None:
    """Return how often each item won with each observer, shape (S, n), where exchanging two items is an exact test.

    None where observers did not all answer every pair as often, there are more than 100, or counts are not whole.
    """
    who, observer = np.unique(answers.observer, return_inverse=True)
    people, n, pairs = len(who), counts.n, len(counts.first)
    if not 1 < people <= MOST_OBSERVERS_EXCHANGED or counts.ordered or pairs != n * (n - 1) // 2:
        return None
    given = np.bincount(observer * pairs + answers.pair, answers.count, people * pairs)
    if not (given == given[0]).all() or (answers.count % 1).any() or (answers.outcome == 2).any():
        return None
    winner = np.where(answers.outcome == 0, counts.first[answers.pair], counts.second[answers.pair])
    return np.asarray(np.bincount(observer * n + winner, answers.count, people * n).reshape(people, n), np.float64)


def exchange_p(wins: Floats, *, most: float = 1.0) -> Floats:
    """Return the exact two-sided p values, shape (B, P), that exchanging two items leaves all chances as they are.

    ``wins`` has the shape (B, S, n). The sum of the S differences of wins has the law of Σ ± |D_s| with independent
    signs, whose characteristic function is Π cos(|D_s| t). Where only p up to ``most`` matter, others may be 1: sums
    of one standard deviation at most have p above 0.1 [Oleszkiewicz1996].
    """
    first, second = np.triu_indices(wins.shape[2], 1)
    p = np.ones((len(wins), len(first)))
    for row, own in enumerate(wins):
        size = np.abs(own[:, first] - own[:, second])
        total = np.abs((own[:, first] - own[:, second]).sum(axis=0))
        least = (size**2).sum(axis=0) if most <= LEAST_WITHIN_ONE_SD else 0.0
        for chosen in _blocks(np.flatnonzero(total**2 > least), size):
            span = int(size[:, chosen].sum(axis=0).max()) + 1
            angle = np.pi * np.arange(span + 1) / span
            chances = np.fft.irfft(np.cos(size[:, chosen, None] * angle).prod(axis=0), 2 * span)[:, : span + 1]
            # P(|Σ| ≥ total): sums of the far tail alone, which keep more digits than 1 less the rest.
            tails = np.cumsum(np.maximum(chances, 0)[:, ::-1], axis=1)[:, ::-1]
            p[row, chosen] = 2 * tails[np.arange(len(chosen)), total[chosen].astype(np.intp)]
    return np.minimum(p, 1.0)


def _blocks(chosen: Indices, size: Floats) -> Iterator[Indices]:
    """Yield some of the pairs ``chosen`` at a time, so that the table of cosines stays small."""
    if not len(chosen):
        return
    numbers = len(size) * (int(size[:, chosen].sum(axis=0).max()) + 2)
    many = max(1, MOST_NUMBERS // numbers)
    for start in range(0, len(chosen), many):
        yield chosen[start : start + many]
