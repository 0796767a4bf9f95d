"""Intervals of mean ratings: on the scale, never of no width, and 95 % of them contain what endless observers give.

`pytest -s -m stress tests/analysis/ratings/test_rating_coverage.py` prints lines of the table of
docs/uncertainty.md; with STRESS_WHOLE=1 in the environment all of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.ratings import summarise_ratings
from analysis.records import SessionLog, new_header
from analysis.series.observer_means import bounded_means
from documents.arrays import Floats
from tests.answers import altered, new_answer
from tests.stress.how_many import how_many

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
    assert score.interval is not None
    low, high = score.interval
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
    assert score.interval is not None
    assert 1 < score.interval[0] < 3 < score.interval[1] <= 5


def test_equal_z_have_no_interval() -> None:
    base = log(1, (1,), (1, 5))
    stimuli = ({"name": "a"}, {"name": "b"})
    trials = tuple(
        new_answer(0, n, "rating", (), 1.0, data={"stimulus": name, "ratings": {"q": value}})
        for n, (name, value) in enumerate((("a", 2), ("b", 4)))
    )
    sessions = [
        replace(base, header=altered(base.header, observer=code, stimuli=stimuli), answers=trials) for code in "123"
    ]
    assert [score.z_interval for score in summarise_ratings(sessions).scales[0].scores] == [None, None]
