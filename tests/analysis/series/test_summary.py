"""Series in summary, just noticeable differences, and agreement."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.stats import friedmanchisquare, norm, rankdata

from analysis.errors import ResultsError
from analysis.records import SessionLog
from analysis.report import rating_figure, score_figure
from analysis.report.series import series_sections
from analysis.series import SeriesSummary, gather, ranks, summarise_series
from analysis.series.agreement import (
    fleiss_kappa,
    intraclass,
    kendall_w,
    kendall_w_p,
    krippendorff_alpha,
    with_jackknife,
)
from analysis.series.just_noticeable import PROBABLE_ERROR, Matches, fit, log_normal_between, observer_test, step_size
from analysis.series.picture_scores import picture_scores, weight_of
from documents.pages import Figure
from tests.answers import changed
from tests.kept import known

# Everything together: scores by hand, tables, figures, and what changes nothing.

Maker = Callable[..., SessionLog]


def test_scores_are_choices_weighted_by_similarity(fifteen: list[SessionLog]) -> None:
    choices = gather(fifteen)
    records = [trial.details() for session in fifteen for trial in session.trials]
    for one in picture_scores(choices, pooled=False, weight=weight_of(choices)):
        mine = [record for record in records if record["series"] == one.series]
        won = [record["ratings"]["similarity"] for record in mine if record["chosen"] == one.stimulus]
        assert (one.chosen, one.of) == (len(won), 15)
        assert known(one.score).value == pytest.approx(sum(won) / 15)
        assert one.weighted_share == pytest.approx(sum(won) / sum(r["ratings"]["similarity"] for r in mine))
        assert one.share.value == len(won) / 15
        assert (known(one.score).low is None) == (not won)
    for one in picture_scores(choices, pooled=True, weight=weight_of(choices)):
        mine = [record for record in records if f"-{one.kind}" in record["series"]]
        won = [r["ratings"]["similarity"] for r in mine if r["chosen"].endswith(f"-{one.level:g}")]
        assert known(one.score).value == pytest.approx(sum(won) / 75)


def test_shares_sum_to_one(summary: SeriesSummary) -> None:
    for kind in ("base", "brighter", "grey"):
        mine = [one for one in summary.levels if one.kind == kind]
        assert sum(one.chosen for one in mine) == 75
        assert sum(one.weighted_share or 0 for one in mine) == pytest.approx(1)
        assert all(one.level < other.level for one, other in pairwise(mine))


def test_mean_ratings_are_those_of_the_records(fifteen: list[SessionLog], summary: SeriesSummary) -> None:
    records = [trial.details() for session in fifteen for trial in session.trials]
    for cell in summary.ratings["difficulty"]:
        mine = [
            record["ratings"]["difficulty"]
            for record in records
            if cell.paint in (None, record["series"].split("-")[0])
            and cell.kind in (None, record["series"].split("-")[1])
        ]
        assert cell.mean.value == pytest.approx(sum(mine) / len(mine))
        assert cell.mean.answers == len(mine)
    times = {(cell.kind, cell.paint): cell.mean.value for cell in summary.response_times_s}
    assert times[None, None] == pytest.approx(sum(sum(record["dwell_s"]) for record in records) / 225)
    lengths = {(cell.kind, cell.paint): cell.mean.value for cell in summary.path_lengths}
    assert lengths[None, None] == pytest.approx(sum(len(record["path"]) for record in records) / 225)


def test_the_summary_is_json_that_says_what_was_done(summary: SeriesSummary) -> None:
    written = json.loads(json.dumps(summary.to_json(), allow_nan=False))
    assert len(written["levels"]) == 18
    assert len(written["pictures"]) == 90
    assert written["kind_tests"]["similarity"]["conditions"] == ["base", "brighter", "grey"]
    assert written["paint_tests"]["similarity"]["df"] == 4
    assert len(written["steps"]) == 3
    assert written["agreement"]["choices"][0]["name"] == "Fleiss' κ"
    # The base series was rated higher by one point on a scale that otherwise is even.
    assert written["kind_tests"]["similarity"]["pairs"][0]["p_holm"] < 0.01
    assert summary.sentence.startswith("15 observers, 225 choices")


def test_one_observer_is_described_and_not_tested(make_choices: Maker) -> None:
    summary = summarise_series([make_choices("01")])
    assert summary.kind_tests == {}
    assert summary.choice_tests == ()
    assert all(cell.mean.low is None for cell in summary.ratings["similarity"])
    assert any("With one observer" in note for note in summary.notes)
    json.dumps(summary.to_json(), allow_nan=False)


def test_two_series_of_two_pictures_by_two_observers(make_choices: Maker) -> None:
    sessions = []
    for session in (make_choices("01", paints=("GM1",)), make_choices("02", paints=("GM1",))):
        trials = []
        for trial in session.answers:
            names = trial.details()["stimuli"][:2]
            data = {**trial.details(), "stimuli": names, "chosen": names[1], "chosen_index": 1}
            trials.append(changed(trial, data={**data, "path": [[0, 1.0], [1, 1.0]], "dwell_s": [1.0, 1.0]}))
        sessions.append(replace(session, records=tuple(trials)))
    summary = summarise_series(sessions)
    assert all("fewer than three" in step.reason for step in summary.steps)
    assert [one.chosen for one in summary.levels] == [0, 2] * 3
    json.dumps(summary.to_json(), allow_nan=False)


def test_without_ratings_there_are_shares_and_a_note(make_choices: Maker) -> None:
    summary = summarise_series([make_choices(f"{n:02d}", rate=lambda *_: {}, paints=("GM1", "HI")) for n in range(4)])
    assert all(one.score is None for one in summary.levels)
    assert summary.weight is None
    assert any(note.startswith("There are no scores") for note in summary.notes)
    captions = [
        block.caption for part in series_sections(summary) for block in part.blocks if isinstance(block, Figure)
    ]
    assert captions
    assert "similarity" not in " ".join(captions)
    assert summary.ratings == {}
    assert score_figure(summary).unit == "share of choices"
    with pytest.raises(ResultsError, match="'similarity'"):
        rating_figure(summary, "similarity")


def test_unfinished_sessions_are_counted_and_left_out_where_they_must_be(make_choices: Maker) -> None:
    whole = [make_choices(f"{number:02d}", paints=("GM1", "HI")) for number in range(5)]
    torn = replace(whole[3], records=whole[3].answers[:2], complete=False)
    summary = summarise_series([*whole[:3], torn, whole[4]])
    assert len(summary.choices.choices) == 4 * 6 + 2
    assert summary.agreement.observers == 4
    assert summary.kind_tests["similarity"].observers == 4
    assert any(note.startswith("1 of 5 observers did not choose") for note in summary.notes)


def test_figures_have_the_thesis_s_shape_and_their_tables(summary: SeriesSummary) -> None:
    scores = score_figure(summary)
    assert scores.columns == ("exposure (s)", "base", "brighter", "grey")
    assert [row[0] for row in scores.rows] == ["1.3", "1.6", "2", "2.5", "3", "4"]
    ratings = rating_figure(summary, "similarity")
    assert ratings.columns == ("paint", "base", "brighter", "grey")
    assert [row[0] for row in ratings.rows] == ["GM1", "GM2", "HI", "BC", "BR"]
    first = known(ratings.estimates[0][0])
    assert ratings.rows[0][1] == f"{first.value:.2f} ({first.low:.2f} to {first.high:.2f})"
    for figure in (scores, ratings):
        for width_in in (7.6,):
            svg = figure.svg(width_in)
            assert svg.startswith("<svg viewBox=")
            assert svg.count("<svg") == 1
            text = re.findall(r"<text[^>]*>([^<]*)</text>", svg)
            for word in (*figure.bars, *figure.groups):
                assert word in text
            assert figure.svg(width_in) == svg


# The smallest noticeable step, from choices whose scatter is known.

EXPOSURES_S = (1.3, 1.6, 2.0, 2.5, 3.0, 4.0)


def nearest(match: float) -> int:
    """Return the picture nearest to a match in log exposure."""
    return int(np.argmin(np.abs(np.log(EXPOSURES_S) - match)))


@pytest.mark.nightly
def test_the_scatter_of_many_choices_comes_back(make_choices: Maker) -> None:
    leaning = {f"{n:03d}": random.Random(n).gauss(0, 0.15) for n in range(120)}
    sessions = [
        make_choices(
            name, kinds=("base",), law=lambda rng, *_, lean=lean: nearest(np.log(2.2) + lean + rng.gauss(0, 0.25))
        )
        for name, lean in leaning.items()
    ]
    found = step_size(gather(sessions), "base")
    assert found.axis == "log"
    assert (found.choices, found.observers) == (600, 120)
    assert found.match == pytest.approx(2.2, rel=0.06)  # three standard errors: the observers' spread over root 120
    assert found.within == pytest.approx(0.25, abs=0.035)
    assert found.between == pytest.approx(0.15, abs=0.06)
    low, high = known(found.within_interval)
    assert low < 0.25 < (high or 0)
    assert found.step == PROBABLE_ERROR * (found.within or 0)
    assert found.ratio == pytest.approx(np.exp(found.step or 0))
    assert known(found.step_at)[2] == pytest.approx(2.0 * (found.ratio or 0) - 2.0)
    assert sum(known(found.expected)) == pytest.approx(600)
    assert known(found.fit_p) > 0.01
    assert known(found.fit_by_observers).p > 0.01
    assert known(found.fit_by_observers).df == 3


@pytest.mark.nightly
def test_the_likelihood_is_that_of_its_integral() -> None:
    cuts = np.array([-np.inf, -0.5, 0.2, 0.9, np.inf])
    index = np.array([0, 1, 2, 2, 3, 1])
    observer = np.array([0, 0, 0, 1, 1, 2])
    matches = Matches.of(cuts[index], cuts[index + 1], observer)
    slow = 0.0
    for person in range(3):
        mine = index[observer == person]

        def chance(lean: float, mine: np.ndarray = mine) -> float:
            law = norm(0.1 + lean, 0.6)
            return float(np.prod([law.cdf(cuts[i + 1]) - law.cdf(cuts[i]) for i in mine]) * norm.pdf(lean, 0, 0.4))

        slow += np.log(quad(chance, -4, 4, epsabs=1e-13)[0])
    assert matches.log_likelihood(0.1, 0.6, 0.4) == pytest.approx(slow, abs=1e-9)


def test_without_repeats_the_fit_is_the_plain_one() -> None:
    """Five open or closed intervals, each observer once: the likelihood by the normal law's distribution function."""
    cuts = np.array([-np.inf, -0.5, 0.2, 0.9, np.inf])
    index = np.repeat([0, 1, 2, 3], [4, 9, 11, 3])
    matches = Matches.of(cuts[index], cuts[index + 1], np.arange(len(index)))
    found = fit(matches, 0.0, 2.0)
    assert not isinstance(found, str)
    match, within, between = found
    assert between == 0.0

    def slow(m: float, s: float) -> float:
        return float(np.log(norm.cdf((cuts[index + 1] - m) / s) - norm.cdf((cuts[index] - m) / s)).sum())

    here = slow(match, within)
    for step in (-1e-3, 1e-3):
        assert here >= slow(match + step, within)
        assert here >= slow(match, within + step)
    assert matches.log_likelihood(match, within, 0.0) == pytest.approx(here)


def test_chances_keep_their_digits_far_out() -> None:
    low, high = np.array([-1.0, 8.0, -40.0, -np.inf, 30.0]), np.array([1.0, 9.0, -39.0, -30.0, np.inf])
    expected = [np.log(norm.cdf(1) - norm.cdf(-1)), np.log(norm.sf(8) - norm.sf(9))]
    expected += [norm.logcdf(-39) + np.log1p(-np.exp(norm.logcdf(-40) - norm.logcdf(-39)))]
    expected += [norm.logcdf(-30), norm.logsf(30)]
    assert log_normal_between(low, high) == pytest.approx(np.array(expected), rel=1e-12)


@pytest.mark.parametrize(
    ("law", "reason"),
    [
        (lambda rng, *_: 2 + rng.randrange(2), "fewer than three"),
        (lambda rng, *_: 5, "fewer than three"),
        (lambda rng, *_: rng.choice([0, 0, 0, 5, 5, 5, 5, 2] if rng.random() < 0.05 else [0, 5]), "both ends"),
    ],
)
def test_what_cannot_be_told_is_said(make_choices: Maker, law: Callable[..., int], reason: str) -> None:
    sessions = [make_choices(f"{n:02d}", kinds=("base",), law=law) for n in range(20)]
    found = step_size(gather(sessions), "base")
    assert reason in found.reason
    assert (found.step, found.ratio, found.step_at, found.step_interval) == (None, None, None, None)


def test_observers_who_never_waver_are_finer_than_the_series(make_choices: Maker) -> None:
    sessions = [make_choices(f"{n:02d}", kinds=("base",), law=lambda *_, n=n: 1 + n % 4) for n in range(12)]
    assert "finer than the series" in step_size(gather(sessions), "base").reason


def test_the_fit_of_observers_who_differ_is_no_misfit_and_two_peaks_are() -> None:
    rng = np.random.default_rng(3)
    cuts = np.array([-np.inf, -1.0, -0.4, 0.2, 0.8, 1.4, np.inf])
    observer = np.repeat(np.arange(10), 6)

    def chances(match: float, sd: float) -> np.ndarray:
        return np.diff(norm.cdf((cuts - match) / sd))

    expected = 60 * chances(0.1, 0.8)
    slopes = 60 * np.column_stack(
        [
            (chances(0.1 + 1e-5, 0.8) - chances(0.1 - 1e-5, 0.8)) / 2e-5,
            (chances(0.1, 0.8 + 1e-5) - chances(0.1, 0.8 - 1e-5)) / 2e-5,
        ]
    )
    plain = false = found = 0
    for _ in range(80):
        matches = 0.1 + 0.77 * rng.standard_normal(10)[observer] + 0.2 * rng.standard_normal(60)
        peaks = 0.1 + 0.9 * np.where(rng.random(60) < 0.5, 1, -1) + 0.2 * rng.standard_normal(60)
        tests = []
        for values in (matches, peaks):
            took = np.eye(6)[np.searchsorted(cuts, values) - 1]
            test = known(observer_test(took - expected / 60, observer, expected, slopes))
            tests.append(test)
        false, found = false + (tests[0].p <= 0.05), found + (tests[1].p <= 0.05)
        plain += tests[0].statistic > 7.815  # χ² of 3 degrees of freedom
    assert tests[0].df == 3
    assert plain > 20
    assert false <= 11
    assert found > 70


# Agreement against the literature's worked examples and slow, obvious ways.

NAN = float("nan")
# Krippendorff (2011), "Computing Krippendorff's alpha-reliability", example C: four observers, twelve units.
EXAMPLE_C = np.array(
    [
        [1, 2, 3, 3, 2, 1, 4, 1, 2, NAN, NAN, NAN],
        [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, NAN, 3],
        [NAN, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, NAN],
        [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, NAN],
    ]
)
# Shrout and Fleiss (1979), Table 2: six targets, four judges.
SHROUT = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float).T


@given(arrays(np.float64, (2, 3, 6), elements=st.sampled_from([0.0, 0.1, 1.0, 2.0, float("inf"), -float("inf"), NAN])))
def test_ranks_are_those_of_scipy(values: NDArray[np.float64]) -> None:
    for held in (values, values[..., :1], values[0, 0], values[:, :0]):
        np.testing.assert_array_equal(ranks(held), rankdata(held, axis=-1))


def test_krippendorff_s_own_example() -> None:
    assert krippendorff_alpha(EXAMPLE_C, nominal=True) == pytest.approx(0.743, abs=5e-4)
    assert krippendorff_alpha(EXAMPLE_C, nominal=False) == pytest.approx(0.849, abs=5e-4)


def _slow_alpha(values: np.ndarray, nominal: bool) -> float:
    """Pair every two values said of one thing, and every two values at all."""
    units = [[v for v in column if np.isfinite(v)] for column in values.T]
    units = [unit for unit in units if len(unit) > 1]
    everything = [v for unit in units for v in unit]

    def distance(a: float, b: float) -> float:
        return float(a != b) if nominal else (a - b) ** 2

    seen = sum(sum(distance(a, b) for a, b in combinations(unit, 2)) * 2 / (len(unit) - 1) for unit in units)
    n = len(everything)
    expected = sum(distance(a, b) for a, b in combinations(everything, 2)) * 2 / (n * (n - 1))
    return 1 - seen / n / expected


@pytest.mark.parametrize("nominal", [True, False])
def test_alpha_is_that_of_all_pairs(nominal: bool) -> None:
    random = np.random.default_rng(5)
    for _ in range(20):
        values = random.integers(0, 5, (4, 7)).astype(float)
        values[random.random(values.shape) < 0.2] = NAN
        assert krippendorff_alpha(values, nominal=nominal) == pytest.approx(_slow_alpha(values, nominal))


def test_fleiss_worked_example() -> None:
    # Fourteen raters, ten subjects, five categories: kappa 0.210.
    counts = np.array(
        [
            [0, 0, 0, 0, 14],
            [0, 2, 6, 4, 2],
            [0, 0, 3, 5, 6],
            [0, 3, 9, 2, 0],
            [2, 2, 8, 1, 1],
            [7, 7, 0, 0, 0],
            [3, 2, 6, 3, 0],
            [2, 5, 3, 2, 2],
            [6, 5, 2, 1, 0],
            [0, 2, 2, 3, 7],
        ],
        float,
    )
    assert fleiss_kappa(counts) == pytest.approx(0.210, abs=5e-4)


def test_kappa_needs_as_many_answers_everywhere() -> None:
    assert fleiss_kappa(np.array([[1.0, 1.0], [1.0, 2.0]])) is None
    assert fleiss_kappa(np.array([[2.0, 0.0], [2.0, 0.0]])) is None


@settings(max_examples=50, deadline=None)
@given(arrays(np.float64, (5, 4), elements=st.integers(1, 6).map(float)))
def test_w_is_friedman_s_statistic_with_ties(ratings: np.ndarray) -> None:
    w = kendall_w(ratings)
    if w is None:
        assert (ratings == ratings[:, :1]).all()
        return
    statistic, p = friedmanchisquare(*ratings.T)
    assert w == pytest.approx(statistic / (5 * 3), abs=1e-12)
    assert kendall_w_p(w, 5, 4) == pytest.approx(p, abs=1e-12)


def test_shrout_and_fleiss_table() -> None:
    found = {one.name: one for one in intraclass(SHROUT)}
    # Their Table 4; the limits are those that R's psych prints for the same table.
    expected = {"ICC(2,1)": 0.29, "ICC(3,1)": 0.71, "ICC(2,k)": 0.62, "ICC(3,k)": 0.91}
    limits = {
        "ICC(2,1)": (0.019, 0.76),
        "ICC(3,1)": (0.342, 0.95),
        "ICC(2,k)": (0.071, 0.93),
        "ICC(3,k)": (0.676, 0.99),
    }
    for name, value in expected.items():
        assert found[name].value == pytest.approx(value, abs=0.005)
        assert found[name].low == pytest.approx(limits[name][0], abs=0.0006)
        assert found[name].high == pytest.approx(limits[name][1], abs=0.005)
        assert found[name].p == pytest.approx(0.00013, abs=5e-6)


def test_a_limit_that_is_no_number_is_not_defined() -> None:
    found = {one.name: one for one in intraclass(np.array([[3.0, 6.0, 7.0], [5.0, 3.0, 2.0]]))}
    assert found["ICC(2,1)"].value == pytest.approx(-1.0)
    assert found["ICC(2,1)"].low is None
    assert found["ICC(2,k)"].low is None


def test_things_that_do_not_differ_have_no_reliability() -> None:
    assert all(one.value is None for one in intraclass(np.full((4, 5), 3.0)))
    assert all(one.value is None for one in intraclass(np.ones((1, 5))))
    same = intraclass(np.tile(np.arange(5.0), (4, 1)))
    assert [one.value for one in same] == [1.0, 1.0, 1.0, 1.0]
    # Observers differ by a constant: consistent, but not alike.
    agreement, consistency, *_ = intraclass(np.arange(5.0) + np.array([[0.0], [4.0], [8.0]]))
    assert consistency.value == 1.0
    assert known(agreement.value) < 0.2


def _kappa(places: NDArray[np.float64]) -> float | None:
    return fleiss_kappa((places.T[:, :, None] == np.arange(places.max() + 1)).sum(axis=1).astype(np.float64))


@pytest.mark.parametrize("answers", [[0, 0, 1, 1], [0, 0, 0, 1, 1, 1], [0, 1, 2, 3]])
def test_one_series_gives_no_interval_without_width_or_its_estimate(answers: list[int]) -> None:
    rows = np.array(answers, np.float64)[:, None]
    for coefficient in (_kappa, lambda rows: krippendorff_alpha(rows, nominal=True)):
        found = with_jackknife("agreement", coefficient, rows)
        assert found.value is not None
        assert (found.low, found.high) == (None, None)
        assert "No interval" in found.reason


def test_observers_who_differ_over_several_series_still_have_an_interval() -> None:
    rows = np.random.default_rng(3).integers(0, 3, (8, 6)).astype(np.float64)
    rows[:5] = rows[0]
    found = with_jackknife("Fleiss' κ", _kappa, rows)
    assert known(found.low) < known(found.value) < known(found.high)
    assert "No interval" not in found.reason


def test_jackknife_limits_hold_for_a_mean() -> None:
    rows = np.random.default_rng(2).normal(0.2, 0.05, (9, 1))
    found = with_jackknife("mean", lambda rows: float(rows.mean()), rows)
    half = 2.306004 * rows.std(ddof=1) / 3
    assert found.low == pytest.approx(rows.mean() - half, abs=1e-6)
    assert found.high == pytest.approx(rows.mean() + half, abs=1e-6)
    assert with_jackknife("mean", lambda rows: float(rows.mean()), rows[:3]).low is None
