"""What each observer moves the strengths by, and the covariances clustered by observer that follow [White1982].

With A the inverse information and u_s the gradient of observer s's log likelihood at the fit, d_s = A u_s, and
Σ d_s d_sᵀ is right also where one observer's answers depend on each other. It needs no answer to count once: weights,
such as similarities, only have to be right on average.

The fit follows each observer, so that their u_s are too small. With K_s the observer's share of the information, in
coordinates in which all of it is the identity, CR2 [Bell2002] multiplies u_s by (I − K_s)^(−½): that is √(S/(S − 1))
where all S observers compared the same. Beyond some size each observer has one factor, √(1/(1 − k_s)) with k_s the mean
of K_s's diagonal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.covariance.laplacian import SLOPE_ROUNDING, differences_of, without_rounding
from analysis.errors import ResultsError
from analysis.scaling.counts import Answers, Counts
from analysis.scaling.laws import Law, Slopes
from analysis.scaling.newton import Point
from documents import Finding
from documents.arrays import Floats

MOST_WORK = 3e8  # observers times the cube of parameters: a second or so
MOST_EXACT = 300  # strengths and further parameters
FEWEST_FREE = 1e-3
MOST_LEVERAGE = 0.99  # of an observer who alone compared something: their u_s is 0 along it


@dataclass(frozen=True, slots=True, eq=False)
class Contributions:
    """What S observers move n strengths and f further parameters by.

    Attributes
    ----------
    pulled
        Shape (S, n + f): d_s, corrected by CR2, so that Σ d_s d_sᵀ is the covariance.
    products
        Shape (S, S): d_s H d_t, H being the information; with more observers than parameters H Σ d_s d_sᵀ in its
        place, which has the same eigenvalues but for zeros. None where there are further parameters.
    root
        Shape (n + f, r): of the model's covariance A = R Rᵀ; None where there are too many items.
    leverages
        Shape (S, r, r): K_s; None where observers compared the same, or there is too much of it.
    shares
        Shape (S,): k_s, which sum to 1.
    """

    pulled: Floats
    products: Floats | None
    root: Floats | None
    leverages: Floats | None
    shares: Floats
    _of_pairs: list[Floats] = field(default_factory=list, init=False, repr=False)

    @property
    def freedom(self) -> float:
        """One less than the effective number of observers, 1/Σ k_s²."""
        return max(float(1 / (self.shares**2).sum()) - 1, FEWEST_FREE)

    def pair_freedom(self, n: int) -> Floats:
        """Return `degrees_of_freedom` of θ_i − θ_j, for i < j of the ``n`` strengths, computed once."""
        if not self._of_pairs:
            first, second = np.triu_indices(n, 1)
            width = self.pulled.shape[1]
            self._of_pairs.append(self.degrees_of_freedom(lambda: differences_of(width, first, second), len(first)))
        return self._of_pairs[0]

    def degrees_of_freedom(self, contrasts: Callable[[], Floats], number: int) -> Floats:
        """Return Satterthwaite's degrees of freedom of the variance of each contrast, if the law is right [Bell2002].

        ``contrasts()`` has the shape (k, n + f), k being ``number``; it is only called where it is needed. They are
        twice the square of the variance estimate's mean over its variance: one less than the number of observers where
        all compared the same.
        """
        if self.leverages is None or self.root is None:
            return np.full(number, self.freedom)
        people, rank = len(self.pulled), self.root.shape[1]
        if number * people * rank * (rank + people) > 10 * MOST_WORK:
            return np.full(number, self.freedom)
        shares, axes = np.linalg.eigh(self.leverages)
        shares = np.clip(shares, 0, MOST_LEVERAGE)
        back = axes.transpose(0, 2, 1)
        moved = (axes * (shares / np.sqrt(1 - shares))[:, None, :]) @ back
        squares = (axes * (shares / (1 - shares))[:, None, :]) @ back
        along = contrasts() @ self.root
        freedom = np.empty(number)
        size = max(1, int(2e6 / (people * max(rank, people))))
        for start in range(0, number, size):
            part = along[start : start + size]
            q = np.einsum("kr,srt->kst", part, moved, optimize=True)
            own = np.einsum("kst,kst->ks", q, q)
            diagonal = np.einsum("kr,srt,kt->ks", part, squares, part, optimize=True) - own
            # Of Q Qᵀ and Qᵀ Q, which have the same squares in all, the smaller.
            gram = q.transpose(0, 2, 1) @ q if people > rank else q @ q.transpose(0, 2, 1)
            trace, across = diagonal.sum(axis=1), (gram**2).sum(axis=(1, 2)) - (own**2).sum(axis=1)
            total = (diagonal**2).sum(axis=1) + across
            freedom[start : start + size] = np.divide(trace**2, total, out=np.ones_like(trace), where=total > 0)
        return np.maximum(freedom, FEWEST_FREE)


def contributions(counts: Counts, answers: Answers, law: Law, point: Point, joint: Floats) -> Contributions:
    """Return what each observer moves the estimates by; ``joint`` is the inverse information, shape (n + f, n + f).

    Raises
    ------
    ResultsError
        If there are fewer than two observers.
    """
    slopes = _slopes_of_answers(counts, law, point)
    who, observer = np.unique(answers.observer, return_inverse=True)
    people = len(who)
    if people < 2:
        what = "a covariance clustered by observer needs the answers of at least two observers"
        raise ResultsError(Finding(what, remedy="name observers in the table, or ask for --covariance model"))
    gradients, given = _gradients(counts, answers, law, slopes, observer, people)
    same = _same_design(counts, answers, slopes, observer, people)
    shares = np.full(people, 1 / people) if same else _shares(counts, answers, slopes, joint, observer, people)
    # After a penalised fit gradients do not sum to zero: each has its share of the penalty's. Alike ones then round.
    # In place, as below: with 20,000 observers of 1000 items each array of this shape is 160 MB.
    gradients -= shares[:, None] * gradients.sum(axis=0)
    given *= SLOPE_ROUNDING  # as `without_rounding`
    gradients[~(np.abs(gradients) > given)] = 0.0
    del given
    root = leverages = None
    if len(joint) <= MOST_EXACT:
        values, vectors = np.linalg.eigh(joint)
        kept = values > values[-1] * 1e-12
        root = vectors[:, kept] * np.sqrt(values[kept])
    if root is not None and not same and people * root.shape[1] ** 3 <= MOST_WORK:
        leverages = _leverages(counts, answers, slopes, root, observer)
        own, axes = np.linalg.eigh(leverages)
        stretch = 1 / np.sqrt(1 - np.clip(own, 0, MOST_LEVERAGE))
        along = np.einsum("srt,sr->st", axes, gradients @ root)
        along = np.einsum("srt,st->sr", axes, stretch * along)
        pulled, products = along @ root.T, along @ along.T if people <= along.shape[1] else along.T @ along
    else:
        gradients /= np.sqrt(1 - np.minimum(shares, MOST_LEVERAGE))[:, None]
        pulled = gradients @ joint
        products = pulled @ gradients.T if people <= len(joint) else joint @ (gradients.T @ gradients)
    further = len(joint) > counts.n
    return Contributions(pulled, None if further else products, root, leverages, shares)


def observer_slopes(counts: Counts, answers: Answers, law: Law, point: Point) -> Floats:
    """Return the gradient of each observer's log likelihood, shape (S, n + f); observers without answers left out."""
    slopes = _slopes_of_answers(counts, law, point)
    who, observer = np.unique(answers.observer, return_inverse=True)
    return without_rounding(*_gradients(counts, answers, law, slopes, observer, len(who)))


def _slopes_of_answers(counts: Counts, law: Law, point: Point) -> Slopes:
    """Return the derivatives of one answer to each pair, shape (3, m): won, lost and tied."""
    d = counts.differences(point.theta, point.order)
    won, lost, tied = (np.broadcast_to(np.eye(3)[:, [kind]], (3, d.shape[1])) for kind in range(3))
    single = Counts(counts.n, counts.first, counts.second, won, lost, tied, counts.ordered)
    return law.slopes(single, np.broadcast_to(d, won.shape), point.k)


def _gradients(
    counts: Counts, answers: Answers, law: Law, slopes: Slopes, observer: NDArray[np.intp], people: int
) -> tuple[Floats, Floats]:
    """Return the gradient of each observer's log likelihood, and how many answers each number sums; (S, n + f)."""
    flow = slopes.d[answers.outcome, answers.pair] * answers.count
    n = counts.n
    of_first = observer * n + counts.first[answers.pair]
    of_second = observer * n + counts.second[answers.pair]
    slope = np.bincount(of_first, flow, people * n)
    slope -= np.bincount(of_second, flow, people * n)
    given: Floats = np.asarray(np.bincount(of_first, answers.count, people * n), np.float64)
    given += np.bincount(of_second, answers.count, people * n)
    columns: list[Floats] = [np.asarray(slope, np.float64).reshape(people, n)]
    if law.parameter:
        by_parameter = np.bincount(observer, slopes.k[answers.outcome, answers.pair] * answers.count, people)
        columns.append(np.asarray(by_parameter[:, None], np.float64))
    if counts.ordered:
        columns.append(np.asarray(np.bincount(observer, flow, people)[:, None], np.float64))
    if len(columns) == 1:
        return columns[0], given.reshape(people, n)
    own = np.broadcast_to(np.bincount(observer, answers.count, people)[:, None], (people, len(columns) - 1))
    return np.hstack(columns), np.hstack([given.reshape(people, n), own])


def _shares(
    counts: Counts, answers: Answers, slopes: Slopes, joint: Floats, observer: NDArray[np.intp], people: int
) -> Floats:
    """Return each observer's share of the information about strengths, which sum to 1."""
    n = counts.n
    covariance = joint[:n, :n]
    variance = np.diag(covariance)
    spread = variance[counts.first] + variance[counts.second] - 2 * covariance[counts.first, counts.second]
    weight = np.maximum(slopes.dd[answers.outcome, answers.pair], 0) * answers.count * spread[answers.pair]
    shares = np.bincount(observer, weight, people)
    return np.asarray(shares / max(shares.sum(), np.finfo(np.float64).tiny), dtype=np.float64)


def _same_design(counts: Counts, answers: Answers, slopes: Slopes, observer: NDArray[np.intp], people: int) -> bool:
    """Say whether all observers gave as many answers to each pair, and what they say leaves the information alone."""
    pairs = len(counts.first)
    if not np.array_equal(slopes.dd[0], slopes.dd[1]) or people * pairs > len(answers.pair) * 4:
        return False
    given = np.bincount(observer * pairs + answers.pair, answers.count, people * pairs).reshape(people, pairs)
    return bool((given == given[0]).all())


def _leverages(counts: Counts, answers: Answers, slopes: Slopes, root: Floats, observer: NDArray[np.intp]) -> Floats:
    """Return K_s = Rᵀ I_s R of each observer, shape (S, r, r); I_s is their own observed information."""
    n, people = counts.n, int(observer.max()) + 1
    rows = root[counts.first] - root[counts.second]
    if counts.ordered:
        rows = rows + root[-1]
    k = root[n] if len(root) - counts.ordered > n else None  # the law's own parameter
    rank = root.shape[1]
    leverages = np.zeros((people, rank, rank))
    order = np.argsort(observer, kind="stable")
    ends = np.searchsorted(observer[order], np.arange(people + 1))
    dd, dk, kk = slopes.dd, slopes.dk, slopes.kk
    for person in range(people):
        chosen = order[ends[person] : ends[person + 1]]
        pair, outcome, count = answers.pair[chosen], answers.outcome[chosen], answers.count[chosen]
        own = rows[pair]
        leverages[person] = (own * (dd[outcome, pair] * count)[:, None]).T @ own
        if k is not None:
            across = np.outer((dk[outcome, pair] * count) @ own, k)
            leverages[person] += across + across.T + float(kk[outcome, pair] @ count) * np.outer(k, k)
    return leverages
