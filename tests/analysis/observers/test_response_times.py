"""How long observers took, and whether close scores took longer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr

from analysis.observers.response_times import response_times
from analysis.records.session_record import SessionLog

Maker = Callable[..., SessionLog]
THETA = {"a": -2.0, "b": -0.5, "c": 0.0, "d": 2.5}
PAIRS = [(a, b) for a in THETA for b in THETA if a != b]


def timed(session: SessionLog, seconds: list[float]) -> SessionLog:
    pairs = zip(session.answers, seconds, strict=True)
    return replace(session, answers=tuple(replace(trial, response_time_s=time) for trial, time in pairs))


def test_times_that_follow_the_difference_give_its_slope(make_session: Maker) -> None:
    random = np.random.default_rng(1)
    gap = np.array([abs(THETA[a] - THETA[b]) for a, b in PAIRS])
    seconds = np.exp(3 - 0.4 * gap + random.normal(0, 0.05, len(gap)))
    found = response_times([timed(make_session(names="abcd", answers=PAIRS), seconds.tolist())], THETA)
    assert found is not None
    assert found.median_s == pytest.approx(np.median(seconds))
    assert found.trend is not None
    assert found.trend.slope == pytest.approx(-0.4, abs=0.05)
    assert 0.005 < found.trend.slope_se < 0.05
    assert found.trend.spearman == pytest.approx(spearmanr(gap, seconds).statistic)
    assert found.trend.p < 0.001
    assert found.to_json()["slope_per_nat"] == found.trend.slope


def test_too_fast_answers_are_counted_and_kept(make_session: Maker) -> None:
    session = timed(make_session(names="abcd", answers=PAIRS), [0.1] * 3 + [0.2] + [1.0] * 8)
    found = response_times([session], THETA)
    assert found is not None
    assert (found.answers, found.too_fast, found.too_fast_share) == (12, 3, 0.25)
    strict = response_times([session], THETA, too_fast_s=0.5)
    assert strict is not None
    assert strict.too_fast == 4


@pytest.mark.parametrize("theta", [{}, dict.fromkeys("abcd", 1.0), dict.fromkeys("abcd", float("nan"))])
def test_without_scores_or_differences_there_is_no_trend(make_session: Maker, theta: dict[str, float]) -> None:
    seconds = np.linspace(1, 2, 12).tolist()
    found = response_times([timed(make_session(names="abcd", answers=PAIRS), seconds)], theta)
    assert found is not None
    assert found.trend is None
    assert found.to_json()["spearman"] is None


def test_few_answers_equal_times_and_none(make_session: Maker) -> None:
    few = response_times([make_session(names="abcd", answers=PAIRS[:7])], THETA)
    assert few is not None
    assert few.trend is None
    same = response_times([timed(make_session(names="abcd", answers=PAIRS), [1.0] * 12)], THETA)
    assert same is not None
    assert same.trend is None
    assert response_times([make_session(names="abcd", answers=[])], THETA) is None
