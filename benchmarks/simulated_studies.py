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
from analysis.bootstrap.replicates import Name, Quantity, Replicates, resample_counts
from analysis.choices import Adjust, CovarianceChoice
from analysis.classes.multiplicity import corrected, two_sided_p
from analysis.comparisons.comparisons import Comparisons, from_arrays
from analysis.covariance import contrast_variances
from analysis.errors import ResultsError
from analysis.report.estimate import estimate_scores
from analysis.scaling.counts import Counts
from analysis.scaling.fitting import fit
from analysis.scaling.laws import LAWS, Model
from analysis.scaling.newton import maximise
from analysis.scaling.profile import profiles_of
from analysis.scaling.result import CovarianceKind, Fit, Method
from analysis.scaling.scores import score
from analysis.scaling.separation import strong_groups
from analysis.simulation import Plan
from analysis.simulation.studies import analyse, widths
from documents.arrays import Floats, Indices


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """``observers`` who compare n items with strengths ``theta`` (n,), in nats, or the units of ``law``.

    Attributes
    ----------
    observer_sd
        Standard deviation in nats of each observer's own strengths about the common ones, of all items or (n,) of each.
    camps
        Shape (n,): what one half of all people add to the strengths, and the other half takes from them.
    share
        Share (0 to 1) of pairs that each observer answers, drawn for each; or shares that differ between the
        observers, evenly from the first of two numbers to the second.
    law, k, order
        By which law they answer and are analysed, its parameter, and what being shown first adds, at random for each
        answer; None where no order is noted.
    """

    theta: Floats
    observers: int
    observer_sd: Floats | float = 0.0
    camps: Floats | float = 0.0
    share: float | tuple[float, float] = 1.0
    law: Model = "bradley-terry"
    k: float = 0.0
    order: float | None = None

    def truth(self) -> Floats:
        """Return what endless observers would give, shape (n,), with mean 0."""
        difference = self.theta[:, None] - self.theta[None, :]
        camps = np.broadcast_to(self.camps, self.theta.shape)
        off = camps[:, None] - camps[None, :]
        variance = np.broadcast_to(self.observer_sd, self.theta.shape) ** 2
        reach = np.sqrt(variance[:, None] + variance[None, :])
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        apart = (np.stack([difference + side * off for side in (-1, 1)])[..., None] + reach[..., None] * nodes) + (
            self.order or 0.0
        )
        chances = LAWS[self.law].probabilities(apart, self.k)
        mean = [(part * weights).sum(axis=(0, 3)) / (2 * weights.sum()) for part in chances]
        first, second = np.nonzero(~np.eye(len(self.theta), dtype=bool))
        counts = Counts(len(self.theta), first, second, *(part[first, second][None] for part in mean), ordered=True)
        return maximise(counts if self.order is not None else counts.without_order(), LAWS[self.law]).theta[0]

    def tables(self, count: int, seed: int) -> Iterator[Comparisons]:
        """Yield the answers of ``count`` simulated studies by any law; each observer answers every pair once."""
        random = np.random.default_rng(seed)
        n, people = len(self.theta), self.observers
        first, second = np.triu_indices(n, 1)
        for _ in range(count):
            side = random.choice([-1.0, 1.0], (people, 1))
            own = self.theta + random.normal(0, 1, (people, n)) * self.observer_sd + side * self.camps
            shown = np.where(random.random((people, len(first))) < 0.5, 1, -1)
            apart = own[:, first] - own[:, second] + shown * (self.order or 0.0)
            won, lost, _ = LAWS[self.law].probabilities(apart, self.k)
            drawn = random.random(won.shape)
            better, tied = drawn < won, drawn >= won + lost
            asked = random.random(won.shape) < np.linspace(*np.broadcast_to(self.share, 2), people)[:, None]
            observer, pair = np.nonzero(asked)
            ahead = better[observer, pair] | tied[observer, pair]
            yield from_arrays(
                tuple(f"item {item:03d}" for item in range(n)),
                tuple(f"{person:04d}" for person in range(people)),
                winner=np.where(ahead, first[pair], second[pair]),
                loser=np.where(ahead, second[pair], first[pair]),
                observer=observer,
                count=np.ones(len(observer)),
                winner_was_first=((shown[observer, pair] > 0) == ahead).astype(np.int8),
                tie=tied[observer, pair],
            )

    def studies(self, count: int, seed: int) -> Iterator[Floats]:
        """Yield the counts of each observer, shape (observers, n, n), of ``count`` simulated studies."""
        random = np.random.default_rng(seed)
        n, people = len(self.theta), self.observers
        least, most = self.share if isinstance(self.share, tuple) else (self.share, self.share)
        for _ in range(count):
            side = random.choice([-1.0, 1.0], (people, 1))
            own = self.theta + random.normal(0, 1, (people, n)) * self.observer_sd + side * self.camps
            ahead = random.random((people, n, n)) < 1 / (1 + np.exp(own[:, None, :] - own[:, :, None]))
            upper = np.triu(ahead, 1)
            counts = (upper | np.tril(~upper.transpose(0, 2, 1), -1)).astype(np.float64)
            if least < 1:
                asked = np.triu(random.random((people, n, n)) < np.linspace(least, most, people)[:, None, None], 1)
                counts = counts * (asked | asked.transpose(0, 2, 1))
            yield counts


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


@dataclass(frozen=True, slots=True, eq=False)
class Decisions:
    """What `analysis.report.estimate.estimate_scores` gave of simulated studies, by one choice of covariance.

    Attributes
    ----------
    false_difference
        Share of studies (0 to 1) with a significant pair of which the truth is equal, and its standard error.
    separated
        Mean share of the pairs whose truth differs that came out significant, in the right direction.
    direct
        The same share by the simplest test there is, for comparison: signs of the observers' answers to that pair,
        with the same correction.
    differences, log10_scores
        Share of 95 % intervals that contain the truth.
    too_far, too_near
        Share of the intervals of differences that lie wholly farther from 0 than the truth, and wholly nearer.
    without_scores
        Share of studies in which comparisons did not link all items.
    """

    false_difference: float
    standard_error: float
    separated: float
    direct: float
    differences: float
    too_far: float
    too_near: float
    log10_scores: float
    without_scores: float


def decisions(
    design: Design,
    *,
    studies: int,
    covariance: CovarianceChoice = "auto",
    adjust: Adjust = "holm",
    alpha: float = 0.05,
    seed: int = 2016,
) -> Decisions:
    """Analyse simulated studies as a report does, and compare with the truth."""
    truth = design.truth()
    n = len(truth)
    first, second = np.triu_indices(n, 1)
    apart = truth[first] - truth[second]
    log10 = (truth - np.logaddexp.reduce(truth)) / np.log(10)
    plain = design.law == "bradley-terry" and design.order is None
    outcomes = _by_law if not plain else _alike if design.share == 1.0 and adjust != "maxz" else _one_by_one
    found = outcomes(design, studies, covariance, adjust, alpha, seed)
    equal = np.abs(apart) < 1e-9
    false = (found.significant & equal).any(axis=1)
    right = (found.significant & (np.sign(found.difference) == np.sign(apart)))[:, ~equal]
    by_signs = found.direct[:, ~equal]
    far, near = found.missed * np.sign(apart) > 0, found.missed * np.sign(apart) < 0
    scored = (found.low <= log10) & (log10 <= found.high)
    share = float(false.mean())
    return Decisions(
        share,
        float(np.sqrt(max(share * (1 - share), 1 / len(false)) / len(false))),
        float(right.mean()) if right.size else float("nan"),
        float(by_signs.mean()) if by_signs.size else float("nan"),
        float((found.missed == 0).mean()),
        float(far.mean()),
        float(near.mean()),
        float(scored.mean()),
        1 - len(false) / studies,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Outcomes:
    """Of each of B studies: P pairs, and n log scores with the ends of their intervals.

    ``missed`` is 1 where the interval of the pair's difference lies above the truth, -1 where it lies below, else 0.
    """

    significant: NDArray[np.bool_]
    direct: NDArray[np.bool_]
    difference: Floats
    missed: Floats
    low: Floats
    high: Floats


def _one_by_one(
    design: Design, studies: int, covariance: CovarianceChoice, adjust: Adjust, alpha: float, seed: int
) -> _Outcomes:
    """As a report does it."""
    first, second = np.triu_indices(len(design.theta), 1)
    truth = design.truth()
    apart = truth[first] - truth[second]
    rows: list[tuple[Floats, ...]] = []
    for by_observer in design.studies(studies, seed):
        found = estimate_scores(
            as_comparisons(by_observer), alpha=alpha, adjust=adjust, covariance=covariance, draw=False
        )
        fitted, classes = found.scores.fit, found.scores.classes
        if fitted.separation is not None or classes is None:
            continue
        ends = np.empty((len(fitted.theta), 2))
        ends[list(found.scores.order)] = found.log10_interval
        rows.append(
            (
                classes.pair_p <= alpha,
                _signs(by_observer[None, :, first, second], by_observer[None, :, second, first], alpha, adjust)[0],
                fitted.theta[first] - fitted.theta[second],
                _missed_by(fitted, apart),
                ends[:, 0],
                ends[:, 1],
            )
        )
    return _Outcomes(*(np.array(column) for column in zip(*rows, strict=True)))


def _by_law(
    design: Design, studies: int, covariance: CovarianceChoice, adjust: Adjust, alpha: float, seed: int
) -> _Outcomes:
    """As `scores` does it by another law, or with an order effect; without log scores."""
    n = len(design.theta)
    first, second = np.triu_indices(n, 1)
    truth, ordered = design.truth(), design.order is not None
    apart = truth[first] - truth[second]
    rows: list[tuple[Floats, ...]] = []
    for answers in design.tables(studies, seed):
        try:
            found = score(
                answers,
                design.law,
                alpha=alpha,
                adjust=adjust,
                method="auto",
                order_effect=ordered,
                covariance=covariance,
            )
        except ResultsError:  # such as a law with ties, where nobody gave one
            continue
        fitted, classes = found.fit, found.classes
        if fitted.separation is not None or classes is None or not fitted.converged:
            continue
        net = np.zeros((design.observers, n, n))
        np.add.at(net, (answers.observer, answers.winner, answers.loser), answers.count)
        direct = _signs(net[None, :, first, second], net[None, :, second, first], alpha, adjust)[0]
        difference = fitted.theta[first] - fitted.theta[second]
        none = np.full(n, np.nan)
        rows.append((classes.pair_p <= alpha, direct, difference, _missed_by(fitted, apart), none, none))
    return _Outcomes(*(np.array(column) for column in zip(*rows, strict=True)))


def _alike(
    design: Design, studies: int, covariance: CovarianceChoice, adjust: Adjust, alpha: float, seed: int
) -> _Outcomes:
    """All studies at once, as `analysis.simulation.studies` does it; tests there compare it with a report's."""
    from scipy.special import log_softmax

    n = len(design.theta)
    first, second = np.triu_indices(n, 1)
    kind: CovarianceKind = "shrinkage" if covariance == "auto" else covariance
    pairs = np.ones(len(first), dtype=np.int64)
    plan = Plan(tuple(map(str, range(n))), design.theta, pairs, pairs > 0, alpha=alpha, adjust=adjust, covariance=kind)
    won = np.array([counts[:, first, second] for counts in design.studies(studies, seed)])
    found = analyse(plan, design.observers, won)
    width = widths(found, np.random.default_rng(0))
    log10 = log_softmax(found.theta, axis=1) / np.log(10)
    difference = found.theta[:, first] - found.theta[:, second]
    freedom = None if found.freedom is None else found.freedom[:, : len(first)]
    truth = design.truth()
    apart = truth[first] - truth[second]
    t = found.statistics(apart)
    for study in np.flatnonzero(found.separated):
        beaten = won[study].sum(axis=0)
        place = groups_in_order(n, first, second, beaten, design.observers - beaten)
        t[study] = np.where(np.sign(place[second] - place[first]) * t[study] < 0, 0.0, t[study])
    missed = _missed(t, freedom, apart, difference, found.exchanged)
    direct = _signs(won, 1 - won, alpha, adjust)
    half = np.where(width / 2 <= -log10, width / 2, width + log10)  # no upper end is above 0
    significant = found.significant(np.nan)
    return _Outcomes(significant, direct, difference, missed, log10 - half, np.minimum(log10 + half, 0))


def groups_in_order(n: int, first: Indices, second: Indices, won: Floats, lost: Floats) -> Floats:
    """Return the place of each item's group among those that nothing links, the best first; shape (n,)."""
    wins = np.zeros((n, n))
    wins[first, second], wins[second, first] = won, lost
    place = np.empty(n)
    for number, group in enumerate(strong_groups(wins)):
        place[list(group)] = number
    return place


def _missed_by(fitted: Fit, apart: Floats) -> Floats:
    """Return on which side the 95 % intervals of a report leave out ``apart`` (P,), the true differences i < j."""
    profiles, (first, second) = profiles_of(fitted), np.triu_indices(len(fitted.theta), 1)
    difference = fitted.theta[first] - fitted.theta[second]
    if profiles is None:
        error = np.sqrt(contrast_variances(fitted.covariance)[first, second])
        t, exchanged = np.divide(difference - apart, error, out=np.zeros_like(apart), where=error > 0), np.ones(1)
    else:
        t, exchanged = profiles.at(apart), profiles.exchanged
        t = np.where((profiles.unbounded * np.sign(t)) < 0, 0.0, t)  # no end on that side
    return _missed(t, fitted.pair_freedom, apart, difference, exchanged)


def _missed(t: Floats, freedom: Floats | None, apart: Floats, difference: Floats, exchanged: Floats) -> Floats:
    """Return the same from t of the true differences ``apart``, and p of the exchange of items; shapes (B, P)."""
    out = np.where(two_sided_p(np.abs(t), freedom) <= 0.05, np.sign(t), 0.0)
    wrong_side = np.sign(apart) * np.sign(difference) <= 0
    return np.where((exchanged <= 0.05) & wrong_side, np.sign(difference), out)


def _signs(won: Floats, lost: Floats, alpha: float, adjust: Adjust) -> NDArray[np.bool_]:
    """Return which pairs come out, in the right direction or not, by the signs of observers' answers; (B, S, P)."""
    from scipy.special import bdtr

    better, worse = (won > lost).sum(axis=1), (won < lost).sum(axis=1)
    p = np.minimum(1.0, 2 * bdtr(np.minimum(better, worse), better + worse, 0.5))
    return np.asarray(corrected(p, "holm" if adjust == "maxz" else adjust) <= alpha)


def as_comparisons(by_observer: Floats) -> Comparisons:
    """Return the counts of each observer, shape (observers, n, n), as comparisons."""
    people, n, _ = by_observer.shape
    observer, winner, loser = np.nonzero(by_observer)
    return from_arrays(
        tuple(f"item {item:03d}" for item in range(n)),
        tuple(f"{person:04d}" for person in range(people)),
        winner=winner,
        loser=loser,
        observer=observer,
        count=by_observer[observer, winner, loser],
        winner_was_first=np.full(len(winner), -1, dtype=np.int8),
        tie=np.zeros(len(winner), dtype=np.bool_),
    )


def _drawn(by_observer: Floats, replicates: int, seed: int) -> Replicates:
    people, n, _ = by_observer.shape
    items, observers = [f"item {item}" for item in range(n)], [f"{number:04d}" for number in range(people)]
    method: Method = "firth" if fit(by_observer.sum(axis=0)).separated else "ml"
    return resample_counts(by_observer, items, observers, replicates=replicates, seed=seed, method=method)


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
