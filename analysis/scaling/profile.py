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
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from analysis.covariance.laplacian import contrast_variances, differences_of
from analysis.scaling.counts import Answers, Counts
from analysis.scaling.designs import outweighed
from analysis.scaling.jeffreys import Jeffreys
from analysis.scaling.laws import LAWS, LOGISTIC
from analysis.scaling.newton import maximise
from analysis.scaling.penalty import FIRTH
from analysis.scaling.separation import DIRECTION_ROUNDING, drawn_apart
from documents import count_work
from documents.arrays import Flags, Floats, Indices

if TYPE_CHECKING:
    from analysis.scaling.result import Fit

MOST_ITEMS_PROFILED = 40
MOST_OBSERVERS_EXCHANGED = 100
MOST_NUMBERS = 2_000_000
MOST_STEPS = 100
SMALL_STEP = 1e-6  # the likelihood is then exact to about its square
COARSE_STEP = 0.02  # nats; what is left is far less, and the likelihood exact to about its square
LONG_STEP = 0.5  # nats; only after longer ones is the likelihood compared
SMALL_ROOT = 1e-8  # from the end of an interval, in standard deviations
SHARES = (0.3, 1.5)
TINY = 1e-300
LEAST_WITHIN_ONE_SD = 0.1
FARTHEST = 30.0  # nats beyond which an interval has no end: a chance of 1 less 1e-13


@dataclass(frozen=True, eq=False)
class Profiles:
    """Profiles of the likelihood along K contrasts of n strengths, such as the differences of every two items.

    Attributes
    ----------
    likelihood
        The penalised likelihood of one set of counts.
    start
        Shape (n + f,): strengths and further parameters near those of largest penalised likelihood.
    contrasts
        Shape (K, n + f): what of the strengths each is; its value is ``contrasts @ x``, in the units of the strengths.
    spread
        Shape (K,): κ, how many times the model's variance the one by observers is; 1 for the model's.
    freedom
        Shape (K,): degrees of freedom; None for the model's variance.
    unbounded
        Shape (K,): 1 where no answers bound the value from above, such as that of an item that never lost; -1 where
        none bound it from below; else 0.
    wins
        Of differences of every two items, shape (S, n): how often each item won with each observer, where all answered
        every pair as often; else None.
    """

    likelihood: Jeffreys
    start: Floats
    contrasts: Floats
    spread: Floats
    freedom: Floats | None
    unbounded: Floats | float = 0.0
    wins: Floats | None = None

    @cached_property
    def _restricted(self) -> _Restricted:
        return _Restricted.of(self.likelihood, penalised_top(self.likelihood, self.start[None]))

    def by(self, spread: Floats, freedom: Floats) -> Profiles:
        """Return the profiles with another variance; what the likelihood alone says is not computed again."""
        others = replace(self, spread=spread, freedom=freedom)
        others.__dict__["_restricted"] = self._restricted
        return others

    def only(self, places: Indices) -> Profiles:
        """Return the profiles of some of the contrasts."""
        freedom = None if self.freedom is None else self.freedom[places]
        unbounded = np.broadcast_to(self.unbounded, self.spread.shape)[places]
        contrasts, spread = self.contrasts[places], self.spread[places]
        some = replace(self, contrasts=contrasts, spread=spread, freedom=freedom, unbounded=unbounded, wins=None)
        some.__dict__.update(_restricted=self._restricted, exchanged=self.exchanged[places])
        return some

    @cached_property
    def at_zero(self) -> Floats:
        """Shape (K,): t(0), of the hypotheses that the values are 0; positive where they are above it."""
        return self.at(0.0)

    def at(self, bound: Floats | float) -> Floats:
        """Return t(δ), shape (K,), of the value ``bound``; positive where the value is above it."""
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
        """Return the ends of the profile intervals of the values, shape (K, 2); ±inf where there is no end.

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
        return np.stack([low, high], axis=1)

    def _ends(self, reach: Floats) -> Floats:
        """Return below and above where r(δ) is ±``reach``, shape (2, K): bracketed, then by Illinois's secants."""
        restricted, number, n = self._restricted, len(reach), self.likelihood.counts.n
        count_work("profile_intervals", number)
        contrasts, side = np.tile(self.contrasts, (2, 1)), np.repeat([-1.0, 1.0], number)
        reach, none = np.tile(reach, 2), np.zeros(2 * number, dtype=np.intp)
        along, apart, width = restricted.along(none, contrasts)
        # By what a value changes where no two strengths come a nat farther apart.
        nat = self.likelihood.law.jnd / LOGISTIC.jnd / np.ptp(along[:, :n], axis=1)
        most = np.maximum(FARTHEST * nat - side * apart, nat)
        near, below = np.zeros(2 * number), -reach
        bounded = (reach > 0) & (side * np.broadcast_to(self.unbounded, (2, number)).ravel() <= 0)
        far = np.where(bounded, np.minimum(reach * np.sqrt(width), most), np.inf)  # the Wald interval's
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

    Tests are by standard errors under a prior, for more than 40 items, answers of tiny weights, and without a fit.
    """
    if why_by_standard_errors(fit) or fit.separation or not np.isfinite(fit.theta).all():
        return None
    return _profiles_of(fit)


@lru_cache(maxsize=1)
def _profiles_of(fit: Fit) -> Profiles:
    """Return the profiles, those of the last fit again: classes, intervals and conclusions climb them once."""
    counts = fit.counts
    first, second = pairs = np.triu_indices(counts.n, 1)
    likelihood = Jeffreys(counts, LAWS[fit.model])
    if fit.clustered is None:
        spread, freedom, wins = np.ones(len(first)), None, None
    else:
        found = fit.clustered.spread
        own, model = contrast_variances(found.covariance[0])[pairs], contrast_variances(found.model[0])[pairs]
        spread, freedom, wins = own / model, fit.pair_freedom, fit.wins_by_observer
    unbounded = _unbounded(fit, first, second) if fit.held_by_penalty else 0.0
    start = np.r_[fit.theta, [parameter.estimate for parameter in fit.parameters]]
    contrasts = differences_of(likelihood.parameters, first, second)
    return Profiles(likelihood, start, contrasts, spread, freedom, unbounded, wins)


def why_by_standard_errors(fit: Fit) -> str:
    """Return why the items of a fit are tested by standard errors, in words; empty where they are not."""
    return "under a prior" if fit.method == "map" else why_not_profiled(fit.counts)


def _unbounded(fit: Fit, first: Indices, second: Indices) -> Floats:
    away = drawn_apart(fit.counts, ties=LAWS[fit.model].parameter is not None)
    apart = away[first] - away[second]
    return np.where(np.abs(apart) > DIRECTION_ROUNDING, np.sign(apart), 0.0)


def why_not_profiled(counts: Counts) -> str:
    """Return why the pairs of ``counts`` are not tested by profiles, in words; empty where they are."""
    if counts.n > MOST_ITEMS_PROFILED:
        return f"more than {MOST_ITEMS_PROFILED} items"
    return "weights of all answers that link two items amount to less than one answer" if outweighed(counts) else ""


def penalised_top(likelihood: Jeffreys, start: Floats) -> Floats:
    """Return where B penalised likelihoods are largest, from ``start``; shapes (B, n + f)."""
    if likelihood.law is LOGISTIC and likelihood.basis is None and not likelihood.counts.ordered:
        return maximise(likelihood.counts, penalty=FIRTH, start=start).theta
    return climbed(likelihood, start)[1]


def scaled(roots: Floats, spread: Floats) -> Floats:
    """Return t = r / √κ, shape (B, P); 0 where κ is 0: no variance is no evidence of how much observers vary."""
    return np.asarray(np.divide(roots, np.sqrt(spread), out=np.zeros_like(roots), where=spread > 0))


def signed_roots(
    likelihood: Jeffreys,
    top: Floats,
    bounds: Floats | float = 0.0,
    *,
    chosen: Flags | None = None,
    small: float = SMALL_STEP,
) -> Floats:
    """Return r(δ) of every two items in B sets of counts, shape (B, P).

    Parameters
    ----------
    likelihood
        Of counts by which the items are linked.
    top
        Shape (B, n + f): the parameters that maximise it.
    bounds
        Shape (B, P): δ of each pair i < j, in the units of the strengths; or one of all.
    chosen
        Shape (B, P): which are wanted; 0 is returned of the others.
    small
        Steps below so many units are the last.
    """
    batch, size = top.shape
    first, second = np.triu_indices(likelihood.counts.n, 1)
    chosen = np.ones((batch, len(first)), dtype=np.bool_) if chosen is None else chosen
    row, pair = np.nonzero(chosen)
    bounds = np.broadcast_to(np.asarray(bounds, dtype=np.float64), chosen.shape)[chosen]
    restricted = _Restricted.of(likelihood, top)
    roots, found = np.zeros(chosen.shape), np.empty(len(row))
    for own in parts(len(row), size * size):
        contrasts = differences_of(size, first[pair[own]], second[pair[own]])
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
    """What is largest of B penalised likelihoods where the value of one contrast is given.

    ``top`` (B, n + f) are the parameters where they are largest of all, ``highest`` (B,), ``inverse`` the inverse
    information there.
    """

    likelihood: Jeffreys
    top: Floats
    highest: Floats
    inverse: Floats

    @classmethod
    def of(cls, likelihood: Jeffreys, top: Floats) -> _Restricted:
        return cls(likelihood, top, likelihood.value(top), likelihood.inverse(top))

    def along(self, row: Indices, contrasts: Floats) -> tuple[Floats, Floats, Floats]:
        """Return of each of K contrasts how parameters change with its value (K, n + f), the value and its variance."""
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
        """Return r(δ) of K contrasts (K, n + f), shape (K,), and the parameters, (K, n + f), that are likeliest at δ.

        ``start`` (K, n + f) are parameters to begin from, ``top`` where None; steps below ``small`` are the last.
        """
        size = contrasts.shape[1]
        roots, found = np.empty(len(row)), np.empty((len(row), size))
        for own in parts(len(row), max(len(self.likelihood.counts.first), size * size)):
            x = self.top[row[own]] if start is None else start[own]
            roots[own], found[own] = self._block(row[own], contrasts[own], bounds[own], x, small)
        return roots, found

    def _block(self, row: Indices, contrasts: Floats, bounds: Floats, x: Floats, small: float) -> tuple[Floats, Floats]:
        along, value, _ = self.along(row, contrasts)
        start = x + (bounds - (contrasts * x).sum(axis=1))[:, None] * along
        if self.likelihood.law.parameter is not None:  # which may have a bound
            own = self.likelihood.counts.n
            start[:, own] = x[:, own]
        reached, x, _ = climbed(self.likelihood.rows(row), start, contrasts, small)
        return np.sign(value - bounds) * np.sqrt(np.maximum(2 * (self.highest[row] - reached), 0)), x


def climbed(
    likelihood: Jeffreys, x: Floats, contrasts: Floats | None = None, small: float = SMALL_STEP
) -> tuple[Floats, Floats, Indices]:
    """Return the largest penalised likelihoods (K,), where they are (K, n + f), and after how many steps (K,).

    Values of ``contrasts`` (K, n + f) stay what they are at ``x``. Steps below ``small`` are the last.
    """
    highest, found, steps = np.empty(len(x)), np.empty_like(x), np.empty(len(x), dtype=np.intp)
    active, before, share = np.arange(len(x)), np.zeros_like(x), np.ones((len(x), 1))
    for iteration in range(MOST_STEPS):
        inverse = likelihood.inverse(x)
        step = (inverse @ likelihood.slope(x, inverse)[:, :, None])[:, :, 0]
        if contrasts is not None:
            along = (inverse @ contrasts[:, :, None])[:, :, 0]
            step -= along * ((contrasts * step).sum(axis=1) / (contrasts * along).sum(axis=1))[:, None]
        longest = np.abs(step).max(axis=1)
        # The information is without the penalty's: a step is longer or shorter by what the last one was wrong.
        size = np.maximum((before * before).sum(axis=1, keepdims=True), TINY)
        share = np.clip(share / np.maximum(1 - (before * step).sum(axis=1, keepdims=True) / size, 0.5), *SHARES)
        before = step
        x = x + share * _shortened(likelihood, x, share * step, longest) * step
        done = (longest < small) | ~np.isfinite(longest) | (iteration == MOST_STEPS - 1)
        if done.any():
            found[active[done]] = x[done]
            highest[active[done]] = likelihood.rows(done).value(x[done])
            steps[active[done]] = iteration + 1
            left = ~done
            if not left.any():
                break
            active, x, likelihood = active[left], x[left], likelihood.rows(left)
            before, share = before[left], share[left]
            contrasts = None if contrasts is None else contrasts[left]
    return highest, found, steps


def _shortened(likelihood: Jeffreys, x: Floats, step: Floats, longest: Floats) -> Floats:
    """Return which share of each step to take, shape (K, 1): halved while the likelihood falls on a long step."""
    share = np.ones((len(x), 1))
    doubtful = np.flatnonzero(longest > (LONG_STEP if likelihood.law.safe_step else SMALL_STEP))
    if not len(doubtful):
        return share
    some = likelihood.rows(doubtful)
    here = some.value(x[doubtful])
    for _ in range(30):
        there = some.value(x[doubtful] + share[doubtful] * step[doubtful])
        falls = ~(there >= here - 1e-9 * (1 + np.abs(here)))
        if not falls.any():
            break
        share[doubtful[falls]] /= 2
    return share


def wins_by_observer(counts: Counts, answers: Answers) -> Floats | None:
    """Return `exchangeable_wins` of each observer's answers; None with an order effect too."""
    who, observer = np.unique(answers.observer, return_inverse=True)
    shape = people, pairs = len(who), len(counts.first)
    if counts.ordered or people > MOST_OBSERVERS_EXCHANGED:
        return None
    place = observer * pairs + answers.pair
    each = (np.bincount(place, answers.count * (answers.outcome == kind), people * pairs) for kind in range(3))
    won, lost, tied = (np.asarray(numbers, np.float64).reshape(shape) for numbers in each)
    return exchangeable_wins(counts.n, counts.first, counts.second, won, lost, tied)


def exchangeable_wins(
    n: int, first: Indices, second: Indices, won: Floats, lost: Floats, tied: Floats | float = 0.0
) -> Floats | None:
    """Return how often each of ``n`` items won with each observer, shape (..., S, n), where exchanging two is exact.

    ``won``, ``lost`` and ``tied`` (..., S, P) say how often the first item of each compared pair did. None where
    observers did not all answer every pair as often, there are more than 100, or counts are not whole.
    """
    people, pairs = won.shape[-2:]
    if not 1 < people <= MOST_OBSERVERS_EXCHANGED or pairs != n * (n - 1) // 2:
        return None
    given = won + lost + tied
    if not (given == given.flat[0]).all() or (won % 1).any() or (lost % 1).any():
        return None
    side = np.eye(n)
    return np.asarray(won @ side[first] + lost @ side[second])


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
        wanted = np.flatnonzero(total**2 > least)
        longest = int(size[:, wanted].sum(axis=0).max(initial=0.0))
        for part in parts(len(wanted), len(size) * (longest + 2)):  # so that the table of cosines stays small
            chosen = wanted[part]
            span = int(size[:, chosen].sum(axis=0).max()) + 1
            sizes, place = np.unique(size[:, chosen], return_inverse=True)
            cosines = np.cos(sizes[:, None] * (np.pi * np.arange(span + 1) / span))
            product = np.ones((len(chosen), span + 1))
            for each in place.reshape(len(size), -1):
                product *= cosines[each]
            chances = np.fft.irfft(product, 2 * span)[:, : span + 1]
            # P(|Σ| ≥ total): sums of the far tail alone, which keep more digits than 1 less the rest.
            tails = np.cumsum(np.maximum(chances, 0)[:, ::-1], axis=1)[:, ::-1]
            p[row, chosen] = 2 * tails[np.arange(len(chosen)), total[chosen].astype(np.intp)]
    return np.minimum(p, 1.0)
