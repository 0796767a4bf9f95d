"""Perceptual classes against the thesis, a published display, and the definition."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.choices import Adjust
from analysis.classes import Conclusion, classify
from analysis.classes.classes import TooManyClasses, letter_display, numbered
from analysis.classes.conclusions import concluded
from analysis.errors import ResultsError
from analysis.scaling import fit, probabilities

# Medina 2016, Table 4.4: samples 8 2 7 1 5 9 3 10 4 6.
PRINTED = np.array([0.0296, 0.0432, 0.0543, 0.0718, 0.0740, 0.0751, 0.0762, 0.1149, 0.2036, 0.2574])
PRINTED_CLASSES = ("5", "4", "3+4", "3", "3", "3", "3", "2", "1", "1")


def differing(n: int, same: list[tuple[int, int]]) -> NDArray[np.bool_]:
    differs = ~np.eye(n, dtype=bool)
    for first, second in same:
        differs[first, second] = differs[second, first] = False
    return differs


def graphs(n: int = 7) -> st.SearchStrategy[NDArray[np.bool_]]:
    pairs = list(combinations(range(n), 2))
    return st.lists(st.booleans(), min_size=len(pairs), max_size=len(pairs)).map(
        lambda same: differing(n, [pair for pair, is_same in zip(pairs, same, strict=True) if is_same])
    )


def expected_counts() -> NDArray[np.float64]:
    wins = 30 * probabilities(np.log(PRINTED))
    np.fill_diagonal(wins, 0)
    return wins


def test_table_4_4_gives_back_its_classes() -> None:
    fitted = fit(expected_counts())
    classes = classify(fitted.theta, fitted.covariance, alpha=0.045, adjust="none")
    assert classes.labels == PRINTED_CLASSES
    assert classes.p[0, 1] == pytest.approx(0.038, abs=5e-4)
    assert classes.p[2, 6] == pytest.approx(0.049, abs=5e-4)


def test_table_4_4_under_benjamini_hochberg_puts_sample_2_in_two_classes() -> None:
    fitted = fit(expected_counts())
    classes = classify(fitted.theta, fitted.covariance, alpha=0.05, adjust="bh")
    assert len(classes.members) == 5
    assert classes.labels[1] == "4+5"


def test_a_chain_of_three_pairs_has_the_published_letters() -> None:
    letters = letter_display(differing(5, [(0, 1), (1, 2), (2, 3)]))
    members = numbered(letters, np.array([5.0, 4, 3, 2, 1]))
    assert members == ((0, 1), (1, 2), (2, 3), (4,))


@pytest.mark.promise("believable-scores")
@given(graphs())
def test_items_share_a_class_if_and_only_if_they_do_not_differ(differs: NDArray[np.bool_]) -> None:
    letters = letter_display(differs)
    for first, second in combinations(range(len(differs)), 2):
        shared = any(first in letter and second in letter for letter in letters)
        assert shared == (not differs[first, second])
    assert set().union(*letters) == set(range(len(differs)))


def swept_one_by_one(columns: list[int], n: int) -> tuple[frozenset[int], ...]:
    """Drop columns, then memberships, by how many columns have both items of each pair: the slow, obvious twin."""
    kept = [[item for item in range(n) if column >> item & 1] for column in columns]
    kept.sort(key=lambda column: (len(column), column))
    shared = np.zeros((n, n), dtype=int)
    for column in kept:
        shared[np.ix_(column, column)] += 1
    for place, column in enumerate(kept):
        if (shared[np.ix_(column, column)] > 1).all():
            shared[np.ix_(column, column)] -= 1
            kept[place] = []
    for column in kept:
        for item in tuple(column):
            if (shared[item, column] > 1).all():
                shared[item, column] -= 1
                column.remove(item)
                shared[column, item] -= 1
    return tuple(frozenset(column) for column in kept if column)


def along_a_line(n: int, reach: float, seed: int) -> NDArray[np.bool_]:
    """Return items that differ where they are far apart on a scale, each with an error of its own."""
    random = np.random.default_rng(seed)
    theta, error = random.normal(size=n), random.gamma(2, size=n)
    return np.asarray(np.abs(theta[:, None] - theta) > reach * np.sqrt(error[:, None] + error) * ~np.eye(n, dtype=bool))


MANY = [pytest.param(n, reach, marks=pytest.mark.stress) for n, reach in ((300, 0.02), (300, 0.4), (1000, 0.1))]


@pytest.mark.parametrize(("n", "reach"), [(0, 0.1), (1, 0.1), (63, 0.1), (64, 0.3), (65, 0.05), (150, 0.1), *MANY])
def test_the_sweep_of_all_pairs_at_once_leaves_what_that_of_each_pair_leaves(
    monkeypatch: pytest.MonkeyPatch, n: int, reach: float
) -> None:
    for seed in range(5):
        random = np.random.default_rng(seed).random((n, n))
        differs = along_a_line(n, reach, seed) ^ ((random + random.T < 0.2) & ~np.eye(n, dtype=bool) & (n < 100))
        letters = letter_display(differs)
        with monkeypatch.context() as patch:
            patch.setattr("analysis.classes.classes._swept", swept_one_by_one)
            assert letters == letter_display(differs)


@settings(max_examples=25)
@given(st.permutations(range(10)), st.sampled_from(["none", "holm", "bh"]))
def test_the_order_of_the_items_does_not_matter(order: list[int], adjust: Adjust) -> None:
    wins = expected_counts()
    straight, shuffled = fit(wins), fit(wins[np.ix_(order, order)])
    known = classify(straight.theta, straight.covariance, alpha=0.045, adjust=adjust)
    found = classify(shuffled.theta, shuffled.covariance, alpha=0.045, adjust=adjust)
    assert found.labels == tuple(known.labels[item] for item in order)


def test_class_1_holds_the_best_item_and_equal_items_share_one() -> None:
    assert classify(np.zeros(4), np.eye(4) - 0.25).labels == ("1", "1", "1", "1")
    apart = classify(np.array([-50.0, 50.0, 0.0]), np.eye(3) - 1 / 3)
    assert apart.labels == ("3", "1", "2")


def test_so_many_classes_are_named_and_no_more() -> None:
    """Items in groups that differ within alone make as many on the way as the product of the groups' sizes."""

    def groups(*sizes: int) -> NDArray[np.bool_]:
        of = np.repeat(np.arange(len(sizes)), sizes)
        return np.asarray((of[:, None] == of) & ~np.eye(len(of), dtype=bool))

    assert letter_display(groups(5, 5, 5, 2, 2, 2, 2))  # 2000
    with pytest.raises(TooManyClasses):
        letter_display(groups(3, 23, 29))  # 2001


@pytest.mark.parametrize(
    ("by_observers", "independent", "told"),
    [
        (0.2, 0.01, ("not distinguished", 0.2, True, 0.01)),
        (0.01, 0.2, ("distinguished", 0.01, True, 0.2)),
        (None, 0.05, ("distinguished", 0.05, False, None)),
        (None, None, (None, None, False, None)),
    ],
)
def test_observers_decide_where_they_are_named(
    by_observers: float | None, independent: float | None, told: tuple[str | None, float | None, bool, float | None]
) -> None:
    made = concluded("a", by_observers, independent)
    assert (made.verdict, made.p, made.by_observers, made.p_independent) == told


@pytest.mark.parametrize("alpha", [0.0, 1.0, -1.0, float("nan")])
def test_a_level_out_of_range_is_refused(alpha: float) -> None:
    with pytest.raises(ResultsError, match="alpha"):
        classify(np.zeros(2), np.eye(2), alpha=alpha)


def test_items_without_strengths_are_refused() -> None:
    with pytest.raises(ResultsError, match="finite"):
        classify(np.full(2, np.nan), np.eye(2))


def test_a_line_says_estimate_interval_verdict_and_how_robust() -> None:
    clear = Conclusion("a over b", "distinguished", 0.0004, True, 1.204, 0.5, -1.9, "JND", "", 0.973, "744 analyses")
    for part in (
        "1.20 JND",
        "0.50 to −1.90",
        "distinguished (p < 0.001 by observers)",
        "stands in 97 % of 744 analyses",
    ):
        assert part in clear.sentence
    assert clear.to_json()["verdict"] == "distinguished"
    weak = Conclusion("a over b", "not distinguished", 0.31, False, stands=0.17, others="384 analyses")
    assert "not distinguished (p = 0.310 if" in weak.sentence
    assert "stands in only 17 % of 384" in weak.sentence
    assert "95 %" not in weak.sentence
    alike = Conclusion("a over b", "equivalent", 0.01, True, 0.1, -0.2, 0.4, "JND", margin="0.5jnd")
    assert "equivalent within ± 0.5jnd" in alike.sentence
    assert "stands" not in alike.sentence
