"""Circular triads, ζ, Kendall's u and their tests: brute force, and p values that are uniform under chance."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations, product
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import binom

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.observers import concordance as concordance_module
from analysis.observers import consistency as module
from analysis.observers.concordance import disagreement_chances, kendall_u
from analysis.observers.consistency import (
    EXACT_UP_TO,
    circular_triads,
    consistencies,
    kendall_zeta,
    most_circular_triads,
    triad_chances,
)
from analysis.observers.tails import from_moments
from tests.kept import known

# Circular triads, ζ and its test: the dog, brute force, and p values that are uniform under chance.

Study = Callable[..., Comparisons]
Verdicts = NDArray[np.int8]
# Kendall and Babington Smith (1940): a dog's choices between six kinds of food.
DOG = ["011011", "000110", "010111", "100000", "000101", "010100"]


def drawn(n: int, seed: int, gaps: float = 0.0, ties: float = 0.0) -> tuple[Verdicts, NDArray[np.bool_]]:
    random = np.random.default_rng(seed)
    verdict = np.triu(random.choice(np.array([-1, 1], dtype=np.int8), (n, n)), 1)
    compared = np.triu(random.random((n, n)) >= gaps, 1)
    verdict[np.triu(random.random((n, n)) < ties, 1) | ~compared] = 0
    return verdict - verdict.T, compared | compared.T


def one_by_one(verdict: Verdicts, compared: NDArray[np.bool_]) -> tuple[float, int]:
    """Return circular triads and triads: each three items, and each way to break their ties, looked at."""
    circular, triads = 0.0, 0
    for three in combinations(range(len(verdict)), 3):
        pairs = [(three[0], three[1]), (three[1], three[2]), (three[2], three[0])]
        if not all(compared[pair] for pair in pairs):
            continue
        triads += 1
        ways = np.array(np.meshgrid(*([verdict[pair]] if verdict[pair] else [1, -1] for pair in pairs))).reshape(3, -1)
        circular += float((abs(ways.sum(axis=0)) == 3).mean())
    return circular, triads


def test_the_dog() -> None:
    answers = [
        Answer("ABCDEF"[row], "ABCDEF"[column])
        for row, line in enumerate(DOG)
        for column, won in enumerate(line)
        if won == "1"
    ]
    (dog,) = consistencies(from_answers(answers, "ABCDEF"))
    assert dog.circular == 5
    assert dog.triads == 20
    assert dog.zeta == pytest.approx(0.375, abs=1e-15)
    assert known(dog.test).p == pytest.approx((720 + 960 + 2240 + 2880 + 6240 + 3648) / 2**15, rel=1e-14)


@pytest.mark.parametrize(("n", "most"), [(3, 1), (4, 2), (5, 5), (6, 8), (7, 14), (8, 20), (9, 30), (10, 40)])
def test_zeta_is_0_where_there_are_as_many_as_there_can_be(n: int, most: int) -> None:
    assert most_circular_triads(n) == most
    if n <= 7:
        assert np.flatnonzero(triad_chances(n))[-1] == most


@settings(max_examples=25, deadline=None)
@given(st.integers(2, 7), st.integers(0, 10**6), st.sampled_from([0.0, 0.3]), st.sampled_from([0.0, 0.4]))
def test_counts_are_those_of_brute_force(n: int, seed: int, gaps: float, ties: float) -> None:
    verdict, compared = drawn(n, seed, gaps, ties)
    found = kendall_zeta(verdict, compared)
    circular, triads = one_by_one(verdict, compared)
    assert found.circular == pytest.approx(circular, abs=1e-12)
    assert found.triads == triads
    assert found.ties == (np.count_nonzero(compared) - np.count_nonzero(verdict)) // 2
    assert (found.zeta is None) == (n < 3 or not compared[np.triu_indices(n, 1)].all())
    order = np.random.default_rng(seed).permutation(n)
    again = kendall_zeta(verdict[np.ix_(order, order)], compared[np.ix_(order, order)])
    assert again.circular == pytest.approx(found.circular, abs=1e-12)
    assert (again.test is None) == (found.test is None)
    if again.test and found.test:
        assert again.test.p == pytest.approx(found.test.p, abs=1e-12)


@pytest.mark.parametrize(("gaps", "ties"), [(0.0, 0.0), (0.25, 0.0), (0.0, 0.3), (0.2, 0.2)])
def test_the_moments_are_those_of_all_coin_tosses(gaps: float, ties: float) -> None:
    verdict, compared = drawn(5, 3, gaps, ties)
    first, second = np.nonzero(np.triu(verdict))
    ways = (np.arange(2 ** len(first))[:, None] >> np.arange(len(first))) & 1
    tossed = np.zeros((len(ways), 5, 5), dtype=np.int8)
    tossed[:, first, second] = 2 * ways - 1
    counts = circular_triads(tossed - tossed.transpose(0, 2, 1), compared)
    variance, third = module._spread(verdict, compared)
    assert counts.mean() == pytest.approx(kendall_zeta(verdict, compared).triads / 4)
    assert variance == pytest.approx(counts.var())
    assert third == pytest.approx(((counts - counts.mean()) ** 3).mean())


def test_the_law_of_moments_is_kendalls_chi_square_and_near_the_exact_one() -> None:
    from scipy.stats import chi2

    n = EXACT_UP_TO + 1
    triads = comb(n, 3)
    exact = np.cumsum(triad_chances(n))
    df = n * (n - 1) * (n - 2) / (n - 4) ** 2
    for circular in range(most_circular_triads(n) + 1):
        tail = from_moments(circular, 0.5, triads / 4, 3 * triads / 16, -3 * triads * (n - 4) / 32)
        statistic = 8 / (n - 4) * (triads / 4 - circular - 0.5) + df
        assert tail.p == pytest.approx(chi2.sf(statistic, df), rel=1e-9)
        # Near the levels that matter it is within 4 %; far out it is too large, and never too small.
        assert tail.p >= 0.96 * exact[circular] - 1e-12
        if exact[circular] > 0.01:
            assert tail.p == pytest.approx(exact[circular], rel=0.04)


def test_repeated_pairs_count_once_by_majority_and_even_splits_as_ties() -> None:
    answers = [Answer("a", "b", 2), Answer("b", "a", 1), Answer("b", "c", 1), Answer("c", "b", 1), Answer("c", "a", 1)]
    (found,) = consistencies(from_answers(answers, "abc"))
    assert (found.circular, found.ties, found.zeta) == (0.5, 1, 0.5)
    undecided = Answer("a", "b", 9, tie=True)
    (same,) = consistencies(from_answers([*answers, undecided], "abc"))
    assert same == found
    (only,) = consistencies(from_answers([*answers[2:], undecided], "abc"))
    assert only.ties == 2


def test_two_items_and_untouched_items_leave_nothing_to_test() -> None:
    (two,) = consistencies(from_answers([Answer("a", "b", 3)]))
    assert (two.circular, two.triads, two.zeta, two.test) == (0, 0, None, None)
    both = consistencies(
        from_answers(
            [Answer("a", "b", 1, "01"), Answer("b", "c", 1, "01"), Answer("a", "c", 1, "01")]
            + [Answer("c", "d", 1, "02")]
        )
    )
    # Observer 01 never met d, and compared all of a, b and c.
    assert both[0].zeta == 1
    assert known(both[0].test).p == known(both[0].test).least_p == 0.75
    assert both[1].zeta is None


@pytest.mark.promise("believable-scores")
def test_consistent_observers_are_told_from_guessing_ones(study: Study) -> None:
    random = np.random.default_rng(4)
    theta = np.array([np.linspace(-4, 4, 8), np.zeros(8)])
    sure, guessing = consistencies(study(theta, random))
    assert known(sure.zeta) > 0.9
    assert known(sure.test).p < 0.001
    assert known(guessing.test).p > 0.01
    assert sure.to_json()["test"]["p"] == known(sure.test).p


def every_tournament(n: int) -> list[int]:
    """Return how many tournaments have 0, 1, 2, ... circular triads: each is built, and its triads looked at."""
    pairs = list(combinations(range(n), 2))
    counts = [0] * (comb(n, 3) + 1)
    for outcome in product((False, True), repeat=len(pairs)):
        beats = {pair: won for pair, won in zip(pairs, outcome, strict=True)}
        counts[sum(beats[a, b] == beats[b, c] != beats[a, c] for a, b, c in combinations(range(n), 3))] += 1
    return counts


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_all_tournaments(n: int) -> None:
    assert (triad_chances(n) * 2 ** comb(n, 2)).tolist() == every_tournament(n)


@pytest.mark.parametrize("n", [7, 8, EXACT_UP_TO])
def test_moments(n: int) -> None:
    chances = triad_chances(n)
    triads = comb(n, 3)
    values = np.arange(triads + 1)
    mean = values @ chances
    assert chances.sum() == pytest.approx(1, abs=1e-14)
    assert mean == pytest.approx(triads / 4)
    assert (values - mean) ** 2 @ chances == pytest.approx(3 * triads / 16)
    assert (values - mean) ** 3 @ chances == pytest.approx(-3 * triads * (n - 4) / 32)


# Kendall's u and its tests: brute force over observers and answers, and p values that are uniform under chance.

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


def concordance_one_by_one(outcomes: NDArray[np.object_]) -> tuple[int, int, int]:
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
    agree, disagree, shared = concordance_one_by_one(outcomes)
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
    assert known(found.chance).exact
    assert found.chi_square.p == pytest.approx(known(found.chance).p, abs=0.02)


def test_observers_of_one_mind_and_of_two() -> None:
    same = known(kendall_u(table(np.full((4, 6), 1, dtype=object), 4)))
    assert (same.u, same.disagreements) == (1, 0)
    assert known(same.chance).p == pytest.approx((2 * 0.5**4) ** 6)
    assert known(same.strangers_p) < 0.01
    opposed = known(kendall_u(table(np.array([[1] * 6, [-1] * 6], dtype=object), 4)))
    assert opposed.u == opposed.least == -1
    assert opposed.chi_square is None
    assert known(opposed.chance).p == 1
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
    monkeypatch.setattr(concordance_module, "MOST_STEPS", 0)
    for level in (0.001, 0.01, 0.05, 0.5):
        index = int(np.searchsorted(exact, level))
        found = concordance_module._chance(k, index)
        assert not found.exact
        assert found.p == pytest.approx(exact[index], rel=0.12 if level < 0.01 else 0.05)


@pytest.mark.promise("believable-scores")
def test_strangers_with_firm_tastes_of_their_own_do_not_agree(study: Study) -> None:
    random = np.random.default_rng(6)
    against_coins, against_strangers = [], []
    for _ in range(150):
        own = np.array([random.permutation(np.linspace(-8, 8, 9)) for _ in range(4)])
        found = known(kendall_u(study(own, random), shuffles=199))
        against_coins.append(known(found.chance).p <= 0.05)
        against_strangers.append(known(found.strangers_p) <= 0.05)
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
    found = concordance_module._renamed(verdict, order)
    assert found.dtype == np.int8
    np.testing.assert_array_equal(found, expected)
