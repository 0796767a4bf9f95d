"""Elimination for all observers at once against one dense inverse."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.hierarchical.elimination import Blocks


@pytest.mark.parametrize(
    ("observers", "items", "pairs"),
    [(5, 6, 200), (4, 30, 30), (3, 10, 9), (3, 3, 9), (6, 12, 20), (2, 60, 75), (1, 2, 1)],
)
def test_means_variances_and_links_are_those_of_the_inverse(observers: int, items: int, pairs: int) -> None:
    random = np.random.default_rng(items)
    drawn = random.integers(items, size=(pairs * observers, 2))
    drawn = np.sort(drawn[drawn[:, 0] != drawn[:, 1]], axis=1)
    who = random.integers(observers, size=len(drawn))
    key = np.unique((who * items + drawn[:, 0]) * items + drawn[:, 1]) if items > 2 else np.array([1])
    who, low, high = key // items**2, key // items % items, key % items
    who = np.unique(who, return_inverse=True)[1]
    nodes, place = np.unique(np.r_[who * items + low, who * items + high], return_inverse=True)
    first, second = place[: len(key)], place[len(key) :]
    blocks = Blocks(first, second, nodes // items, nodes % items, items)

    w, right = random.exponential(2, len(key)), random.normal(size=len(nodes))
    matrix = np.eye(len(nodes))
    for (a, b), weight in zip(zip(first, second, strict=True), w, strict=True):
        matrix[[a, b, a, b], [a, b, b, a]] += weight * np.array([1, 1, -1, -1])
    inverse = np.linalg.inv(matrix)
    links = np.zeros((items, items))
    for block in range(int(nodes[-1]) // items + 1):
        own = np.flatnonzero(blocks.block == block)
        links[np.ix_(blocks.item[own], blocks.item[own])] += inverse[np.ix_(own, own)]
    np.fill_diagonal(links, 0)

    solution = blocks.solve(w, right)
    np.testing.assert_allclose(solution.mean, inverse @ right, atol=1e-13)
    np.testing.assert_allclose(solution.variance, np.diag(inverse), atol=1e-13)
    apart = inverse[first, first] + inverse[second, second] - 2 * inverse[first, second]
    np.testing.assert_allclose(solution.pair_variance, apart, atol=1e-13)
    np.testing.assert_allclose(blocks.links(w), links, atol=1e-13)
    assert blocks.log_determinant(w) == pytest.approx(np.linalg.slogdet(matrix)[1], abs=1e-10)


def test_a_tree_needs_no_dense_equations_and_a_complete_design_nothing_else() -> None:
    chain = np.arange(9)
    assert not Blocks(chain, chain + 1, np.zeros(10, np.intp), np.arange(10), 10).dense
    low, high = np.triu_indices(6, 1)
    complete = Blocks(low, high, np.zeros(6, np.intp), np.arange(6), 6)
    assert not complete.rounds
    assert complete.dense[0].node.shape == (1, 6)
