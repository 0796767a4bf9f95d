"""All observers in one table: nobody is dropped, whatever they did."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from analysis.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.observers import ObserverTable, observers_in_comparisons, observers_in_sessions
from analysis.observers.table import ObserverLine
from analysis.records import SessionLog
from tests.answers import changed, new_answer

Maker = Callable[..., SessionLog]
Study = Callable[..., Comparisons]
NAMES = "abcdef"


def by_name(table: ObserverTable) -> dict[str, ObserverLine]:
    return {line.name: line for line in table.lines}


def test_each_session_gives_a_line_and_json_without_nan(sessions: list[SessionLog]) -> None:
    table = observers_in_sessions(sessions, shuffles=99)
    assert [line.name for line in table.lines] == [session.header.observer for session in sessions]
    text = json.dumps(table.to_json(), allow_nan=False)
    assert len(json.loads(text)["observers"]) == 20
    for line in table.lines:
        assert (line.answers, line.sessions, line.complete) == (15, 1, 1)
        assert line.consistency
        assert line.fit
        assert line.side
        assert line.times
        assert line.repeats is None
        assert line.screening_passed is None
    assert table.concordance
    assert table.concordance.observers == 20


def test_sessions_and_their_comparisons_say_the_same(sessions: list[SessionLog]) -> None:
    from analysis.comparisons import from_sessions

    one = observers_in_sessions(sessions, shuffles=0)
    other = observers_in_comparisons(from_sessions(sessions), shuffles=0)
    assert one.concordance == other.concordance
    for with_times, without in zip(one.lines, other.lines, strict=True):
        assert with_times.consistency == without.consistency
        assert with_times.fit == without.fit
        assert without.times is None


def test_several_sessions_of_one_observer_are_one_line(make_session: Maker) -> None:
    table = observers_in_sessions(
        [
            make_session("01", names=NAMES),
            make_session("02", names=NAMES),
            make_session("01", names=NAMES, session="later", complete=False),
        ],
        shuffles=0,
    )
    lines = by_name(table)
    assert list(lines) == ["01", "02"]
    assert (lines["01"].sessions, lines["01"].complete, lines["01"].answers) == (2, 1, 30)
    assert lines["01"].repeats
    assert lines["01"].repeats.repeated == 15
    assert "not completed" in lines["01"].flags


def test_who_answered_nothing_or_only_ties_or_little_keeps_a_line(make_session: Maker) -> None:
    ties = replace(
        make_session("03", names=NAMES, answers=[]),
        answers=(new_answer(1, 0, "all_pairs", (), 1.0, data={"first": "a", "second": "b", "answer": "not_sure"}),),
    )
    table = observers_in_sessions(
        [
            make_session("01", names=NAMES),
            make_session("02", names=NAMES, answers=[], complete=False),
            ties,
            make_session("04", names=NAMES, answers=[("a", "b")], complete=False),
        ],
        shuffles=9,
    )
    lines = by_name(table)
    assert list(lines) == ["01", "02", "03", "04"]
    assert (lines["02"].answers, lines["02"].times, lines["02"].consistency) == (0, None, None)
    assert (lines["03"].answers, lines["03"].ties, lines["03"].fit) == (0, 1, None)
    assert lines["04"].consistency
    assert lines["04"].consistency.test is None
    json.dumps(table.to_json(), allow_nan=False)


def test_sessions_without_comparisons_leave_the_rest(make_session: Maker) -> None:
    outcome = {"passed": False, "threshold": None, "estimate": None, "pass_mark": 140.0, "unit": "arcsec"}
    screening = new_answer(0, 0, "screening", (), 1.0, data={"test": "stereo_acuity", "outcome": outcome})
    empty = make_session("01", names=NAMES, answers=[])
    tie = {"first": "a", "second": "b", "answer": "not_sure"}
    undecided = replace(
        make_session("02", names=NAMES, answers=[]),
        answers=(new_answer(1, 0, "all_pairs", (), 2.0, "2026-01-02T03:04:05Z", tie),),
    )
    table = observers_in_sessions([replace(empty, answers=(screening,)), undecided])
    assert table.concordance is None
    assert [line.flags for line in table.lines] == [("failed the vision screening",), ()]
    assert table.lines[1].ties == 1
    assert table.lines[1].times
    assert table.lines[1].times.median_s == 2
    json.dumps(table.to_json(), allow_nan=False)
    with pytest.raises(ResultsError, match="would count twice"):
        observers_in_sessions([empty, empty])
    with pytest.raises(ResultsError, match="no session"):
        observers_in_sessions([])


def test_flags_say_what_to_look_at_and_drop_nobody(make_session: Maker) -> None:
    firm = [(a, b) for a, b in combinations(NAMES, 2)]
    circle = [("a", "b"), ("b", "c"), ("c", "a"), ("d", "a"), ("b", "d"), ("d", "c")]
    circle += [
        ("e", "a"),
        ("b", "e"),
        ("c", "e"),
        ("e", "d"),
        ("a", "f"),
        ("f", "b"),
        ("f", "c"),
        ("d", "f"),
        ("f", "e"),
    ]
    many = [make_session(f"{number:02d}", names=NAMES, answers=firm) for number in range(10)]
    odd = make_session("odd", names=NAMES, answers=circle)
    miss = new_answer(
        9,
        99,
        "all_pairs",
        (),
        0.1,
        "2026-01-02T03:04:05Z",
        {"first": "a", "second": "b", "catch": "obvious", "correct": False},
    )
    hasty = tuple(changed(trial, response_time_s=0.1) for trial in odd.answers)
    table = observers_in_sessions([*many, replace(odd, answers=(*hasty, miss))], shuffles=0)
    assert len(table.lines) == 11
    line = by_name(table)["odd"]
    assert table.outliers == ("odd",)
    assert line.flags == (
        "answers unlike the others",
        "no more consistent than chance",
        "missed 1 of 1 catch trials",
        "15 answers below 0.2 s",
    )
    assert by_name(table)["03"].flags == ()


def test_some_circular_triads_are_no_reason_to_doubt(make_session: Maker) -> None:
    firm = [("f", "a") if pair == ("a", "f") else pair for pair in combinations(NAMES, 2)]
    (line,) = observers_in_sessions([make_session("01", names=NAMES, answers=firm)]).lines
    assert line.consistency
    assert line.consistency.circular == 4
    assert line.flags == ()


def test_a_level_is_the_users_choice(study: Study) -> None:
    random = np.random.default_rng(1)
    comparisons = study(np.tile(np.linspace(-1, 1, 5), (8, 1)), random)
    assert observers_in_comparisons(comparisons, level=1.0, shuffles=0).outliers == comparisons.observers
    assert observers_in_comparisons(comparisons, level=0.0, shuffles=0).outliers == ()
