"""Counts listed from matrices of wins, and spread over matrices again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from analysis.scaling import Counts
from analysis.scaling.counts import MOST_ITEMS_KEPT


@pytest.mark.parametrize("n", [7, MOST_ITEMS_KEPT, MOST_ITEMS_KEPT + 1])
@pytest.mark.parametrize("share", [0.02, 1.0])
def test_only_compared_pairs_are_listed_and_the_wins_come_back(n: int, share: float) -> None:
    random = np.random.default_rng(n)
    wins = random.integers(1, 5, (2, n, n)) * (random.random((2, n, n)) <= share) * (1.0 - np.eye(n))
    counts = Counts.from_wins(wins)
    happened = wins.any(axis=0)
    first, second = np.nonzero(np.triu(happened | happened.T, 1))
    assert counts.first.tolist() == first.tolist()
    assert counts.second.tolist() == second.tolist()
    assert (counts.wins() == wins).all()
    assert (counts.matrix(counts.total) == wins + wins.transpose(0, 2, 1)).all()


def test_a_pair_shown_in_both_orders_is_added() -> None:
    first, second = np.array([0, 1, 1]), np.array([1, 0, 2])
    won, lost = np.array([[3.0, 5, 1]]), np.array([[2.0, 7, 4]])
    counts = Counts(3, first, second, won, lost, np.zeros((1, 3)), ordered=True)
    assert counts.wins()[0].tolist() == [[0, 10, 0], [7, 0, 1], [0, 4, 0]]
    assert counts.matrix(won)[0].tolist() == [[0, 8, 0], [8, 0, 1], [0, 1, 0]]


def test_sparse_wins_are_listed_as_dense_ones() -> None:
    wins = np.array([[0.0, 3, 0], [1, 0, 0], [0, 2, 0]])
    dense, sparse = Counts.from_wins(wins[None]), Counts.from_sparse(csr_array(wins))
    assert (dense.wins() == sparse.wins()).all()
    assert dense.first.tolist() == sparse.first.tolist()
