"""Newton's method for the strengths of paired comparison: any law, penalty and design, many sets of counts at once.

For each pair the law gives the slope r and the information v of its log likelihood by the difference of strengths:

    g_i = Σ_j r_ij,  H = diag(Σ_j v) − v,  H s = g,  θ ← θ + s

s is taken with sum zero, and halved while the objective falls. A law's own parameter and an order effect border H: with
B the information between them and θ, and C their own, their step is found by the Schur complement C − Bᵀ H⁺ B. For
Bradley and Terry's law r = W_ij p_ji − W_ji p_ij and v = N p (1 − p), W counting wins and N = W + Wᵀ.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.covariance.laplacian import WIDEST_FOR_PLAIN_SUMS, grounded, lapack, pair_span
from analysis.scaling.conjugate_gradients import items_design
from analysis.scaling.counts import Counts
from analysis.scaling.designs import ITEMS, ModelDesign
from analysis.scaling.laws import EXPONENTIAL_FAMILY_STEP, LOGISTIC, NATS_PER_JND, Law, Slopes
from analysis.scaling.penalty import NO_PENALTY, Penalty
from documents import count_work
from documents.arrays import Flags, Floats

# Where Newton's iteration begins: near the log odds of each pair, or at the maximum of a plain table itself.
#
# For one table of wins by Bradley and Terry's law, with a strength for each item, Newton's steps need no list of pairs:
# with a = exp(θ), the chance that j is preferred over i is q = a_j / (a_i + a_j), and every sum is one over the matrix.
# `maximise` then takes its own step from there and judges whether that has converged; where a table is not plain, or a
# step is long, it begins near the log odds instead.

FARTHEST_START = 3.0  # JNDs
MOST_PLAIN_STEPS = 12
LAST_PLAIN_STEP = 1e-5  # the next would be below 1e-9, and the one after it below rounding


def log_odds(counts: Counts, law: Law, penalty: Penalty, design: ModelDesign) -> Floats:
    """Return the strengths nearest to each pair's own log odds, by least squares; shape (B, n).

    Half an answer is added to each side, ties are shared, and a pair weighs what its log odds then tell. Where some
    pair contradicts the others, so that the law knows little there, the strengths are equal instead.
    """
    shared = (counts.tied + 1) / 2 if law.parameter else 0.5
    first, second = counts.won + shared, counts.lost + shared
    both = first + second
    # N p (1 − p) with p = first / both, of all but the answer that was added.
    weight = first / both * second * ((both - 1) / both)
    odds = np.log(first / second) * (law.jnd / NATS_PER_JND)
    right = counts.net_flows(weight * odds, exact=False)[:, :, None]
    near = design.solve(counts, weight, penalty.precision, right, pair_span(weight))[:, :, 0]
    misses = np.abs(counts.differences(near) - odds).max(axis=1)
    if misses.max() <= FARTHEST_START * law.jnd:
        return near
    return np.where((misses <= FARTHEST_START * law.jnd)[:, None], near, 0.0)


def plain_maximum(wins: Floats) -> tuple[Floats, int] | None:
    """Return strengths at the maximum of Bradley and Terry's likelihood, by plain sums, and the steps taken.

    Parameters
    ----------
    wins
        Shape (n, n): how often the item of the row was preferred over that of the column; zero on the diagonal, the
        maximum finite.

    Returns
    -------
    Shape (n,), with mean 0; and how many steps. None where a step is long, or too many are needed.
    """
    n = len(wins)
    won, lost = np.add.reduce(wins, axis=1), np.add.reduce(wins, axis=0)
    theta = np.log((won + 0.5) / (lost + 0.5))
    total = wins + wins.T
    for steps in range(1, MOST_PLAIN_STEPS + 1):
        strength = np.exp(theta)
        behind = strength / np.add.outer(strength, strength)
        # g_i = Σ_j W_ij q_ij − W_ji q_ji; v_ij = N_ij q_ij q_ji.
        answers = wins * behind
        gradient = np.add.reduce(answers, axis=1) - np.add.reduce(answers, axis=0)
        weight = np.multiply(behind, total, out=answers)
        weight *= behind.T
        matrix, _ = grounded(weight, 0.0, weight)
        _, step, failed = lapack().dposv(matrix.T, gradient, lower=1, overwrite_a=1)
        longest = float(np.abs(step).max())
        if failed or not 2 * longest <= EXPONENTIAL_FAMILY_STEP:
            return None
        theta += step
        if longest <= LAST_PLAIN_STEP:
            return theta - np.add.reduce(theta) / n, steps
    return None


MOST_HALVINGS = 60
SHORT_STEP = 1e-3  # on a longer one nothing has converged
MOST_DENSE_ITEMS = 5000
MOST_PLAIN_ITEMS = 1024


class Point(NamedTuple):
    """Strengths ``theta`` (B, n), the law's parameter ``k`` and the order effect ``order``, each (B, 1)."""

    theta: Floats
    k: Floats
    order: Floats

    def moved(self, step: Point, share: Floats | None, *, bordered: bool) -> Point:
        """Return the point a ``share`` (B, 1) of a step away, or all of it."""
        if not bordered:
            return Point(self.theta + (step.theta if share is None else share * step.theta), self.k, self.order)
        part = np.ones((1, 1)) if share is None else share
        return Point(self.theta + part * step.theta, self.k + part * step.k, self.order + part * step.order)

    def select(self, replicates: Flags) -> Point:
        """Return some of the replicates."""
        return Point(self.theta.T[:, replicates].T, self.k[replicates], self.order[replicates])


class _State:
    """A point with its differences ``d`` (B, m), and what the law says there, each computed once and only if asked."""

    __slots__ = ("_slopes", "_terms", "d", "point")

    def __init__(self, point: Point, d: Floats) -> None:
        self.point, self.d = point, d
        self._slopes: Slopes | None = None
        self._terms: Floats | None = None

    def slopes(self, counts: Counts, law: Law) -> Slopes:
        """Return the slopes of the plain likelihood."""
        if self._slopes is None:
            self._slopes = law.slopes(counts, self.d, self.point.k)
        return self._slopes

    def terms(self, counts: Counts, law: Law) -> Floats:
        """Return the log likelihood of each pair, shape (B, m)."""
        if self._terms is None:
            self._terms = law.log_likelihood(counts, self.d, self.point.k)
        return self._terms

    def added(self, counts: Counts, law: Law, penalty: Penalty) -> Floats:
        """Return what the penalty adds, shape (B,)."""
        return penalty.value(counts, self.point.theta, lambda: self.slopes(counts, law))

    def select(self, replicates: Flags) -> _State:
        return _State(self.point.select(replicates), self.d.T[:, replicates].T)


class Maximum(NamedTuple):
    """Where the iteration ended, for each of B sets of counts.

    Attributes
    ----------
    theta
        Shape (B, n): strengths with mean 0.
    k, order
        Shape (B, 1): the law's parameter and the order effect; 0 where there is none.
    log_likelihood
        Shape (B,): Σ W log p, without binomial coefficients and without the penalty.
    iterations, converged
        Shape (B,): Newton steps taken, and whether the last one was below the tolerance.
    """

    theta: Floats
    k: Floats
    order: Floats
    log_likelihood: Floats
    iterations: NDArray[np.intp]
    converged: Flags

    @property
    def point(self) -> Point:
        """Where it ended."""
        return Point(self.theta, self.k, self.order)


def maximise(
    counts: Counts,
    law: Law = LOGISTIC,
    *,
    penalty: Penalty = NO_PENALTY,
    design: ModelDesign | None = None,
    start: Floats | None = None,
    most_iterations: int | None = None,
) -> Maximum:
    """Maximise the likelihood of each set of counts, or the penalised one. The maximum must exist.

    Parameters
    ----------
    counts
        As `analysis.scaling.separation.find_separation` wants them. Replicates leave the iteration as they converge.
    penalty
        As `analysis.scaling.penalty` has it.
    design
        What the strengths are free to do; by default each item has its own, and conjugate gradients solve where few of
        many pairs were compared. Where the pairs' weights then span so many orders of magnitude that θ could not be
        exact to 1e-10, dense equations take over; above 5000 items the fit is returned as not converged.
    start
        Shape (B, n): where to begin, with mean 0; by default as `analysis.scaling.newton` finds it.
    most_iterations
        Steps from near the log odds after which the rest stops without having converged; by default the penalty's.

    Examples
    --------
    >>> import numpy as np
    >>> from analysis.scaling import Probit
    >>> counts = Counts.from_wins(np.array([[[0.0, 84], [16, 0]]]))
    >>> maximise(counts, Probit()).theta.round(3).tolist()  # Φ(0.994) = 0.84
    [[0.497, -0.497]]
    """
    count_work("models_fitted", len(counts.won))
    steps = penalty.most_iterations if most_iterations is None else most_iterations
    chosen = items_design(counts) if design is None else design
    if start is None and most_iterations is None and _is_plain(counts, law, penalty, chosen):
        plain = plain_maximum(counts.wins()[0])
        if plain is not None:
            top = _iterated(counts, law, penalty, chosen, plain[0][None], steps)
            return _joined(top, top.iterations + plain[1], top.converged)
    theta = log_odds(counts, law, penalty, chosen) if start is None else start
    top = _iterated(counts, law, penalty, chosen, theta, steps)
    if chosen.is_exact:
        return top
    if counts.n > MOST_DENSE_ITEMS:
        return _joined(top, top.iterations, np.zeros_like(top.converged))
    dense = _iterated(counts, law, penalty, ITEMS, theta, steps)
    return _joined(dense, dense.iterations + top.iterations, dense.converged)


def joint_covariance(
    counts: Counts, law: Law, point: Point, penalty: Penalty = NO_PENALTY, design: ModelDesign = ITEMS
) -> Floats:
    """Return the inverse of the observed information at ``point``: of θ, then of the further parameters.

    Shape (B, n + f, n + f), on strengths that sum to zero; with a Gaussian prior, of the posterior's curvature. Firth's
    penalty adds nothing, as is usual.
    """
    slopes = law.slopes(counts, counts.differences(point.theta, point.order), point.k)
    inverse = design.covariance(counts, slopes.dd, penalty.precision)
    if not (law.parameter or counts.ordered):
        return inverse
    border, corner, _ = border_of(counts, law, slopes)
    # The inverse of [[H, B], [Bᵀ, C]] by blocks, S = C − Bᵀ H⁺ B being the Schur complement:
    # its corner S⁻¹, its border −H⁺ B S⁻¹, and H⁺ + H⁺ B S⁻¹ Bᵀ H⁺.
    across = inverse @ border
    own = np.linalg.inv(corner - border.transpose(0, 2, 1) @ across)
    block = -across @ own
    upper = np.concatenate([inverse - block @ across.transpose(0, 2, 1), block], axis=2)
    joint = np.concatenate([upper, np.concatenate([block.transpose(0, 2, 1), own], axis=2)], axis=1)
    return np.asarray((joint + joint.transpose(0, 2, 1)) / 2)


def _is_plain(counts: Counts, law: Law, penalty: Penalty, design: ModelDesign) -> bool:
    """Say whether this is one table of Bradley and Terry's law that `plain_maximum` takes."""
    known = law is LOGISTIC and penalty is NO_PENALTY and design is ITEMS
    return known and len(counts.won) == 1 and counts.n <= MOST_PLAIN_ITEMS and not counts.ordered


def _joined(top: Maximum, iterations: NDArray[np.intp], converged: Flags) -> Maximum:
    return Maximum(top.theta, top.k, top.order, top.log_likelihood, iterations, converged)


def _iterated(counts: Counts, law: Law, penalty: Penalty, design: ModelDesign, theta: Floats, steps: int) -> Maximum:
    batch, n = theta.shape
    nothing = np.zeros((batch, 1))
    bordered = bool(law.parameter) or counts.ordered
    point = Point(theta, law.start(counts) if law.parameter else nothing, nothing)
    state = _State(point, counts.differences(theta))
    ended: Maximum | None = None
    active = np.arange(batch)
    before: Floats | float = np.nan
    for iteration in range(1, steps + 1):
        # H s = g, then θ ← θ + s, halved where the objective falls.
        step = _step(counts, law, penalty, design, state)
        largest = np.maximum.reduce(np.abs(step.theta), axis=1)
        if bordered:
            largest = np.maximum(largest, np.maximum(np.abs(step.k), np.abs(step.order))[:, 0])
        longest = float(largest[0] if len(largest) == 1 else largest.max())
        if not math.isfinite(longest):
            # No step from equations that could not be solved: such a set of counts ends as not converged.
            lost = ~np.isfinite(largest)
            step.theta[lost], step.k[lost], step.order[lost] = 0.0, 0.0, 0.0
        state = _climb(counts, law, penalty, state, step, longest)
        if longest > SHORT_STEP and iteration < steps and (batch == 1 or largest.min() > SHORT_STEP):
            before = largest
            continue
        # Relative to the largest strength, which rounding grows with.
        scale = np.maximum.reduce(np.abs(state.point.theta), axis=1, initial=1.0)
        settled = penalty.has_settled(largest / scale, before / scale)
        done = settled if math.isfinite(longest) else settled | lost
        if iteration == steps or done.any():
            theta, k, order = state.point
            centred = theta - np.add.reduce(theta, axis=1, keepdims=True) / n
            likelihood = np.add.reduce(state.terms(counts, law), axis=1)
            reached = Maximum(centred, k, order, likelihood, np.full(len(theta), iteration), settled)
            if ended is None:
                ended = reached
            else:
                for whole, part in zip(ended, reached, strict=True):
                    whole[active] = part
            left = ~done
            if not left.any():
                break
            active = active[left]
            counts, state, largest = counts.select(left), state.select(left), largest[left]
        before = largest
    if ended is None:
        raise ValueError("no step was allowed")
    return ended


def _step(counts: Counts, law: Law, penalty: Penalty, design: ModelDesign, state: _State) -> Point:
    point = state.point
    slopes = penalty.slopes(counts, state.d, state.slopes(counts, law))
    bordered = bool(law.parameter) or counts.ordered
    weight = slopes.dd
    ratio = pair_span(weight)
    exact = bordered or counts.n * ratio > WIDEST_FOR_PLAIN_SUMS
    # g_i = Σ_j r_ij, less what a normal prior pulls back, θ_i / σ².
    gradient = counts.net_flows(slopes.d, exact=exact)
    if penalty.precision:
        gradient = gradient - penalty.precision * point.theta
    if not bordered:
        theta = design.solve(counts, weight, penalty.precision, gradient[:, :, None], ratio)[:, :, 0]
        return Point(theta, point.k, point.order)  # both 0, and stay so
    # With the border B: H (toward, across) = (g, B); the Schur complement C − Bᵀ H⁺ B gives the further step from its
    # right side g_k − Bᵀ H⁺ g, and θ's own step is then toward − across · further.
    border, corner, own = border_of(counts, law, slopes)
    right = np.concatenate([gradient[:, :, None], border], axis=2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        solved = design.solve(counts, weight, penalty.precision, right - right.mean(axis=1, keepdims=True), ratio)
        toward, across = solved[:, :, :1], solved[:, :, 1:]
        back = border.transpose(0, 2, 1)
        further: Floats = np.linalg.solve(corner - back @ across, own[:, :, None] - back @ toward).astype(np.float64)
        theta = (toward - across @ further)[:, :, 0]
    nothing = np.zeros((len(theta), 1))
    k = further[:, 0] if law.parameter else nothing
    return Point(theta, k, further[:, -1] if counts.ordered else nothing)


def border_of(counts: Counts, law: Law, slopes: Slopes) -> tuple[Floats, Floats, Floats]:
    """Return the information between θ and f further parameters (B, n, f), theirs (B, f, f), and their slope (B, f)."""
    dd, dk, kk, d, k = (part.sum(axis=1) for part in (slopes.dd, slopes.dk, slopes.kk, slopes.d, slopes.k))
    columns, own = [], []
    if law.parameter:
        columns.append(counts.net_flows(slopes.dk))
        own.append(k)
    if counts.ordered:
        columns.append(counts.net_flows(slopes.dd))
        own.append(d)
    if len(own) == 2:
        corner = np.stack([np.stack([kk, dk], axis=1), np.stack([dk, dd], axis=1)], axis=2)
    else:
        corner = (kk if law.parameter else dd)[:, None, None]
    return np.stack(columns, axis=2), corner, np.stack(own, axis=1)


def _climb(counts: Counts, law: Law, penalty: Penalty, state: _State, step: Point, largest: float) -> _State:
    """Go along ``step``, halved for each replicate whose objective falls by more than rounding.

    ``largest`` is that of the step's numbers. No difference changes by more than twice as much, or by four times as
    much with further parameters; where the law is known not to fall on so short a step, nothing is compared.
    """
    bordered = bool(law.parameter) or counts.ordered
    share: Floats | None = None
    ahead = _moved(counts, state, step, share, bordered=bordered)
    if (4 if bordered else 2) * largest <= law.safe_step and penalty.has_constant_curvature:
        return ahead
    terms, added = state.terms(counts, law), state.added(counts, law, penalty)
    slack = penalty.slack(np.abs(added) - terms.sum(axis=1))  # no term is above 0
    for _ in range(MOST_HALVINGS):
        # Differences of single terms, not of sums: a gain far below the likelihood itself is not lost in rounding.
        gained = (ahead.terms(counts, law) - terms).sum(axis=1) + (ahead.added(counts, law, penalty) - added)
        falls = gained < -slack
        if not falls.any():
            break
        share = np.ones((len(falls), 1)) if share is None else share
        share[falls] /= 2
        ahead = _moved(counts, state, step, share, bordered=bordered)
    return ahead


def _moved(counts: Counts, state: _State, step: Point, share: Floats | None, *, bordered: bool) -> _State:
    point = state.point.moved(step, share, bordered=bordered)
    return _State(point, counts.differences(point.theta, point.order))
