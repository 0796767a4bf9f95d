"""Choices from series: the table, the tests, the means of observers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import friedmanchisquare
from scipy.stats import t as student

from analysis.bootstrap import tails
from analysis.errors import ResultsError
from analysis.records import SessionLog
from analysis.report import wilson_interval
from analysis.series import gather, means
from analysis.series.choice_tests import choice_counts, kinds_tests, level_tests, neighbours_tests
from analysis.series.choices import Factors, design
from analysis.series.observer_means import bounded_means, shares
from analysis.series.paired_tests import (
    MOST_EXACT,
    cochran,
    mean_difference_p,
    nemenyi_p,
    p_by_flips,
    rating_test,
    stuart_maxwell,
)
from tests.answers import changed, new_answer, refusal
from tests.choice import nightly
from tests.kept import known

# From records to choices, and what must not be mixed or believed.

Maker = Callable[..., SessionLog]


def test_every_choice_is_found_with_its_ratings_and_its_way(make_choices: Maker) -> None:
    sessions = [make_choices("02"), make_choices("01", complete=False)]
    choices = gather(sessions)
    assert choices.observers == ("01", "02")
    assert choices.scales == ("similarity", "difficulty")
    assert (choices.design.by, choices.design.across, choices.design.along) == ("series", "paint", "exposure_s")
    assert choices.design.kinds == ("base", "brighter", "grey")
    assert choices.design.paints == ("GM1", "GM2", "HI", "BC", "BR")
    assert choices.design.levels("grey") == (1.3, 1.6, 2.0, 2.5, 3.0, 4.0)
    assert (choices.counts == 1).all()
    assert choices.complete == (0, 1)
    trial = sessions[1].trials[4]
    (one,) = [
        one
        for one in choices.choices
        if one.observer == 0 and choices.design.series[one.series].name == trial.details()["series"]
    ]
    assert one.index == trial.details()["chosen_index"]
    assert one.ratings == trial.details()["ratings"]
    assert one.rating_times_s == trial.details()["rating_times_s"]
    assert one.dwell_s == tuple(trial.details()["dwell_s"])
    assert one.path_length == len(trial.details()["path"])
    assert sum(one.visits) == len(trial.details()["path"])
    assert one.response_time_s == trial.response_time_s


def test_the_last_attempt_counts_and_practice_does_not(make_choices: Maker) -> None:
    session = make_choices("01", paints=("GM1",), kinds=("base",), law=lambda *_: 2)
    other = make_choices("01", paints=("GM1",), kinds=("base",), law=lambda *_: 4)
    again = changed(other.answers[0], attempt=1)
    practice = changed(other.answers[0], kind="practice", trial=1)
    choices = gather([replace(session, records=(*session.answers, again, practice))])
    assert [one.index for one in choices.choices] == [4]


def test_an_observer_of_two_sessions_chooses_twice(make_choices: Maker) -> None:
    choices = gather(
        [make_choices("01"), make_choices("01", seed="b", session="later", started_utc="2026-02-02T10:00:00Z")]
    )
    assert (choices.counts == 2).all()


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"experiment": "gloss"}, "'gloss'"),
        ({"paints": ("GM1",)}, "same stimuli"),
        ({"observer": "01"}, "would count twice"),
    ],
)
def test_what_does_not_belong_together_is_refused(make_choices: Maker, change: dict[str, Any], what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        gather([make_choices("01"), make_choices(**{"observer": "02", **change})])


def test_no_session_and_no_choice_are_refused(make_choices: Maker) -> None:
    with pytest.raises(ResultsError, match="no session"):
        gather([])
    with pytest.raises(ResultsError, match="no choice from a series"):
        gather([make_choices("01", paints=())])


@pytest.mark.parametrize(
    ("damage", "what"),
    [
        ({"stimuli": ["GM1-base-2"]}, "'stimuli'"),
        ({"series": 3}, "'series'"),
        ({"stimuli": ["GM1-base-2", "x"]}, "'x', which is no stimulus"),
        ({"stimuli": ["GM1-base-2"] * 6}, "a picture twice"),
        ({"chosen": "GM1-base-2", "chosen_index": 0}, "picture 0"),
        ({"chosen_index": 6}, "picture 6"),
        ({"chosen_index": True}, "'chosen_index'"),
        ({"ratings": {"similarity": float("nan")}}, "'ratings.similarity'"),
        ({"ratings": {"similarity": "8"}}, "'ratings.similarity'"),
        ({"ratings": [8]}, "'ratings'"),
        ({"rating_times_s": {"similarity": -1.0}}, "'rating_times_s.similarity'"),
        ({"path": [[7, 1.0]]}, "path"),
        ({"path": [[-1, 1.0]]}, "'path.0"),
        ({"dwell_s": [1.0, 2.0]}, "dwell_s"),
        ({"dwell_s": [1.0, 2.0, 1.0, float("nan"), 1.0, 1.0]}, "'dwell_s.3'"),
    ],
)
def test_a_damaged_record_is_refused(make_choices: Maker, tmp_path: Path, damage: dict[str, Any], what: str) -> None:
    session = make_choices("01", paints=("GM1",), kinds=("base",), law=lambda *_: 5)
    assert what in str(refusal(session, tmp_path, **damage))


def test_a_series_that_is_another_elsewhere_is_refused(make_choices: Maker) -> None:
    one = make_choices("01", paints=("GM1",), kinds=("base",), law=lambda *_: 0)
    trial = one.answers[0]
    turned: list[str] = trial.details()["stimuli"][::-1]
    data = {**trial.details(), "stimuli": turned, "chosen": turned[0], "chosen_index": 0}
    other = make_choices("02", paints=("GM1",), kinds=("base",))
    with pytest.raises(ResultsError, match="other pictures as 'GM1-base' than"):
        gather([one, replace(other, records=(changed(trial, data=data),))])


FACTORS: dict[str, Factors] = {
    "a1": {"gloss": 1, "lamp": "sun", "n": 1},
    "a2": {"gloss": 2, "lamp": "sun", "n": 1},
    "b1": {"gloss": 4, "lamp": "sky", "n": 1},
    "b2": {"gloss": 5, "lamp": "sky", "n": 1},
}


def test_factors_are_found_without_their_usual_names() -> None:
    found = design({"a": ("a1", "a2"), "b": ("b1", "b2")}, FACTORS)
    assert (found.by, found.across, found.along) == ("lamp", None, "gloss")
    assert found.kinds == ("sun", "sky")
    assert found.series[1].levels == (4.0, 5.0)


def test_without_factors_each_series_is_a_kind_and_levels_are_places() -> None:
    found = design({"a": ("a1", "a2"), "b": ("b1", "b2")}, {name: {} for name in FACTORS})
    assert (found.by, found.across, found.along) == (None, None, None)
    assert found.kinds == ("a", "b")
    assert found.series[0].levels == (1.0, 2.0)


@pytest.mark.parametrize(
    ("wish", "what"),
    [({"along": "n"}, "'n' that rises"), ({"by": "gloss"}, "'gloss' that is the same"), ({"across": "x"}, "'x'")],
)
def test_a_factor_that_does_not_do_is_refused(wish: dict[str, str], what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        design({"a": ("a1", "a2"), "b": ("b1", "b2")}, FACTORS, **wish)


def test_other_kinds_of_trials_are_passed_over(make_choices: Maker) -> None:
    session = make_choices("01")
    question = new_answer(2, 0, "questionnaire", (), 1.0, data={"text": "fine"})
    assert len(gather([replace(session, records=(*session.answers, question))]).choices) == 15


# Permutation tests and their kin, against the literature and slow ways.

# Darwin's maize, crossed less self-fertilised, in eighths of an inch; Fisher (1935, Section 21): 863 of 32,768
# combinations of signs reach the sum of 314 to one side.
DARWIN = np.array([49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48], float)


def test_fisher_s_own_example_to_the_last_digit() -> None:
    assert mean_difference_p(DARWIN) == 2 * 863 / 32768
    assert mean_difference_p(-DARWIN[::-1]) == 2 * 863 / 32768


def test_every_sign_is_gone_through() -> None:
    rows = np.random.default_rng(4).integers(-3, 4, (7, 2)).astype(float)

    def statistic(sums: np.ndarray) -> np.ndarray:
        return np.asarray((sums**2).sum(axis=-1))

    seen = statistic(rows.sum(axis=0))
    slow = [statistic((np.array(signs)[:, None] * rows).sum(axis=0)) >= seen for signs in product((1, -1), repeat=7)]
    assert p_by_flips(rows, statistic) == pytest.approx(np.mean(slow))


def test_drawn_signs_come_close_to_all_signs() -> None:
    """One row more than is gone through exactly, and so small that it decides nothing."""
    rows = np.concatenate([DARWIN, [3.0], [1e-7]])
    assert len(rows) == MOST_EXACT + 1
    assert mean_difference_p(rows) == pytest.approx(mean_difference_p(rows[:-1]), abs=0.003)
    assert mean_difference_p(rows[::-1]) == mean_difference_p(rows)


@pytest.mark.parametrize("size", [1e-3, 1 / 3, 1e9])
def test_differences_that_cancel_out_but_for_rounding_are_none(size: float) -> None:
    assert mean_difference_p(size * np.array([1.0, 2.0, 3.0, -6.0])) == 1.0
    assert mean_difference_p(size * np.array([0.1, 0.2, -0.3, 0.0])) == 1.0


def test_stuart_s_table_of_eyes() -> None:
    # Unaided vision of the right and left eye of 7477 women: Stuart (1955), chi-squared 11.96, 3 degrees of freedom.
    table = np.array([[1520, 266, 124, 66], [234, 1512, 432, 78], [117, 362, 1772, 205], [36, 82, 179, 492]])
    each = np.eye(4)
    differences = np.repeat(
        [each[right] - each[left] for right in range(4) for left in range(4)], table.ravel(), axis=0
    )
    statistic, df = stuart_maxwell(differences)
    assert statistic == pytest.approx(11.957, abs=5e-4)
    assert df == 3


def test_cochran_s_q_is_friedman_s_of_yes_and_no() -> None:
    rows = np.random.default_rng(8).integers(0, 2, (20, 3)).astype(float)
    statistic, p = cochran(rows)
    expected, approximate = friedmanchisquare(*rows.T)
    assert statistic == pytest.approx(expected)
    assert p == pytest.approx(approximate, abs=0.05)
    assert cochran(np.ones((5, 3))) == (None, None)


def test_nemenyi_s_critical_difference() -> None:
    # Demsar (2006), Table 5: q = 2.343 for three, 2.728 for five at 0.05; mean ranks differ by q sqrt(k(k+1)/6S).
    for k, q in ((3, 2.343), (5, 2.728)):
        ranks = np.arange(k, dtype=float)
        rows = np.tile(ranks, (1, 1))
        observers = k * (k + 1) / 6 * (q / (k - 1)) ** 2  # so many make the ends' distance k - 1 just significant
        few, many = (nemenyi_p(np.tile(rows, (count, 1)))[0, -1] for count in (int(observers), int(observers) + 1))
        assert many < 0.05 < few
    assert nemenyi_p(np.ones((6, 3))).tolist() == np.ones((3, 3)).tolist()


def test_ratings_are_tested_within_observers() -> None:
    random = np.random.default_rng(1)
    ratings = random.normal(0, 3, (15, 1)) + np.array([[0.0, 0.0, 1.0]]) + random.normal(0, 0.5, (15, 3))
    found = known(rating_test("similarity", ("a", "b", "c"), ratings))
    statistic, p = friedmanchisquare(*ratings.T)
    assert (found.statistic, found.p) == pytest.approx((statistic, p))
    assert [pair.p_holm < 0.05 for pair in found.pairs] == [False, True, True]
    ab = found.pairs[0]
    assert ab.p == mean_difference_p(ratings[:, 0] - ratings[:, 1])
    difference = ratings[:, 1] - ratings[:, 2]
    assert found.pairs[2].effect == pytest.approx(difference.mean() / difference.std(ddof=1))
    assert rating_test("x", ("a",), ratings[:, :1]) is None
    assert rating_test("x", ("a", "b", "c"), ratings[:1]) is None


def test_where_all_rate_alike_nothing_is_claimed() -> None:
    found = known(rating_test("similarity", ("a", "b"), np.full((5, 2), 7.0)))
    assert (found.statistic, found.p, found.pairs[0].p, found.pairs[0].effect) == (None, None, 1.0, None)


def test_kinds_of_series_that_differ_are_told_apart(make_choices: Maker) -> None:
    def law(rng: object, paint: str, kind: str) -> int:
        return {"base": 1, "brighter": 4, "grey": 4}[kind] + rng.randint(-1, 1)  # type: ignore[attr-defined,no-any-return]  # the test knows its kind

    choices = gather([make_choices(f"{n:02d}", law=law) for n in range(12)])
    by = {(test.one, test.other): test for test in kinds_tests(choices)}
    assert by["base", "brighter"].p_holm < 0.01
    assert by["base", "brighter"].shift == pytest.approx(-3, abs=0.4)
    assert by["brighter", "grey"].p > 0.05
    by_level = {test.level: test for test in level_tests(choices)}
    assert known(by_level[1.3].p) < 0.01
    assert sum(test.shares[0] for test in by_level.values()) == pytest.approx(1)


def test_observers_with_missing_series_are_compared_on_what_they_have(make_choices: Maker) -> None:
    from dataclasses import replace

    sessions = [make_choices(f"{n:02d}") for n in range(4)]
    trials = [trial for trial in sessions[0].answers if trial.details()["series"] != "GM1-base"]
    counts = choice_counts(gather([replace(sessions[0], records=tuple(trials)), *sessions[1:]]))
    assert counts.sum(axis=2).tolist() == [[4.0] * 3] + [[5.0] * 3] * 3


def test_neighbours(make_choices: Maker) -> None:
    choices = gather([make_choices(f"{n:02d}", law=lambda *_: 3, kinds=("base",)) for n in range(10)])
    found = {(test.one, test.other): test for test in neighbours_tests(choices)}
    assert found[1.3, 1.6].p == 1.0
    assert found[1.3, 1.6].chosen == (0, 0)
    assert found[2.0, 2.5].p == 2 / 2**10
    assert found[2.0, 2.5].p_holm == 5 * 2 / 2**10


# Intervals over observers, against slow ways to the same and against the truth.
def _wilson_by_search(share: float, answers: float, quantile: float) -> tuple[float, float]:
    """Return the shares from which the one seen is ``quantile`` standard errors off: Wilson's interval."""

    def off(truth: float) -> float:
        return (share - truth) ** 2 - quantile**2 * truth * (1 - truth) / answers

    return brentq(off, 0, share, xtol=1e-12), brentq(off, share, 1, xtol=1e-12)


def test_means_are_those_of_all_answers() -> None:
    total, count = np.array([[4.0, 0.0], [9.0, 3.0], [1.0, 0.0]]), np.array([[2.0, 0.0], [3.0, 1.0], [1.0, 0.0]])
    one, other = means(total, count)
    assert one.value == pytest.approx(14 / 6)
    assert (one.answers, one.observers) == (6, 3)
    assert known(one.low) < 14 / 6 < known(one.high)
    assert (other.value, other.low, other.high, other.observers) == (3.0, None, None, 1)


def test_an_interval_is_that_of_observers_drawn_one_by_one() -> None:
    random = np.random.default_rng(3)
    values = random.normal(5, 2, 12)
    (found,) = means(values[:, None], np.ones((12, 1)), replicates=20_000)
    draws = np.sort([values[random.integers(0, 12, 12)].mean() for _ in range(20_000)])
    tail = tails.widened(0.025, 12)
    assert found.low == pytest.approx(draws[int(tail * 20_000)], abs=0.06)
    assert found.high == pytest.approx(draws[int((1 - tail) * 20_000)], abs=0.06)


def test_a_share_of_independent_answers_has_wilson_s_interval() -> None:
    (found,) = shares(np.array([[1.0]] * 4 + [[0.0]] * 11), np.ones((15, 1)))
    assert (found.low, found.high) == pytest.approx(wilson_interval(4 / 15, 15))


def test_answers_that_only_repeat_an_observer_s_first_add_nothing() -> None:
    once = shares(np.array([[1.0]] * 4 + [[0.0]] * 11), np.ones((15, 1)))[0]
    (five,) = shares(np.array([[5.0]] * 4 + [[0.0]] * 11), np.full((15, 1), 5.0))
    assert once.low is not None
    assert once.high is not None
    # The design effect is estimated: 5, with 14 in place of 15 observers. Student's quantile makes up for that.
    assert (five.low, five.high) == pytest.approx(_wilson_by_search(4 / 15, 14, student.ppf(0.975, 14)), abs=1e-9)
    (none,) = shares(np.zeros((15, 1)), np.full((15, 1), 5.0))
    assert (none.low, none.high) == pytest.approx(wilson_interval(0.0, 15))


def test_answers_are_worth_what_their_scatter_among_observers_says() -> None:
    chosen, of = np.array([0.0, 1.0, 2.0, 5.0, 4.0, 0.0]), np.full(6, 5.0)
    (found,) = shares(chosen[:, None], of[:, None])
    # Of equal numbers of answers: the variance of the observers' own shares over that of a share of 30.
    effect = (chosen / 5).var(ddof=1) / 6 / (0.4 * 0.6 / 30)
    assert effect > 1
    assert (found.low, found.high) == pytest.approx(
        _wilson_by_search(0.4, 30 / effect, student.ppf(0.975, 5)), abs=1e-9
    )


def test_a_bounded_mean_s_interval_is_a_share_s_where_answers_are_0_or_the_most() -> None:
    given = np.array([[8.0]] * 4 + [[0.0]] * 11)
    (found,) = bounded_means(given, given**2, np.ones((15, 1)), 8.0)
    expected = _wilson_by_search(4 / 15, 14, student.ppf(0.975, 14))  # the sample's variance has 14 for 15
    assert found.value == pytest.approx(8 * 4 / 15)
    assert (known(found.low) / 8, known(found.high) / 8) == pytest.approx(expected, abs=1e-9)


def test_a_bounded_mean_far_from_its_bounds_has_student_s_interval() -> None:
    values = np.random.default_rng(3).normal(50, 1, 200)
    (found,) = bounded_means(values[:, None], values[:, None] ** 2, np.ones((200, 1)), 100.0)
    half = student.ppf(0.975, 199) * values.std(ddof=1) / np.sqrt(200)
    assert (found.low, found.high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.01 * half)


def test_answers_all_alike_have_no_interval() -> None:
    for answer in (0.0, 3.0, 8.0):
        column = np.full((5, 1), answer)
        (found,) = bounded_means(column, column**2, np.ones((5, 1)), 8.0)
        assert (found.value, found.low, found.high) == (answer, None, None)


def test_nothing_comes_of_nothing() -> None:
    assert shares(np.zeros((3, 1)), np.zeros((3, 1)))[0].value is None
    assert means(np.zeros((3, 1)), np.zeros((3, 1)))[0].value is None


@pytest.mark.parametrize("cluster", [True, *nightly(False)])
def test_intervals_hold_the_truth(cluster: bool) -> None:
    """15 observers, five answers each, with observers of their own leaning: 400 studies, at least 92 %."""
    random = np.random.default_rng(11)
    held_mean = held_share = 0
    for _ in range(400):
        lean = random.beta(1.5, 3.5, 15) if cluster else np.full(15, 0.3)
        chosen = random.binomial(5, lean)[:, None].astype(float)
        (share,) = shares(chosen, np.full((15, 1), 5.0))
        held_share += share.low is not None and share.high is not None and share.low <= 0.3 <= share.high
        (mean,) = means(chosen, np.full((15, 1), 5.0), replicates=400)
        held_mean += mean.low is not None and mean.high is not None and mean.low <= 0.3 <= mean.high
    # 92 % of 400 less two standard errors.
    assert held_share >= 357
    assert held_mean >= 357
