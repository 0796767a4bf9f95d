"""Every observer's own linear equations at once: items of few pairs are eliminated, what is left is solved densely.

An observer's effects b have the posterior precision Q / τ², with Q = I + Laplacian(w): items are the nodes of a network
whose pairs conduct w = τ² v, and each item conducts 1 to the ground. An item with few neighbours is eliminated by the
star-mesh transform: with conductances w_k to its neighbours and c to the ground, D = Σ w_k + c,

    between two neighbours  + w_k w_m / D,   from a neighbour to the ground  + w_k c / D.

Only sums of positive numbers appear, as in `analysis.covariance.laplacian` [Grassmann1985]. Items that are no
neighbours are eliminated at once, for all observers, in rounds. What is left, little of a sparse design and all of a
complete one, is a small dense matrix for each observer. Running back through the rounds gives means, and variances and
covariances along every pair that was compared [Takahashi1973], without the inverse of a large matrix.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from documents.arrays import Floats, Indices

CHUNK_BYTES = 16 * 2**20
FEW_NEIGHBOURS, MOST_NEIGHBOURS = 2, 3
WIDER = 1.1
NONE = -1


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """Nodes eliminated together, none a neighbour of another: x of them with at most D neighbours each.

    Attributes
    ----------
    node
        Shape (x,).
    neighbour, pair
        Shape (D, x): neighbours, and the pairs to them. A missing neighbour is the node N, a missing pair the one after
        the last: both conduct nothing.
    corners, between
        Any two of the D neighbours, c of them in all, and the pairs between those, shape (c, x).
    """

    node: Indices
    neighbour: Indices
    pair: Indices
    corners: tuple[tuple[int, int], ...]
    between: Indices


@dataclass(frozen=True, slots=True, eq=False)
class Dense:
    """What is left of some observers: nodes (B, k), padded with node N; pairs, and their places in (B, k, k)."""

    node: Indices
    pair: Indices
    place: Indices
    mirror: Indices


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Posterior of the effects, in units of τ: with Q = I + Laplacian(w) and a right side h.

    Attributes
    ----------
    mean, variance
        Shape (N,): Q⁻¹ h and the diagonal of Q⁻¹.
    pair_variance
        Shape (E,): variance of the difference of each pair's effects.
    """

    mean: Floats
    variance: Floats
    pair_variance: Floats


class Blocks:
    """The networks of all observers: N nodes, one for each item that an observer compared, and E pairs of nodes.

    Parameters
    ----------
    first, second
        Shape (E,): the nodes of each pair, no pair twice.
    block
        Shape (N,): the observer of each node, from 0, in rising order.
    item
        Shape (N,): the item of each node, below ``items``.
    """

    def __init__(self, first: Indices, second: Indices, block: Indices, item: Indices, items: int) -> None:
        self.first, self.second, self.block, self.item, self.items = first, second, block, item, items
        self.nodes, self.pairs = len(block), len(first)
        self.rounds, left = _rounds(self.nodes, first, second)
        self.all_pairs = left.all_pairs
        self.dense = tuple(_dense(self.nodes, block, left))

    def solve(self, conductance: Floats, right: Floats) -> Solution:
        """Solve for ``conductance`` (E,), at least zero, and ``right`` (N,)."""
        ground, w, h, pivots = self._eliminated(conductance, right)
        n = self.nodes
        mean, variance, covariance = np.zeros(n + 1), np.zeros(n + 1), np.zeros(self.all_pairs + 1)
        for dense in self.dense:
            # What no round took: the inverse itself.
            inverse = np.linalg.inv(_matrix(dense, ground, w))
            mean[dense.node] = (inverse @ h[dense.node][:, :, None])[:, :, 0]
            variance[dense.node] = np.diagonal(inverse, axis1=1, axis2=2)
            covariance[dense.pair] = inverse.reshape(-1)[dense.place]
        mean[n] = variance[n] = 0.0
        for rank, pivot in zip(reversed(self.rounds), reversed(pivots), strict=True):
            # Back through the rounds. With t_k = w_k / D: x = h / D + Σ t_k x_k, and [Takahashi1973]
            # cov(x, m) = Σ_k t_k cov(k, m), var(x) = 1 / D + Σ_m t_m cov(x, m).
            x, toward = rank.node, w[rank.pair] / pivot
            among = np.empty((len(toward), *toward.shape))
            for k, neighbour in enumerate(rank.neighbour):
                among[k, k] = variance[neighbour]
            for (k, m), between in zip(rank.corners, rank.between, strict=True):
                among[k, m] = among[m, k] = covariance[between]
            across = np.einsum("kx,kmx->mx", toward, among)
            mean[x] = h[x] / pivot + (toward * mean[rank.neighbour]).sum(axis=0)
            variance[x] = 1 / pivot + (toward * across).sum(axis=0)
            covariance[rank.pair] = across
        both = variance[self.first] + variance[self.second] - 2 * covariance[: self.pairs]
        return Solution(mean[:n], variance[:n], both)

    def log_determinant(self, conductance: Floats) -> float:
        """Return the log of the determinant of all Q together."""
        ground, w, _, pivots = self._eliminated(conductance, np.zeros(self.nodes))
        left = (np.linalg.slogdet(_matrix(dense, ground, w))[1] for dense in self.dense)
        return sum(float(part.sum()) for part in (*(np.log(pivot) for pivot in pivots), *left))

    def links(self, conductance: Floats) -> Floats:
        """Return the sum over observers of Q⁻¹ off its diagonal, shape (items, items), the diagonal zero.

        Divided by τ² these are the weights of a graph whose Laplacian is the information that the population's
        strengths have: Σ (I − Q⁻¹) / τ².
        """
        total = np.zeros((self.items + 1, self.items + 1))
        for _, root in self._roots(conductance, self._shared):
            flat = root.reshape(self.items + 1, -1)
            total += flat @ flat.T
        np.fill_diagonal(total, 0.0)
        return total[:-1, :-1]

    def roots(self, conductance: Floats) -> Iterator[tuple[int, Floats]]:
        """Yield, for some observers at a time, the first of them and R with Q⁻¹ = R Rᵀ.

        R has the shape (items + 1, observers, items + 1); rows and columns of items that an observer did not compare
        are zero, and so are the last ones. With the eliminated items Q⁻¹ = T D⁻¹ Tᵀ, T being triangular in the order
        of elimination; the root of what is left is by Cholesky's decomposition.
        """
        return self._roots(conductance, np.append(self.item, self.items))

    @cached_property
    def _shared(self) -> Indices:
        """Columns of R, but for those of the first round: each has one entry, which is on the diagonal of Q⁻¹."""
        kept = np.ones(self.nodes, np.bool_)
        if self.rounds:
            kept[self.rounds[0].node] = False
        column = np.cumsum(kept) - 1
        starts = np.searchsorted(self.block, np.arange(int(self.block[-1]) + 1))
        before = np.append(0, np.cumsum(kept))[starts]
        column -= before[self.block]
        width = int(column[kept].max(initial=-1)) + 1
        return np.append(np.where(kept, column, width), width)

    def _roots(self, conductance: Floats, column: Indices) -> Iterator[tuple[int, Floats]]:
        """As `roots`, with the columns (N + 1,) of the nodes; nodes of the last column, which is zero, have none."""
        n, width = self.items, int(column[-1])
        ground, w, _, pivots = self._eliminated(conductance, np.zeros(self.nodes))
        left = [(self.block[dense.node[:, 0]], dense.node, _root(dense, ground, w)) for dense in self.dense]
        item = np.append(self.item, n)
        observers = int(self.block[-1]) + 1
        most = max(1, CHUNK_BYTES // (8 * n * n))
        for start in range(0, observers, most):
            size = min(most, observers - start)
            root = np.zeros((n + 1, size, width + 1))
            for who, node, part in left:
                low, high = np.searchsorted(who, (start, start + size))
                rows, columns = item[node[low:high]], column[node[low:high]]
                root[rows[:, :, None], (who[low:high] - start)[:, None, None], columns[:, None, :]] = part[low:high]
            root[n], root[:, :, width] = 0.0, 0.0  # what blocks are padded with
            for rank, pivot in zip(reversed(self.rounds), reversed(pivots), strict=True):
                low, high = np.searchsorted(self.block[rank.node], (start, start + size))
                some = slice(int(low), int(high))
                x = rank.node[some]
                own, row = self.block[x] - start, item[x]
                toward = w[rank.pair[:, some]] / pivot[some]
                neighbours = item[rank.neighbour[:, some]]
                # A row of T D⁻½: the neighbours' rows by t_k, and its own 1 / √D.
                root[row, own] = sum(to[:, None] * root[y, own] for to, y in zip(toward, neighbours, strict=True))
                root[row, own, column[x]] = 1 / np.sqrt(pivot[some])
            root[:, :, width] = 0.0
            yield start, root

    def _eliminated(self, conductance: Floats, right: Floats) -> tuple[Floats, Floats, Floats, list[Floats]]:
        """Return conductances to the ground and of pairs, right sides, and the pivots D of each round."""
        ground, h = np.ones(self.nodes + 1), np.append(right, 0.0)
        w = np.zeros(self.all_pairs + 1)
        w[: self.pairs] = conductance
        pivots = []
        for rank in self.rounds:
            x, to_each = rank.node, w[rank.pair]
            # D = Σ w_k + c.
            pivot = to_each.sum(axis=0) + ground[x]
            toward = to_each / pivot
            for (k, m), between in zip(rank.corners, rank.between, strict=True):
                # Star to mesh: between two neighbours + w_k w_m / D.
                np.add.at(w, between, toward[k] * to_each[m])
            for share, y in zip(toward, rank.neighbour, strict=True):
                # From a neighbour to the ground + w_k c / D; the right side flows on likewise, + w_k h / D.
                np.add.at(ground, y, share * ground[x])
                np.add.at(h, y, share * h[x])
            pivots.append(pivot)
        return ground, w, h, pivots


def _matrix(dense: Dense, ground: Floats, w: Floats) -> Floats:
    size, width = dense.node.shape
    matrix = np.zeros((size, width, width))
    flat = matrix.reshape(-1)
    flat[dense.place] = flat[dense.mirror] = -w[dense.pair]
    matrix.reshape(size, -1)[:, :: width + 1] = ground[dense.node] - matrix.sum(axis=2)
    return matrix


def _root(dense: Dense, ground: Floats, w: Floats) -> Floats:
    """Return R with R Rᵀ the inverse of what is left."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(_matrix(dense, ground, w))).transpose(0, 2, 1))


@dataclass(frozen=True, slots=True, eq=False)
class _Left:
    """The nodes left after all rounds; their pairs (ends and numbers), and how many pairs there are in all."""

    node: Indices
    first: Indices
    second: Indices
    number: Indices
    all_pairs: int


def _rounds(nodes: int, first: Indices, second: Indices) -> tuple[list[Round], _Left]:
    """Plan the elimination. New pairs are numbered after the given ones."""
    random = np.random.default_rng(0)
    a, b, number = first, second, np.arange(len(first))
    alive, all_pairs = np.ones(nodes, dtype=np.bool_), len(first)
    ranks: list[Round] = []
    while True:
        degree = np.bincount(a, minlength=nodes) + np.bincount(b, minlength=nodes)
        fewest = max(FEW_NEIGHBOURS, int(degree[alive].min(initial=nodes)))
        able = alive & (degree <= fewest)
        if fewest > MOST_NEIGHBOURS or not able.any():
            return ranks, _Left(np.flatnonzero(alive), a, b, number, all_pairs)
        # Of neighbours that could go, the one with the lowest random number goes.
        turn = np.where(able, random.permutation(nodes), nodes)
        lowest = turn.copy()
        np.minimum.at(lowest, a, turn[b])
        np.minimum.at(lowest, b, turn[a])
        node = np.flatnonzero(able & (lowest == turn))
        place = np.full(nodes, NONE)
        place[node] = np.arange(len(node))
        neighbour, pair = np.full((fewest, len(node)), nodes), np.full((fewest, len(node)), NONE)
        ends, others, numbers = np.concatenate([a, b]), np.concatenate([b, a]), np.concatenate([number, number])
        own = np.flatnonzero(place[ends] >= 0)
        own = own[np.argsort(ends[own], kind="stable")]
        at = place[ends[own]]
        which = np.arange(len(own)) - np.searchsorted(at, at)  # the how manieth pair of its node, as `at` rises
        neighbour[which, at], pair[which, at] = others[own], numbers[own]
        alive[node] = False
        kept = (place[a] < 0) & (place[b] < 0)
        a, b, number = a[kept], b[kept], number[kept]
        corners = tuple(combinations(range(fewest), 2))
        low, high = np.sort(neighbour[np.array(corners).T], axis=0)
        between = np.full(low.shape, NONE)
        filled = high < nodes
        old = np.minimum(a, b) * nodes + np.maximum(a, b)
        new = low[filled] * nodes + high[filled]
        # Pairs that were there keep their numbers; those that elimination makes get the next ones.
        keys, index = np.unique(np.concatenate([old, new]), return_inverse=True)
        merged = np.full(len(keys), NONE)
        merged[index[: len(old)]] = number
        fresh = np.flatnonzero(merged < 0)
        merged[fresh] = all_pairs + np.arange(len(fresh))
        all_pairs += len(fresh)
        between[filled] = merged[index[len(old) :]]
        a, b, number = keys // nodes, keys % nodes, merged
        ranks.append(Round(node, neighbour, pair, corners, between))


def _dense(nodes: int, block: Indices, left: _Left) -> Iterator[Dense]:
    """Put what is left of observers with about as many nodes together, as much as stays small in memory."""
    owners, start, width = np.unique(block[left.node], return_index=True, return_counts=True)
    local = np.full(nodes, NONE)
    local[left.node] = np.arange(len(left.node)) - np.repeat(start, width)
    order = np.argsort(width, kind="stable")
    owner, owner_of_pair = (np.searchsorted(owners, block[node]) for node in (left.node, left.first))
    first = 0
    while first < len(order):
        last = int(np.searchsorted(width[order], WIDER * width[order[first]] + 1, side="right"))
        k = int(width[order[last - 1]])
        last = min(last, first + max(1, CHUNK_BYTES // (8 * k * k)))
        chosen = np.sort(order[first:last])
        k, first = int(width[chosen].max()), last
        row = np.full(len(owners), NONE)
        row[chosen] = np.arange(len(chosen))
        node = np.full((len(chosen), k), nodes)
        own = left.node[row[owner] >= 0]
        node[row[owner[row[owner] >= 0]], local[own]] = own
        mine = np.flatnonzero(row[owner_of_pair] >= 0)
        corner, i, j = row[owner_of_pair[mine]] * k, local[left.first[mine]], local[left.second[mine]]
        yield Dense(node, left.number[mine], (corner + i) * k + j, (corner + j) * k + i)
