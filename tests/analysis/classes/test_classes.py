"""Perceptual classes, their letters, and corrections for many tests."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from analysis.classes import Conclusion, classify, holm
from analysis.classes.classes import TooManyClasses, letter_display, numbered
from analysis.classes.conclusions import concluded
from analysis.classes.multiplicity import adjusted_p, benjamini_hochberg, clustered_single_step, single_step
from analysis.covariance import Clustered, Spread, shrink
from analysis.errors import ResultsError
from analysis.scaling import fit, probabilities
from documents.arrays import Floats
from tests.choice import nightly

# Perceptual classes against the thesis, a published display, and the definition.

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


# The letter display against its slow twin, pair by pair on sets, and against every graph of few items.

Differs = NDArray[np.bool_]


def absorbed_pair_by_pair(differs: Differs) -> set[frozenset[int]]:
    """Insert and absorb as Piepho states it: split every column that holds both items of a pair that differs."""
    columns = {frozenset(range(len(differs)))}
    for first, second in np.argwhere(np.triu(differs, 1)).tolist():
        halves = {column - {item} for column in columns if {first, second} <= column for item in (first, second)}
        columns = {column for column in columns if not {first, second} <= column} | halves
        columns = {column for column in columns if not any(column < other for other in columns)}
    return columns


def swept_plainly(columns: set[frozenset[int]]) -> set[frozenset[int]]:
    """Leave out, smallest first, each column and then each membership whose pairs the other columns hold as well."""

    def spared(item: int, column: frozenset[int], others: list[frozenset[int]]) -> bool:
        return all(any({item, mate} <= other for other in others) for mate in column)

    kept = sorted(columns, key=lambda column: (len(column), sorted(column)))
    for column in list(kept):
        others = [other for other in kept if other is not column]
        if all(spared(item, column, others) for item in column):
            kept = others
    for place, column in enumerate(kept):
        for item in sorted(column):
            if spared(item, kept[place], kept[:place] + kept[place + 1 :]):
                kept[place] = kept[place] - {item}
    return set(kept)


def graph(n: int, edges: list[bool]) -> Differs:
    differs = np.zeros((n, n), dtype=bool)
    differs[np.triu_indices(n, 1)] = edges
    return differs | differs.T


def check(differs: Differs) -> None:
    """Hold the display against its definition: every alike pair together, no other; nothing that can be spared."""
    letters = letter_display(differs)
    together = {pair for letter in letters for pair in combinations(sorted(letter), 2)}
    assert together == {pair for pair in combinations(range(len(differs)), 2) if not differs[pair]}
    assert set().union(*letters) == set(range(len(differs)))
    for letter in letters:
        others = [other for other in letters if other is not letter]
        for item in letter:
            assert not all(any({item, mate} <= other for other in others) for mate in letter)
    assert set(letters) == swept_plainly(absorbed_pair_by_pair(differs))
    assert len(set(letters)) == len(letters)


@pytest.mark.parametrize("n", [2, 3, 4, *nightly(5)])
def test_every_graph_of_few_items(n: int) -> None:
    pairs = n * (n - 1) // 2
    for number in range(2**pairs):
        check(graph(n, [bool(number >> bit & 1) for bit in range(pairs)]))


@given(st.sampled_from([6, 7]).flatmap(lambda n: st.tuples(st.just(n), st.binary(min_size=21, max_size=21))))
def test_random_graphs_of_six_and_seven_items(case: tuple[int, bytes]) -> None:
    n, chance = case
    check(graph(n, [byte < 128 for byte in chance[: n * (n - 1) // 2]]))


def test_four_hundred_items_in_a_row() -> None:
    """Items that differ when more than 20 places apart: 380 classes, one for each run of 21 neighbours."""
    place = np.arange(400)
    differs = np.abs(place[:, None] - place) > 20
    letters = letter_display(differs)
    held = np.zeros((400, 400), dtype=bool)
    for letter in letters:
        held[np.ix_(sorted(letter), sorted(letter))] = True
    assert len(letters) == 380
    assert (held == ~differs).all()


def test_more_classes_than_anyone_reads_are_refused_soon() -> None:
    """Of 3k items, of which each differs from two others only, there are 3 to the power of k classes."""
    items = 60
    differs = np.zeros((items, items), dtype=bool)
    for first in range(0, items, 3):
        differs[first : first + 3, first : first + 3] = ~np.eye(3, dtype=bool)
    with pytest.raises(TooManyClasses, match="more than 2000 classes"):
        letter_display(differs)


# Corrections against worked values and the studentised range.

P_VALUES = st.lists(st.floats(0, 1), min_size=1, max_size=20).map(np.array)


@given(P_VALUES)
def test_benjamini_hochberg_is_that_of_scipy(p: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    assert benjamini_hochberg(p) == pytest.approx(stats.false_discovery_control(p), abs=1e-15)


@given(P_VALUES)
def test_holm_rejects_what_its_steps_reject(p: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    """Holm's procedure as he states it: the smallest p against α/m, the next against α/(m − 1), until one fails."""
    alpha = 0.05
    rejected = set()
    for step, index in enumerate(np.argsort(p, kind="stable")):
        if p[index] * (len(p) - step) > alpha:
            break
        rejected.add(int(index))
    assert {int(index) for index in np.flatnonzero(holm(p) <= alpha)} == rejected


@pytest.mark.parametrize("n", [2, 3, 6, 10])
def test_the_largest_z_of_equal_items_follows_the_studentised_range(n: int) -> None:
    covariance = np.eye(n) - 1 / n
    z = np.array([2.0, 2.5, 3.0, 3.5])
    pairs = n * (n - 1) // 2
    found = single_step(np.resize(z, max(pairs, 4))[:pairs], covariance)
    expected = stats.studentized_range.sf(np.resize(z, max(pairs, 4))[:pairs] * np.sqrt(2), n, np.inf)
    five_standard_errors = 5 * np.sqrt(expected * (1 - expected) / 200_000)
    assert (np.abs(found - expected) <= five_standard_errors).all()


def test_unadjusted_p_values_are_those_of_the_normal_law() -> None:
    p = adjusted_p(np.array([1.96, 40.0, 0.0]), np.eye(3), "none")
    assert p[0] == pytest.approx(2 * stats.norm.sf(1.96), rel=1e-14)
    assert p[1] == pytest.approx(2 * stats.norm.sf(40), rel=1e-12)
    assert p[2] == 1


def test_an_unknown_adjustment_is_refused() -> None:
    with pytest.raises(ResultsError, match="tukey"):
        adjusted_p(np.zeros(1), np.eye(2), "tukey")  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.parametrize("correct", [holm, benjamini_hochberg])
def test_many_rows_are_corrected_as_each_alone(correct: Callable[[Floats], Floats]) -> None:
    p = np.random.default_rng(8).random((5, 4, 7)) ** 3
    assert (correct(p)[2, 3] == correct(p[2, 3])).all()
    assert (correct(p) == np.array([[correct(row) for row in rows] for rows in p])).all()


def test_with_degrees_of_freedom_the_law_is_students() -> None:
    p = adjusted_p(np.array([2.5]), np.eye(2), "none", df=7)
    assert p[0] == pytest.approx(2 * stats.t.sf(2.5, 7), rel=1e-12)


def spread_of(kind: Clustered, n: int, observers: int) -> Spread:
    """Return a covariance of equal items whose observers vary evenly about them: exactly that of the model."""
    model = np.eye(n) - 1 / n
    pulled = np.random.default_rng(3).standard_normal((observers, n))
    pulled -= pulled.mean(axis=0)
    pulled -= pulled.mean(axis=1, keepdims=True)
    return shrink(model[None], pulled[None] / np.sqrt(observers - 1), kind, freedom=observers - 1)


@pytest.mark.parametrize(("n", "observers"), [(2, 6), (6, 15)])
def test_the_largest_t_scaled_follows_the_studentised_range(n: int, observers: int) -> None:
    """Of all contrasts one common variance is estimated, with (observers − 1)(n − 1) degrees of freedom."""
    z = np.array([2.0, 2.5, 3.0, 3.5])
    found = clustered_single_step(z, spread_of("scaled", n, observers), 40_000)
    expected = stats.studentized_range.sf(z * np.sqrt(2), n, (observers - 1) * (n - 1))
    assert (np.abs(found - expected) <= 5 * np.sqrt(expected * (1 - expected) / 40_000)).all()


@pytest.mark.parametrize("kind", ["sandwich", *nightly("shrinkage")])
def test_the_largest_t_is_that_of_studies_simulated_one_by_one(kind: Clustered) -> None:
    """Observers' own contributions are drawn, their mean tested against their spread, study by study."""
    n, observers, studies = 4, 7, 3000
    whole, random = spread_of(kind, n, observers), np.random.default_rng(4)
    values, vectors = np.linalg.eigh(whole.best[0] * observers)
    root = vectors * np.sqrt(np.maximum(values, 0))
    largest = np.empty(studies)
    for study in range(studies):
        own = random.standard_normal((observers, n)) @ root.T
        mean = own.mean(axis=0)
        around = (own - mean) / np.sqrt(observers * (observers - 1))
        covariance = shrink(whole.model, around[None], kind, freedom=observers - 1).covariance[0]
        largest[study] = max(
            abs(mean[i] - mean[j]) / np.sqrt(covariance[i, i] + covariance[j, j] - 2 * covariance[i, j])
            for i in range(n)
            for j in range(i)
        )
    t = np.quantile(largest, [0.5, 0.9, 0.95])
    found = clustered_single_step(t, whole, 20_000)
    for p, expected in zip(found, (0.5, 0.1, 0.05), strict=True):
        assert p == pytest.approx(expected, abs=5 * np.sqrt(expected * (1 - expected) / studies))
