"""Kendall's u and its tests: brute force over observers and answers, and p values that are uniform under chance."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import binom

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.observers import concordance as module
from analysis.observers.concordance import disagreement_chances, kendall_u
from tests.kept import known

Study = Callable[..., Comparisons]
Outcome = int | None  # 1: the first of the pair, -1: the second, 0: a tie; None: not answered


def table(outcomes: NDArray[np.object_], n: int) -> Comparisons:
    """Build comparisons from outcomes by observer and pair, shape (S, pairs)."""
    answers = []
    for person, row in enumerate(outcomes):
        for (one, other), outcome in zip(combinations(range(n), 2), row, strict=True):
            if outcome is not None:
                winner, loser = (one, other) if outcome >= 0 else (other, one)
                answers.append(Answer(f"i{winner}", f"i{loser}", 1.0, f"{person:02d}", tie=outcome == 0))
    return from_answers(answers, [f"i{item}" for item in range(n)])


def one_by_one(outcomes: NDArray[np.object_]) -> tuple[int, int, int]:
    """Return agreements, disagreements and how often two observers answered the same pair, each looked at in turn."""
    agree = disagree = shared = 0
    for one, other in combinations(outcomes, 2):
        for a, b in zip(one, other, strict=True):
            if a is not None and b is not None:
                shared += 1
                agree += a * b == 1
                disagree += a * b == -1
    return agree, disagree, shared


@settings(max_examples=25, deadline=None)
@given(
    st.integers(2, 5),
    st.integers(1, 5),
    st.integers(0, 10**6),
    st.sampled_from([[1, -1], [1, -1, 0], [1, -1, 0, None]]),
)
def test_it_is_counted_as_by_hand(n: int, people: int, seed: int, kinds: list[Outcome]) -> None:
    random = np.random.default_rng(seed)
    outcomes = np.array(kinds, dtype=object)[random.integers(len(kinds), size=(people, n * (n - 1) // 2))]
    agree, disagree, shared = one_by_one(outcomes)
    if all(outcome is None for outcome in outcomes.flat):
        return
    found = kendall_u(table(outcomes, n), shuffles=0)
    if not shared:
        assert found is None
        return
    assert found is not None
    assert (found.agreements, found.disagreements, found.shared) == (agree, disagree, shared)
    assert found.u == pytest.approx((agree - disagree) / shared)
    assert found.least - 1e-12 <= found.u <= 1
    shuffled = table(outcomes[random.permutation(people)], n)
    again = known(kendall_u(shuffled, shuffles=0))
    assert again.u == pytest.approx(found.u)
    assert (again.chance is None) == (found.chance is None)
    if again.chance and found.chance:
        assert again.chance.p == pytest.approx(found.chance.p)


def test_kendalls_formula() -> None:
    random = np.random.default_rng(8)
    m, n = 7, 5
    outcomes = random.choice(np.array([1, -1], dtype=object), (m, n * (n - 1) // 2))
    comparisons = table(outcomes, n)
    found = known(kendall_u(comparisons, shuffles=0))
    # Kendall and Babington Smith (1940), from the table of preferences.
    count = comparisons.wins[~np.eye(n, dtype=bool)]
    both = (count * (count - 1) / 2).sum()
    assert found.u == pytest.approx(2 * both / (m * (m - 1) / 2 * n * (n - 1) / 2) - 1)
    assert found.least == pytest.approx(-1 / m)
    assert found.chi_square is not None
    expected = n * (n - 1) / 2 * m * (m - 1) / 2 / 2 * (m - 3) / (m - 2)
    assert found.chi_square.statistic == pytest.approx(4 / (m - 2) * (both - 1 - expected))
    assert found.chi_square.df == pytest.approx(n * (n - 1) / 2 * m * (m - 1) / (m - 2) ** 2)
    assert found.chance is not None
    assert found.chance.exact
    assert found.chi_square.p == pytest.approx(found.chance.p, abs=0.02)


def test_observers_of_one_mind_and_of_two() -> None:
    same = known(kendall_u(table(np.full((4, 6), 1, dtype=object), 4)))
    assert (same.u, same.disagreements) == (1, 0)
    assert same.chance is not None
    assert same.chance.p == pytest.approx((2 * 0.5**4) ** 6)
    assert same.strangers_p is not None
    assert same.strangers_p < 0.01
    opposed = known(kendall_u(table(np.array([[1] * 6, [-1] * 6], dtype=object), 4)))
    assert opposed.u == opposed.least == -1
    assert opposed.chi_square is None
    assert opposed.chance is not None
    assert opposed.chance.p == 1
    assert opposed.to_json()["u"] == -1


def test_nobody_to_agree_with() -> None:
    assert kendall_u(table(np.full((1, 3), 1, dtype=object), 3)) is None
    apart = np.array([[1, None, None], [None, 1, None]], dtype=object)
    assert kendall_u(table(apart, 3)) is None
    only_ties = known(kendall_u(table(np.array([[1, 0, 0], [None, 0, 0]], dtype=object), 3)))
    assert (only_ties.u, only_ties.chance, only_ties.observers) == (0, None, 2)


def test_the_exact_law_is_that_of_all_answers() -> None:
    k = np.array([4, 3, 2])
    counts = np.zeros(4 + 2 + 1 + 1)
    for tosses in product((1, -1), repeat=int(k.sum())):
        start, disagreements = 0, 0
        for people in k:
            mine = tosses[start : start + people]
            disagreements += mine.count(1) * mine.count(-1)
            start += people
        counts[disagreements] += 1
    assert disagreement_chances(k) == pytest.approx(counts / counts.sum(), abs=1e-15)
    assert disagreement_chances(np.full(10, 2)) == pytest.approx(binom(10, 0.5).pmf(np.arange(11)), rel=1e-12)


@pytest.mark.parametrize("k", [np.full(45, 30), np.array([3, 4, 5, 6, 7] * 6), np.full(400, 2)])
def test_the_law_of_moments_is_near_the_exact_one(k: NDArray[np.int64], monkeypatch: pytest.MonkeyPatch) -> None:
    chances = disagreement_chances(k)
    exact = np.cumsum(chances)
    monkeypatch.setattr(module, "MOST_STEPS", 0)
    for level in (0.001, 0.01, 0.05, 0.5):
        index = int(np.searchsorted(exact, level))
        found = module._chance(k, index)
        assert not found.exact
        assert found.p == pytest.approx(exact[index], rel=0.12 if level < 0.01 else 0.05)


@pytest.mark.promise("believable-scores")
def test_strangers_with_firm_tastes_of_their_own_do_not_agree(study: Study) -> None:
    random = np.random.default_rng(6)
    against_coins, against_strangers = [], []
    for _ in range(150):
        own = np.array([random.permutation(np.linspace(-8, 8, 9)) for _ in range(4)])
        found = known(kendall_u(study(own, random), shuffles=199))
        assert found.chance is not None
        assert found.strangers_p is not None
        against_coins.append(found.chance.p <= 0.05)
        against_strangers.append(found.strangers_p <= 0.05)
    # Firm tastes hang together over the pairs: too often they look like agreement when held against coins.
    assert np.mean(against_coins) > 0.15
    assert np.mean(against_strangers) <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 150)


def test_the_observed_order_and_equal_shuffles_count() -> None:
    # Opposed on their one pair: no shuffle agrees less, so that all count, and the observed order with them.
    opposed = known(kendall_u(table(np.array([[1], [-1]], dtype=object), 2), shuffles=9))
    assert opposed.strangers_p == 1
    same = known(kendall_u(table(np.array([[1] * 15] * 5, dtype=object), 6), shuffles=9))
    assert same.strangers_p == 0.1


def test_strangers_need_every_pair() -> None:
    gap = known(kendall_u(table(np.array([[1, 1, None], [1, 1, 1]], dtype=object), 3)))
    assert gap.strangers_p is None
    assert gap.chi_square is None
    same = kendall_u(table(np.full((3, 6), 1, dtype=object), 4))
    assert same == kendall_u(table(np.full((3, 6), 1, dtype=object), 4))


@pytest.mark.parametrize("n", [2, 3, 11, 40])
def test_items_are_renamed_as_number_by_number(n: int) -> None:
    random = np.random.default_rng(n)
    above = np.triu(random.integers(-1, 2, (n, n)), 1).astype(np.int8)
    verdict = above - above.T
    order = np.array([random.permutation(n) for _ in range(7)])
    expected = np.array([[[verdict[one, other] for other in names] for one in names] for names in order])
    found = module._renamed(verdict, order)
    assert found.dtype == np.int8
    np.testing.assert_array_equal(found, expected)
