"""The observer bootstrap [Efron1993]: observers drawn with replacement, all their answers with them.

Answers of one observer depend on each other; answers of two do not. So observers are drawn, not answers. The counts of
all replicates come from one product of matrices and are fitted in blocks, so that memory stays bounded.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap.fits import Fits, fit_each
from analysis.comparisons.comparisons import Comparisons, split_groups
from analysis.errors import ResultsError, naming
from analysis.scaling.fitting import fit
from analysis.scaling.result import Fit, Method
from analysis.scaling.separation import are_connected
from documents import Finding, count_work
from documents.arrays import Flags, Floats

Name = Literal["theta", "score", "log10_score", "difference"]
NAMES: tuple[Name, ...] = get_args(Name)
REPLICATES = 1000
SEED = 2016
BLOCK_NUMBERS = 1_000_000
LIMITS = {"theta": (-np.inf, np.inf), "score": (0.0, 1.0), "log10_score": (-np.inf, 0.0)}


@dataclass(frozen=True, slots=True, eq=False)
class Quantity:
    """A function of the strengths with k values.

    ``name`` is ``theta`` (nats, mean 0), ``score`` (softmax of θ), ``log10_score`` (k = n each), or ``difference``
    (θ_i − θ_j in nats, k pairs). ``first`` and ``second``, shape (k,), index the items of each pair; for the others
    both are the items themselves.
    """

    name: Name
    first: NDArray[np.intp]
    second: NDArray[np.intp]

    @classmethod
    def of_items(cls, name: Name, n: int) -> Quantity:
        """Return ``name`` of every item, or of every pair i < j of ``n`` items."""
        if name not in NAMES:
            raise ResultsError(Finding(f"there is no quantity '{name}'", remedy="expected one of: " + ", ".join(NAMES)))
        if name == "difference":
            first, second = np.triu_indices(n, 1)
            return cls(name, first.astype(np.intp), second.astype(np.intp))
        return cls(name, np.arange(n), np.arange(n))

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the largest value that there can be."""
        return LIMITS.get(self.name, (-np.inf, np.inf))

    def parts(self, most: int) -> Iterator[Quantity]:
        """Yield the same in parts of at most ``most`` values."""
        for start in range(0, len(self.first), max(1, most)):
            chosen = slice(start, start + max(1, most))
            yield Quantity(self.name, self.first[chosen], self.second[chosen])

    def values(self, theta: Floats) -> Floats:
        """Return the values at ``theta``. Shapes (..., n) to (..., k)."""
        from scipy.special import log_softmax

        if self.name == "difference":
            return np.asarray(theta[..., self.first] - theta[..., self.second])
        if self.name == "theta":
            return np.asarray(theta[..., self.first])
        log_score = log_softmax(theta, axis=-1)[..., self.first]
        return np.asarray(np.exp(log_score) if self.name == "score" else log_score / np.log(10))

    def slopes(self, theta: Floats, steps: Floats) -> Floats:
        """Return the change of the values along ``steps``, to first order. Shapes (B, n), (B, S, n) to (B, S, k)."""
        from scipy.special import softmax

        if self.name == "difference":
            return np.asarray(steps[..., self.first] - steps[..., self.second])
        if self.name == "theta":
            return np.asarray(steps[..., self.first])
        scores = softmax(theta, axis=-1)[:, None, :]
        relative = (steps - (scores * steps).sum(axis=-1, keepdims=True))[..., self.first]
        return np.asarray(scores[..., self.first] * relative if self.name == "score" else relative / np.log(10))


@dataclass(frozen=True, slots=True, eq=False)
class Replicates:
    """Strengths of n items in R draws of S observers, and with each observer left out.

    Attributes
    ----------
    items, observers
        Names of the items, and of the observers in the order in which ``weights`` counts them: by name, so that the
        order of files and lines changes nothing.
    by_observer
        Shape (S, n, n): each observer's counts.
    fit
        The fit to all answers.
    whole_separated
        Whether all answers together have no maximum of the plain likelihood, so that ``fit`` is Firth's of necessity.
        Observers who agree without exception agree in every draw: the draws then say too little.
    weights
        Shape (R, S): how often each observer was drawn.
    theta
        Shape (R, n): strengths in nats; NaN where ``without_fit``.
    separated
        Shape (R,): fitted by Firth's penalised likelihood because no maximum of the plain one exists.
    without_fit
        Shape (R,): comparisons do not link all items. Such a replicate counts on both sides of every interval, which
        it widens.
    left_out
        The fits with one observer left out, S of them, in the order of ``observers``.
    seed, method
        What the draws started from, and how replicates are fitted where possible.
    """

    items: tuple[str, ...]
    observers: tuple[str, ...]
    by_observer: Floats
    fit: Fit
    whole_separated: bool
    weights: Floats
    theta: Floats
    separated: Flags
    without_fit: Flags
    left_out: Fits
    seed: int
    method: Method


def resample(
    comparisons: Comparisons,
    *,
    replicates: int = REPLICATES,
    seed: int = SEED,
    method: Method = "ml",
) -> Replicates:
    """Draw the observers of ``comparisons`` with replacement, ``replicates`` times, and fit each draw.

    Parameters
    ----------
    replicates
        At least 1; 1000 fix the ends of a 95 % interval to about 3 % of its width.
    seed
        The same seed gives the same draws.
    method
        ``ml`` or ``firth``. With ``ml``, replicates that are separated are fitted by Firth's.

    Returns
    -------
    Replicates
        The strengths of each draw.

    Raises
    ------
    ResultsError
        If there are fewer than two observers, or all answers together have no fit by ``method``.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> answers = [
    ...     Answer(*pair, observer=str(observer))
    ...     for observer in range(6)
    ...     for pair in ("ab", "ab", "ba", "bc", "bc", "cb", "ac", "ac", "ca")
    ... ]
    >>> resample(from_answers(answers), replicates=20).theta.shape
    (20, 3)
    """
    by_observer, observers = counts_by_observer(comparisons)
    return resample_counts(
        by_observer,
        comparisons.items,
        observers,
        replicates=replicates,
        seed=seed,
        method=method,
    )


def resample_groups(
    comparisons: Comparisons,
    *,
    replicates: int = REPLICATES,
    seed: int = SEED,
    method: Method = "ml",
) -> tuple[tuple[str, Replicates], ...]:
    """As `resample`, for each group of ``comparisons`` on a scale of its own, with the same draws for all groups.

    Parameters
    ----------
    comparisons
        Answers within groups, such as scenes.
    replicates, seed, method
        As for `resample`. Replicate r of every group has the same observers, those of them who judged the group.

    Returns
    -------
    tuple[tuple[str, Replicates], ...]
        The name of each group with its draws, in the order of the groups; empty without groups.

    Raises
    ------
    ResultsError
        As `resample`, with the group's name.

    Examples
    --------
    >>> from analysis.bootstrap import class_stability
    >>> from analysis.comparisons import Answer, from_answers
    >>> pairs = ("ab", "ab", "ba", "bc", "bc", "cb", "ac", "ac", "ca")
    >>> answers = [
    ...     Answer(*pair, observer=str(observer), group=group)
    ...     for observer in range(6)
    ...     for group in ("church", "beach")
    ...     for pair in pairs
    ... ]
    >>> draws = resample_groups(from_answers(answers), replicates=20)
    >>> [(name, class_stability(part).class_counts) for name, part in draws]
    [('church', {1: 20}), ('beach', {1: 20})]
    """
    names = sorted(comparisons.observers)
    weights = draw_observers(len(names), replicates, seed)
    drawn = []
    for group, part in split_groups(comparisons):
        with naming(f"the group '{group}'"):
            by_observer, observers = counts_by_observer(part)
            own = weights[:, np.isin(names, observers)]
            drawn.append(
                (group, resample_counts(by_observer, part.items, observers, seed=seed, method=method, weights=own))
            )
    return tuple(drawn)


def resample_counts(
    by_observer: Floats,
    items: Sequence[str],
    observers: Sequence[str],
    *,
    replicates: int = REPLICATES,
    seed: int = SEED,
    method: Method = "ml",
    weights: Floats | None = None,
) -> Replicates:
    """As `resample`, from each observer's counts, shape (S, n, n), S at least 2.

    ``weights`` (replicates, S) are how often each observer is drawn, where they were drawn before.
    """
    if replicates < 1:
        raise ResultsError(Finding(f"{replicates} replicates were asked for", remedy="ask for 1000"))
    whole = fit(by_observer.sum(axis=0), method=method)
    if whole.separated or not whole.converged:
        remedy = "use the method 'firth', which needs comparisons that link all items"
        raise ResultsError(
            Finding("the items are separated: there are no strengths to put intervals on", remedy=remedy)
        )
    people = len(observers)
    weights = draw_observers(people, replicates, seed) if weights is None else weights
    each = [fit_each(wins, method) for wins in blocks(by_observer, weights)]
    others = [fit_each(wins, method) for wins in blocks(by_observer, None)]
    drawn, left_out = _joined(each), _joined(others)
    return Replicates(
        items=tuple(items),
        observers=tuple(observers),
        by_observer=by_observer,
        fit=whole,
        whole_separated=not bool(are_connected(by_observer.sum(axis=0)[None])[0]),
        weights=weights,
        theta=drawn.theta,
        separated=drawn.separated,
        without_fit=drawn.without_fit,
        left_out=left_out,
        seed=seed,
        method=method,
    )


def counts_by_observer(comparisons: Comparisons) -> tuple[Floats, tuple[str, ...]]:
    """Return each observer's counts (S, n, n) and name, by name.

    Raises
    ------
    ResultsError
        If there are fewer than two observers.
    """
    if len(comparisons.observers) < 2:
        who = "one observer" if comparisons.observers and comparisons.observers[0] else "no observer named"
        remedy = "add the column 'observer' with two or more observers, or use the model's standard errors"
        raise ResultsError(Finding(f"there is {who}: there is nobody to draw", remedy=remedy))
    order = sorted(range(len(comparisons.observers)), key=lambda index: comparisons.observers[index])
    return comparisons.wins_by_observer()[order], tuple(comparisons.observers[index] for index in order)


def draw_observers(people: int, replicates: int, seed: int) -> Floats:
    """Return how often each observer is drawn in each replicate, shape (replicates, people); rows sum to people."""
    count_work("bootstrap_draws", replicates)
    random = np.random.default_rng(seed)
    return random.multinomial(people, np.full(people, 1 / people), replicates).astype(np.float64)


def blocks(by_observer: Floats, weights: Floats | None) -> Iterator[Floats]:
    """Yield the counts of the replicates, shape (block, n, n), at most ``BLOCK_NUMBERS`` numbers at a time.

    ``weights`` (R, S) are how often each observer counts in each replicate; None leaves each observer out in turn.
    """
    people, n, _ = by_observer.shape
    size = max(1, BLOCK_NUMBERS // max(n**2, people))
    flat = by_observer.reshape(people, n * n)
    for start in range(0, people if weights is None else len(weights), size):
        if weights is None:
            rows = np.arange(start, min(start + size, people))
            own = (np.arange(people) != rows[:, None]).astype(np.float64)
        else:
            own = weights[start : start + size]
        yield (own @ flat).reshape(-1, n, n)


def _joined(each: list[Fits]) -> Fits:
    return Fits(
        theta=np.concatenate([part.theta for part in each]),
        separated=np.concatenate([part.separated for part in each]),
        without_fit=np.concatenate([part.without_fit for part in each]),
    )
