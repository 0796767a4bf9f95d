"""Ratings of single stimuli and how often stereo was chosen: means, intervals, BT.500's rule."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.errors import ResultsError
from analysis.ratings import summarise_ratings
from analysis.ratings.ratings import RaterScreening, outlying, preferences
from analysis.records import SessionLog, new_header
from analysis.report import describe
from analysis.report.summary import summarise
from analysis.series.observer_means import bounded_means
from documents.arrays import Floats
from tests.answers import altered, changed, new_answer, refusal
from tests.kept import known
from tests.stress.how_many import how_many

# Ratings of single stimuli: means, standardisation, and BT.500's rule by hand.

Maker = Callable[..., SessionLog]
NAMES = ("a", "b", "c")


@pytest.fixture
def make_ratings(make_session: Maker) -> Maker:
    def make(
        observer: str, ratings: Mapping[str, Sequence[float]], scale: str = "quality", **header: Any
    ) -> SessionLog:
        session = make_session(observer, names=NAMES, answers=[], **header)
        trials = [
            new_answer(1, number, "rating", (), 1.0, data={"stimulus": name, "ratings": {"quality": round(value)}})
            for number, (name, value) in enumerate(
                (name, value) for name, values in ratings.items() for value in values
            )
        ]
        return replace(session, records=tuple(trials))

    return make


def test_means_are_over_observers_with_student_s_limits(make_ratings: Maker) -> None:
    sessions = [
        make_ratings("01", {"a": [1, 3], "b": [5]}),
        make_ratings("02", {"a": [4], "b": [5]}),
        make_ratings("03", {"a": [6], "b": [2], "c": [3]}),
    ]
    (scale,) = summarise_ratings(sessions).scales
    a, b, c = scale.scores
    assert (a.stimulus, a.observers, a.mean, a.sd) == ("a", 3, 4.0, 2.0)
    # Student's t with two degrees of freedom: 4.3027.
    assert a.interval == pytest.approx((4 - 4.30265 * 2 / 3**0.5, 4 + 4.30265 * 2 / 3**0.5), abs=1e-4)
    assert b.mean == 4.0
    assert (c.observers, c.mean, c.interval, c.sd) == (1, 3.0, None, None)
    json.dumps(summarise_ratings(sessions).to_json(), allow_nan=False)


def test_how_an_observer_uses_the_scale_drops_out_of_z(make_ratings: Maker) -> None:
    plain = {"a": [1.0], "b": [2.0], "c": [6.0]}
    wide = {name: [10 * values[0] + 7] for name, values in plain.items()}
    (scale,) = summarise_ratings([make_ratings("01", plain), make_ratings("02", wide)]).scales
    values = np.array([1.0, 2.0, 6.0])
    z = (values - 3) / values.std(ddof=1)
    for score, expected in zip(scale.scores, z, strict=True):
        assert score.z == pytest.approx(expected)
        assert score.z_interval is None  # those of both are equal
    assert [one.sd for one in scale.observers] == pytest.approx([values.std(ddof=1), 10 * values.std(ddof=1)])


def test_an_observer_without_spread_has_no_z(make_ratings: Maker) -> None:
    flat, plain = {name: [4.0] for name in NAMES}, {"a": [1.0], "b": [2.0], "c": [6.0]}
    (scale,) = summarise_ratings([make_ratings("01", flat), make_ratings("02", plain)]).scales
    assert scale.scores[0].z == pytest.approx(-2 / np.std([1, 2, 6], ddof=1))
    assert scale.scores[0].z_interval is None
    (alone,) = summarise_ratings([make_ratings("01", flat)]).scales
    assert [score.z for score in alone.scores] == [None, None, None]


def _slow(ratings: np.ndarray) -> tuple[list[int], list[int]]:
    """The rule, step by step, as the Recommendation has it (Annex 1, Section 2.3.1)."""
    above, below = [0] * len(ratings), [0] * len(ratings)
    for j in range(ratings.shape[1]):
        known = [i for i in range(len(ratings)) if not math.isnan(ratings[i, j])]
        n = len(known)
        if n < 2:
            continue
        mean = sum(ratings[i, j] for i in known) / n
        m2 = sum((ratings[i, j] - mean) ** 2 for i in known) / n
        m4 = sum((ratings[i, j] - mean) ** 4 for i in known) / n
        if m2 == 0:
            continue
        s = math.sqrt(m2 * n / (n - 1))
        factor = 2 if 2 <= m4 / m2**2 <= 4 else math.sqrt(20)
        for i in known:
            above[i] += ratings[i, j] >= mean + factor * s
            below[i] += ratings[i, j] <= mean - factor * s
    return above, below


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000))
def test_outlying_ratings_are_those_of_the_rule(seed: int) -> None:
    random = np.random.default_rng(seed)
    ratings = np.round(random.standard_t(2, (60, 6)), 3)
    ratings[random.random(ratings.shape) < 0.1] = np.nan
    above, below = outlying(ratings)
    assert (above.tolist(), below.tolist()) == _slow(ratings)


def test_only_who_scatters_to_both_sides_is_flagged(make_ratings: Maker) -> None:
    """Nineteen observers who rate alike, one who is far off to both sides in turn, and one who is always too high."""
    sessions = []
    for number in range(19):
        random = np.random.default_rng(number)
        sessions.append(make_ratings(f"{number:02d}", {name: random.normal(50, 12, 8).tolist() for name in NAMES}))
    both = make_ratings("wild", {name: [90.0, 10.0] * 4 for name in NAMES})
    one = make_ratings("high", {name: [90.0] * 8 for name in NAMES})
    by = {rater.observer: rater for rater in summarise_ratings([*sessions, both, one]).scales[0].observers}
    assert by["wild"].outlying > 0.5
    assert by["wild"].flagged
    assert by["high"].one_sided == 1.0
    assert not by["high"].flagged
    assert sum(rater.flagged for rater in by.values()) <= 2


def test_limits_of_the_rule() -> None:
    assert not RaterScreening("x", 100, 5.0, 1.0, 3, 2).flagged  # 5 % is not more than 5 %
    assert RaterScreening("x", 99, 5.0, 1.0, 3, 2).flagged
    assert not RaterScreening("x", 20, 5.0, 1.0, 13, 7).flagged  # 0.3 is not below 0.3
    assert RaterScreening("x", 20, 5.0, 1.0, 0, 0).one_sided is None


@pytest.mark.parametrize(
    ("data", "what"),
    [
        ({"stimulus": "x"}, "'x', which is no stimulus"),
        ({"ratings": []}, "'ratings'"),
        ({"ratings": {"quality": float("inf")}}, "'ratings.quality'"),
        ({"ratings": {"quality": None}}, "'ratings.quality'"),
    ],
)
def test_a_damaged_record_is_refused(make_ratings: Maker, tmp_path: Path, data: dict[str, Any], what: str) -> None:
    assert what in str(refusal(make_ratings("01", {"a": [3]}), tmp_path, **data))


def test_no_rating_and_mixtures_are_refused(make_ratings: Maker) -> None:
    with pytest.raises(ResultsError, match="no rating of a stimulus"):
        summarise_ratings([make_ratings("01", {})])
    with pytest.raises(ResultsError, match="'gloss'"):
        summarise_ratings([make_ratings("01", {"a": [1]}), make_ratings("02", {"a": [1]}, experiment="gloss")])


PAIR = {"first": "a", "second": "b", "answer": "second", "chosen": "b", "rejected": "a", "first_position": "top"}


@pytest.fixture
def make_pairs(make_session: Maker) -> Maker:
    """Sessions of one pair each, with what ``more`` says of it."""

    def make(observer: str, kind: str = "all_pairs", **more: Any) -> SessionLog:
        session = make_session(observer, names=NAMES, answers=[])
        return replace(session, records=(new_answer(1, 0, kind, (), 1.0, data={**PAIR, **more}),))

    return make


def test_ratings_after_a_choice_are_of_the_chosen_or_of_both(make_pairs: Maker) -> None:
    sessions = [make_pairs(f"{n}", ratings={"gloss": 2 + n, "depth": {"first": n, "second": 5}}) for n in (1, 2)]
    depth_and_gloss = {(one.of, one.scale): one.scores for one in summarise_ratings(sessions).scales}
    (chosen,), (first, second) = depth_and_gloss["chosen", "gloss"], depth_and_gloss["both", "depth"]
    assert (chosen.stimulus, chosen.mean, chosen.ratings) == ("b", 3.5, 2)
    assert [(one.stimulus, one.mean) for one in (first, second)] == [("a", 1.5), ("b", 5.0)]


@pytest.mark.parametrize("kind", ["active_pairs", "preference"])
def test_they_are_found_whatever_the_kind(make_pairs: Maker, kind: str) -> None:
    (scale,) = summarise_ratings([make_pairs("1", kind, ratings={"gloss": 4})]).scales
    assert (scale.of, scale.scores[0].stimulus, scale.scores[0].mean) == ("chosen", "b", 4.0)


def test_after_a_tie_there_are_ratings_of_both_alone(make_pairs: Maker) -> None:
    """Sessions whose answers all prefer neither have no scores, and yet what was rated."""
    tie = {"answer": "not_sure", "chosen": None, "rejected": None}
    report = describe([make_pairs("1", **tie, ratings={"gloss": None, "depth": {"first": 1, "second": 2}})])
    assert report.pairs is None
    assert [(one.of, one.scale) for one in report.by_part["ratings"].scales] == [("both", "depth")]
    assert describe([make_pairs("1", **tie, ratings={"gloss": None})]).by_part["ratings"] is None


@pytest.mark.parametrize(
    ("kind", "more"), [("practice", {"practice_of": "all_pairs"}), ("all_pairs", {"catch": "obvious", "correct": True})]
)
def test_practice_and_catch_trials_have_none(make_pairs: Maker, kind: str, more: dict[str, Any]) -> None:
    assert describe([make_pairs("1", kind, ratings={"gloss": 4}, **more), make_pairs("2")]).by_part["ratings"] is None


@pytest.mark.parametrize(
    ("ratings", "what"),
    [
        ({"gloss": "good"}, "'ratings.gloss"),
        ({"gloss": {"first": 1, "second": None}}, "'ratings.gloss"),
        ({"gloss": {"third": 1}}, "'ratings.gloss"),
        ([4], "'ratings'"),
    ],
)
def test_damaged_ratings_of_pairs_are_refused(make_pairs: Maker, tmp_path: Path, ratings: Any, what: str) -> None:
    assert what in str(refusal(make_pairs("1"), tmp_path, ratings=ratings))


# Intervals of mean ratings: on the scale, never of no width, and 95 % of them contain what endless observers give.
#
# `pytest -s -m stress tests/analysis/test_ratings.py` prints lines of the table of
# decision 0078; with STRESS_WHOLE=1 in the environment all of them.

# In points: the middle of what an observer answers, that of answers about it and of observers about it; how many each.
MIDDLES = (0.6, 1.0, 1.5, 2.0, 3.0, 4.5, 5.4)
SPREADS = (0.3, 0.6, 1.0, 1.6)
OBSERVERS = ((0.0, 1), (0.5, 1), (0.5, 3), (1.0, 4))


def observers_means(
    random: np.random.Generator, people: int, studies: int, middle: float, spread: float, own: float, each: int
) -> Floats:
    """Return the mean rating of each observer, shape (people, studies), on a scale from 1 to 5."""
    leanings = own * random.standard_normal((people, studies))
    ratings = middle + leanings + spread * random.standard_normal((each, people, studies))
    return np.asarray(np.clip(np.rint(ratings), 1, 5).mean(axis=0))


def limits(values: Floats) -> tuple[Floats, Floats]:
    """Return the limits of each study on a scale from 1 to 5."""
    above = values - 1
    found = bounded_means(above, above**2, np.ones_like(above), 4.0, step=1.0)
    assert all(one.low is not None and one.high is not None for one in found)
    return np.array([one.low for one in found]) + 1, np.array([one.high for one in found]) + 1


def coverage(people: int, studies: int, middle: float, spread: float, own: float, each: int) -> tuple[float, float]:
    """Return how many intervals contain the truth, and their mean width in points."""
    random = np.random.default_rng([people, each, round(10 * middle), round(10 * spread), round(10 * own)])
    truth = float(observers_means(random, 1, 1_000_000, middle, spread, own, 1).mean())
    low, high = limits(observers_means(random, people, studies, middle, spread, own, each))
    assert low.min() >= 1
    assert high.max() <= 5
    assert (high - low).min() > 0.1
    return float(np.mean((low <= truth) & (truth <= high))), float(np.mean(high - low))


@pytest.mark.parametrize(
    ("people", "middle", "spread", "own", "each"),
    [
        (3, 5.4, 0.6, 0.5, 1),
        (5, 5.4, 0.3, 0.5, 1),
        (10, 3.0, 1.0, 0.5, 3),
        (15, 4.5, 1.6, 0.5, 1),
        (30, 0.6, 0.6, 0, 1),
    ],
)
def test_intervals_cover(people: int, middle: float, spread: float, own: float, each: int) -> None:
    """Of 1500 studies, which have 1.7 points of chance at three standard errors; Student's t had 5 to 95 %."""
    held, _ = coverage(people, 1500, middle, spread, own, each)
    assert held >= 0.92


@pytest.mark.stress
@pytest.mark.parametrize("people", [3, 10, 30, 5, 15][: how_many(3, 5)])
def test_intervals_cover_everywhere(people: int) -> None:
    cases = [(middle, spread, *kind) for middle in MIDDLES for spread in SPREADS for kind in OBSERVERS]
    found = np.array([coverage(people, 4000, *case) for case in cases])
    held, wide = found.T
    worst = cases[int(held.argmin())]
    print(f"| {people} | {100 * held.mean():.1f} | {100 * held.min():.1f} | {worst} | {wide.mean():.2f} |")
    assert held.min() >= 0.925
    rare = np.random.default_rng(people).choice([1.0, 5.0], (people, 20_000), p=[0.9, 0.1])
    low, high = limits(rare)
    print(f"one answer in ten at the other end: {100 * np.mean((low <= 1.4) & (high >= 1.4)):.1f}")


def log(observer: int, values: tuple[int, ...], ends: tuple[int, int] | None) -> SessionLog:
    from pathlib import Path

    planned = () if ends is None else ({"kind": "rating", "trials": 1, "expected_s": 1.0, "scales": {"q": list(ends)}},)
    header = new_header("e", f"{observer}", "s", "2026-01-01T00:00:00Z", stimuli=({"name": "a"},), planned=planned)
    trials = (
        new_answer(0, number, "rating", (), 1.0, data={"stimulus": "a", "ratings": {"q": value}})
        for number, value in enumerate(values)
    )
    return SessionLog(Path(f"{observer}.jsonl"), header, tuple(trials), complete=True)


@given(st.lists(st.lists(st.integers(-2, 4), min_size=1, max_size=3), min_size=2, max_size=12))
def test_they_stay_on_the_scale_whatever_the_answers(answers: list[list[int]]) -> None:
    sessions = [log(number, tuple(values), (-2, 4)) for number, values in enumerate(answers)]
    (scale,) = summarise_ratings(sessions).scales
    (score,) = scale.scores
    assert scale.ends == (-2, 4)
    low, high = known(score.interval)
    assert -2 <= low < high <= 4
    assert low <= score.mean <= high


@pytest.mark.parametrize(("values", "t"), [((5, 5, 5), None), ((5, 5, 4), (3.23, 6.10))])
def test_logs_that_do_not_say_where_the_scale_ends(values: tuple[int, ...], t: tuple[float, float] | None) -> None:
    old = [log(number, (value,), None) for number, value in enumerate(values)]
    (score,) = summarise_ratings(old).scales[0].scores
    assert score.interval == (None if t is None else pytest.approx(t, abs=0.01))
    new = [log(number, (value,), (1, 5)) for number, value in enumerate(values)]
    mixed = [*old[:1], *new[1:]]
    assert summarise_ratings(mixed).scales[0].ends is None
    (score,) = summarise_ratings(new).scales[0].scores
    assert 1 < known(score.interval)[0] < 3 < known(score.interval)[1] <= 5


def test_equal_z_have_no_interval() -> None:
    base = log(1, (1,), (1, 5))
    stimuli = ({"name": "a"}, {"name": "b"})
    trials = tuple(
        new_answer(0, n, "rating", (), 1.0, data={"stimulus": name, "ratings": {"q": value}})
        for n, (name, value) in enumerate((("a", 2), ("b", 4)))
    )
    sessions = [
        replace(base, header=altered(base.header, observer=code, stimuli=stimuli), records=trials) for code in "123"
    ]
    assert [score.z_interval for score in summarise_ratings(sessions).scales[0].scores] == [None, None]


# How often stereo was chosen, by observer.

ANSWERS = [("a", "b"), ("b", "a"), ("a", "b")]


def _session(make_session: Maker, observer: str, *views: str) -> SessionLog:
    session = make_session(observer, names="ab", answers=ANSWERS)
    trials = [new_answer(3, n, "preference", (), 1.0, data={"chosen_view": view}) for n, view in enumerate(views)]
    return replace(session, records=(*session.answers, *trials))


def test_they_are_counted_by_observer(make_session: Maker) -> None:
    sessions = [
        _session(make_session, "01", "stereo", "stereo", "flat"),
        _session(make_session, "02", "flat"),
        _session(make_session, "03", "stereo", "flat"),
        _session(make_session, "04"),
    ]
    counted = preferences(sessions)
    assert counted.by_observer == {"01": (2, 1), "02": (0, 1), "03": (1, 1)}
    assert (counted.stereo, counted.flat) == (3, 3)
    assert (counted.observers_for_stereo, counted.observers_for_flat) == (1, 1)
    summary = summarise(sessions)
    assert summary.to_json()["preferences"]["observers"]["01"] == {"stereo": 2, "flat": 1}
    said = "Of 6 preferences between stereo and flat, 3 are for stereo; of 3 observers, 1 chose stereo more often"
    assert any(note.startswith(said) for note in summary.notes)
    assert summary.trials == 12


def test_the_last_attempt_counts(make_session: Maker) -> None:
    session = _session(make_session, "01", "flat")
    again = changed(session.answers[-1], attempt=1, data={**session.answers[-1].details(), "chosen_view": "stereo"})
    assert preferences([replace(session, records=(*session.answers, again))]).by_observer == {"01": (1, 0)}


def test_a_damaged_answer_is_refused(make_session: Maker, tmp_path: Path) -> None:
    session = _session(make_session, "01", "flat")
    assert "'chosen_view'" in str(refusal(replace(session, records=session.answers[-1:]), tmp_path, chosen_view="both"))
