"""The plan of a simulated study: what is compared how often, what is assumed of the scores, how pairs are tested."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.choices import Adjust, CovarianceChoice, Interval
from analysis.classes.classes import check_level
from analysis.classes.multiplicity import MAXZ_SEED, single_step
from analysis.covariance.laplacian import pseudo_inverse
from analysis.covariance.shrinkage import Spread
from analysis.errors import ResultsError
from analysis.scaling.fitting import covariance_kind, fit
from analysis.scaling.laws import LOGISTIC, probabilities
from analysis.scaling.result import CovarianceKind
from documents import Finding
from documents.arrays import Floats

MAXZ_SAMPLES = 50_000  # standard error 0.001 at p = 0.05
ScoresOf = Literal["typical", "average"]
INTERVALS: tuple[Interval, ...] = get_args(Interval)


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A design of paired comparisons of n items, with P pairs i < j in the order of ``numpy.triu_indices``.

    Attributes
    ----------
    items
        Names.
    theta
        Shape (n,): assumed log scores in nats, of the observers that ``scores_of`` says.
    times
        Shape (P,): how often each observer compares each pair, whole, at least 0. Shape (R, P): how often the first,
        second, ... of R observers do, where they share the pairs; the next R observers again do as they.
    differs
        Shape (P,): whether the pair differs in the assumed classes.
    observer_sd
        Standard deviation in nats of each observer's own strength of each item about the typical observer's.
    scores_of
        ``typical``: ``theta`` are the typical observer's, as `scores --observers random` fits them. ``average``: they
        are those of the average answer, as a report has them; observers who differ then answer by larger differences.
    lapse_rate
        Share (0 to 1) of random answers.
    alpha, adjust, covariance
        How pairs are tested: level, correction for multiple comparisons, and standard errors, chosen as in a report.
    interval, level
        Kind of the intervals of log10 scores, and their coverage.
    """

    items: tuple[str, ...]
    theta: Floats
    times: NDArray[np.int64]
    differs: NDArray[np.bool_]
    observer_sd: float = 0.0
    scores_of: ScoresOf = "typical"
    lapse_rate: float = 0.0
    alpha: float = 0.05
    adjust: Adjust = "holm"
    covariance: CovarianceChoice = "auto"
    interval: Interval = "wald"
    level: float = 0.95

    @property
    def pairs(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The items of each pair, i < j; shape (P,) each."""
        first, second = np.triu_indices(len(self.theta), 1)
        return first.astype(np.intp), second.astype(np.intp)

    @property
    def shared(self) -> bool:
        """Whether observers differ in what they compare."""
        return self.times.ndim == 2

    def design(self, observers: int) -> NDArray[np.int64]:
        """Return how often each observer compares each pair, shape (S, P)."""
        rows = np.atleast_2d(self.times)
        return np.asarray(rows[np.arange(observers) % len(rows)])

    def totals(self, observers: int) -> NDArray[np.int64]:
        """Return how often all observers together compare each pair, shape (P,)."""
        return self.design(observers).sum(axis=0) if self.shared else self.times * observers

    @property
    def by_observer(self) -> bool:
        """Whether answers are simulated observer by observer, not as one count for each pair."""
        return self.observer_sd > 0 or self.covariance != "model" or self.interval == "bootstrap"

    def kind(self, observers: int, *, separated: bool = False) -> CovarianceKind:
        """Return the kind of standard errors that a report on a study by so many observers has.

        ``separated`` says whether it is fitted by Firth's penalised likelihood.
        """
        if observers < 2 or self.covariance == "model":
            return "model"
        choice: CovarianceChoice = "auto" if separated else self.covariance
        return covariance_kind(choice, observers, len(self.items), "firth" if separated else "ml")

    @property
    def typical(self) -> Floats:
        """Shape (n,): log scores of the typical observer in nats, with mean 0.

        Raises
        ------
        ResultsError
            If ``theta`` is of the average answer, and no typical observer leads to it.
        """
        theta = np.asarray(self.theta - self.theta.mean())
        if self.scores_of == "typical" or self.observer_sd == 0:
            return theta
        typical, share = theta.copy(), LOGISTIC.flattening(self.observer_sd)
        first, second = self.pairs
        times = np.atleast_2d(self.times).mean(axis=0)
        for _ in range(MOST_STEPS):
            chances = LOGISTIC.mean_over_observers(typical[first] - typical[second], self.observer_sd).clip(0, 1)
            wins = np.zeros((len(theta), len(theta)))
            wins[first, second], wins[second, first] = times * chances, times * (1 - chances)
            off = theta - fit(wins).theta
            if not np.abs(off).max() > CLOSE_NATS:
                break
            typical += off / share
        if not np.abs(off).max() <= CLOSE_NATS:
            what = f"observers who differ by {self.observer_sd:g} nats do not give average scores so far apart"
            raise ResultsError(Finding(what, remedy="assume scores closer together, or a smaller --observer-sd"))
        return typical

    def chances(self, theta: Floats) -> Floats:
        """Return the probability that each pair's first item is preferred. Shapes (..., n) to (..., P)."""
        from scipy.special import expit

        first, second = self.pairs
        attentive = expit(theta[..., first] - theta[..., second])
        return np.asarray(attentive * (1 - self.lapse_rate) + self.lapse_rate / 2)

    def critical_z(self, observers: int) -> float:
        """Return the |z| at which a pair differs by the single-step maximum, under the assumed strengths.

        The joint law of all z depends on the strengths only weakly: one quantile serves all studies of a size.
        """
        n, (first, second) = len(self.theta), self.pairs
        totals = np.zeros((n, n))
        totals[first, second] = totals[second, first] = self.totals(observers)
        p = probabilities(self.theta)
        covariance = pseudo_inverse((totals * p * p.T)[None])[0]
        kind = self.kind(observers)
        if kind != "model":
            apart = np.eye(n) - 1 / n
            best = (covariance + self.observer_sd**2 / observers * apart)[None]
            none = np.zeros(1)
            spread = Spread(kind, best, covariance[None], none, none, observers - 1, none, best)
            largest = spread.largest(MAXZ_SAMPLES // 5, np.random.default_rng(MAXZ_SEED))
            return float(np.quantile(largest, 1 - self.alpha))
        grid = np.geomspace(0.01, 1e4, 20_001)
        small = np.flatnonzero(single_step(grid, covariance, MAXZ_SAMPLES) <= self.alpha)
        return float(grid[small[0]]) if len(small) else float("inf")


def check(plan: Plan) -> None:
    """Check that a plan can be simulated.

    Raises
    ------
    ResultsError
        If strengths are not finite, a number is out of range, or comparisons do not link all items.
    """
    check_level(plan.alpha)
    n = len(plan.items)
    if n < 2:
        raise ResultsError(Finding(f"there are {n} items to compare", remedy="compare two or more"))
    if not np.isfinite(plan.theta).all() or np.ptp(plan.theta) > FARTHEST_NATS:
        what = "the assumed scores are not finite, or too far apart to be simulated"
        raise ResultsError(Finding(what, remedy=f"assume scores within {FARTHEST_NATS:g} nats of each other"))
    if not (np.isfinite(plan.observer_sd) and 0 <= plan.observer_sd <= FARTHEST_NATS):
        raise ResultsError(Finding(f"observers' spread is {plan.observer_sd:g} nats", remedy="0 or a little more"))
    if not 0 <= plan.lapse_rate < 1:
        raise ResultsError(Finding(f"the share of lapses is {plan.lapse_rate:g}", remedy="give 0 or more, below 1"))
    groups = _linked(plan)
    if groups > 1:
        what = f"the pairs that are compared leave the items in {groups} groups without a common scale"
        raise ResultsError(Finding(what, remedy="compare items of different groups too"))


FARTHEST_NATS = 30.0
MOST_STEPS, CLOSE_NATS = 100, 1e-6


def _linked(plan: Plan) -> int:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, second = plan.pairs
    n = len(plan.theta)
    times = np.atleast_2d(plan.times).sum(axis=0)
    compared = times > 0
    graph = coo_array((times[compared], (first[compared], second[compared])), shape=(n, n)).tocsr()
    count, _ = connected_components(graph, directed=False)
    return int(count)
