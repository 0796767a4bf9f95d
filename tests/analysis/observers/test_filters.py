"""Leaving observers out by a stated rule, with reasons, and never otherwise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from analysis.comparisons import from_sessions
from analysis.errors import ResultsError
from analysis.observers import Filter, keep
from analysis.observers.responses import CatchAnswers, IdenticalPairs, catch_answers
from analysis.observers.screening import passed_screening
from analysis.records import SessionLog
from tests.answers import changed, new_answer

Maker = Callable[..., SessionLog]
ANSWERS = [("a", "b"), ("b", "a"), ("a", "b")]


def adding(session: SessionLog, kind: str, *data: dict[str, Any]) -> SessionLog:
    first = len(session.answers)
    trials = [
        new_answer(2, first + n, kind, (), 1.0, data={"first": "a", "second": "b", **one}) for n, one in enumerate(data)
    ]
    return replace(session, answers=(*session.answers, *trials))


def caught(session: SessionLog, *right: bool) -> SessionLog:
    return adding(session, "all_pairs", *({"catch": "obvious", "correct": one, "answer": "first"} for one in right))


def screened(session: SessionLog, *, passed: bool, test: str = "stereo_acuity") -> SessionLog:
    outcome = {"passed": passed, "threshold": 80.0, "estimate": None, "pass_mark": 140.0, "unit": "arcsec"}
    return adding(session, "screening", {"test": test, "outcome": outcome})


@pytest.fixture
def four(make_session: Maker) -> list[SessionLog]:
    def session(observer: str) -> SessionLog:
        return make_session(observer, names="ab", answers=ANSWERS)

    return [
        screened(caught(session("01"), True, True), passed=True),
        screened(caught(session("02"), False, True, False), passed=False),
        caught(session("03"), False),
        session("04"),
    ]


def names(sessions: tuple[SessionLog, ...]) -> list[str]:
    return [session.header.observer for session in sessions]


def test_nobody_is_left_out_without_being_asked(four: list[SessionLog]) -> None:
    kept = keep(four, Filter())
    assert kept.sessions == tuple(four)
    assert kept.left_out == {}
    assert kept.rule.sentence == "No observer left out."


@pytest.mark.parametrize(
    ("rule", "left_out"),
    [
        (Filter(without=("04",)), {"04": ("by hand",)}),
        (Filter(most_missed=1), {"02": ("missed 2 of 3 obvious catch trials",)}),
        (
            Filter(most_missed=0),
            {"02": ("missed 2 of 3 obvious catch trials",), "03": ("missed 1 of 1 obvious catch trials",)},
        ),
        (Filter(screening=()), {"02": ("failed the vision screening: stereo acuity",)}),
        (Filter(screening=("stereo_acuity",)), {"02": ("failed the vision screening: stereo acuity",)}),
        (Filter(screening=("near_acuity",)), {}),
        (
            Filter(screening=(), unscreened="leave_out"),
            {
                "02": ("failed the vision screening: stereo acuity",),
                "03": ("was not screened",),
                "04": ("was not screened",),
            },
        ),
        (
            Filter(without=("02",), most_missed=1, screening=()),
            {"02": ("by hand", "missed 2 of 3 obvious catch trials", "failed the vision screening: stereo acuity")},
        ),
    ],
)
def test_who_and_why(four: list[SessionLog], rule: Filter, left_out: dict[str, tuple[str, ...]]) -> None:
    kept = keep(four, rule)
    assert kept.left_out == left_out
    assert names(kept.sessions) == [name for name in ("01", "02", "03", "04") if name not in left_out]
    assert set(from_sessions(kept.sessions).observers) == set(names(kept.sessions))
    assert kept.to_json()["left_out"] == {name: list(why) for name, why in left_out.items()}


def test_the_rule_in_words() -> None:
    rule = Filter(without=("07", "09"), most_missed=1, screening=("stereo_acuity",), unscreened="leave_out")
    for words in ("07, 09 left out by hand", "more than 1 obvious catch trial", "(stereo_acuity)", "unscreened ones"):
        assert words in rule.sentence


def test_who_was_left_out_in_words(four: list[SessionLog]) -> None:
    kept = keep(four, Filter(without=("04",), most_missed=1))
    assert kept.sentence.startswith("Left out: 02 (missed 2 of 3")
    assert kept.to_json()["kept"] == ["01", "03"]
    assert keep(four, Filter()).sentence == "Nobody was left out."


def test_an_observer_is_kept_or_left_out_as_a_whole(make_session: Maker, four: list[SessionLog]) -> None:
    again = caught(make_session("01", names="ab", answers=ANSWERS, session="later"), False)
    assert names(keep([*four, again], Filter(most_missed=0)).sessions) == ["04"]


def test_the_last_screening_counts(make_session: Maker) -> None:
    early = make_session("01", names="ab", answers=ANSWERS, started_utc="2026-01-01T00:00:00Z")
    late = make_session("01", names="ab", answers=ANSWERS, started_utc="2026-02-01T00:00:00Z")
    failed, passed = screened(early, passed=False), screened(late, passed=True)
    assert passed_screening([passed, failed]) is True
    assert passed_screening([screened(late, passed=False), screened(early, passed=True)]) is False
    assert passed_screening([early, late]) is None


@pytest.mark.parametrize(
    ("rule", "what"),
    [
        (Filter(without=("7",)), "no observer '7' to leave out"),
        (Filter(most_missed=-1), "no observer can miss -1"),
        (Filter(without=("01", "02", "03", "04")), "leaves no observer .*01: by hand"),
    ],
)
def test_a_rule_that_cannot_be_meant_is_refused(four: list[SessionLog], rule: Filter, what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        keep(four, rule)


def test_no_sessions_stay_none() -> None:
    assert keep([], Filter()).sessions == ()


def test_catch_trials_of_all_sessions_are_counted_once_each(four: list[SessionLog]) -> None:
    same = adding(
        four[1], "all_pairs", *({"catch": "identical", "answer": to} for to in ("first", "second", "not_sure"))
    )
    practised = caught(four[0], False)
    practised = replace(practised, answers=tuple(changed(one, kind="practice") for one in practised.answers))
    assert catch_answers([same, practised]) == CatchAnswers(3, 1, IdenticalPairs(3, 1, 1))
    wrong = next(trial for trial in same.answers if trial.details().get("correct") is False)
    again = changed(wrong, attempt=1, data={**wrong.details(), "correct": True})
    assert catch_answers([replace(same, answers=(*same.answers, again))]).missed == 1
    assert catch_answers([]).to_json()["obvious"] == 0
