"""From sessions to comparisons, and what must not be mixed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from analysis.comparisons import from_sessions
from analysis.errors import ResultsError
from analysis.records import SessionLog
from tests.answers import changed, new_answer, refusal

Maker = Callable[..., SessionLog]


def test_each_observers_answers_are_counted_and_kept_apart(make_session: Maker) -> None:
    sessions = [
        make_session("01", names="abc", answers=[("b", "a"), ("b", "c"), ("a", "c")]),
        make_session("02", names="abc", answers=[("a", "b"), ("b", "c")], complete=False),
    ]
    comparisons = from_sessions(sessions)
    assert comparisons.items == ("a", "b", "c")
    assert comparisons.wins.tolist() == [[0, 1, 1], [1, 0, 2], [0, 0, 0]]
    assert comparisons.observers == ("01", "02")
    assert comparisons.wins_by_observer()[1].tolist() == [[0, 1, 0], [0, 0, 1], [0, 0, 0]]


def test_stimuli_that_no_pair_shows_are_no_items(make_session: Maker) -> None:
    assert from_sessions([make_session(names="abcd", answers=[("d", "b")])]).items == ("b", "d")


def test_a_trial_may_name_the_group_of_its_pair(make_session: Maker) -> None:
    session = make_session(names="abcd", answers=[("a", "b"), ("d", "c")])
    assert from_sessions([session]).groups == ()
    trials = [
        changed(trial, data={**trial.details(), "group": name})
        for trial, name in zip(session.trials, "xy", strict=True)
    ]
    comparisons = from_sessions([replace(session, answers=tuple(trials))])
    assert comparisons.groups == ("x", "y")
    assert comparisons.group.tolist() == [0, 1]


def test_other_kinds_of_trials_are_passed_over(make_session: Maker) -> None:
    session = make_session(names="ab", answers=[("a", "b")])
    question = new_answer(2, 0, "questionnaire", (), 1.0, data={"text": "fine"})
    assert from_sessions([replace(session, answers=(*session.trials, question))]).wins.sum() == 1


def test_the_share_of_the_first_position_counts_answers(make_session: Maker) -> None:
    session = make_session(names="ab", answers=[("a", "b")] * 40)
    firsts = sum(trial.details()["first"] == "a" for trial in session.trials)
    assert 0 < firsts < 40
    assert from_sessions([session]).first_share() == firsts / 40


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"experiment": "gloss"}, "'gloss'"),
        ({"names": ("1.1 mono", "other")}, "same stimuli"),
        ({"observer": "01"}, "would count twice"),
    ],
)
def test_what_does_not_belong_together_is_refused(make_session: Maker, change: dict[str, Any], what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        from_sessions([make_session("01"), make_session(**{"observer": "02", **change})])


def test_the_folder_of_one_of_two_experiments_is_named(make_session: Maker) -> None:
    other = make_session("02", experiment="gloss")
    for file, remedy in (
        (Path("results/gloss/sub-02/ses-x/session.jsonl"), "at a time: name its folder, such as results/gloss"),
        (Path("copied/session.jsonl"), "report one experiment at a time"),
    ):
        with pytest.raises(ResultsError) as error:
            from_sessions([make_session("01"), replace(other, file=file)])
        assert str(error.value.findings[0].remedy).endswith(remedy)


def test_no_session_and_no_answer_are_refused(make_session: Maker) -> None:
    with pytest.raises(ResultsError, match="no session"):
        from_sessions([])
    with pytest.raises(ResultsError, match="no paired comparison"):
        from_sessions([make_session(answers=[])])


@pytest.mark.parametrize(
    ("damage", "what"),
    [
        ({"first": "x", "second": "a", "answer": "first", "chosen": "x", "rejected": "a"}, "'x', which is no stimulus"),
        ({"first": "a", "second": "a"}, "compares 'a' with 'a'"),
        ({"chosen": None}, "is chosen"),
    ],
)
def test_a_damaged_answer_is_refused(make_session: Maker, tmp_path: Path, damage: dict[str, Any], what: str) -> None:
    assert what in str(refusal(make_session(names="ab", answers=[("a", "b")]), tmp_path, **damage))


def _with(session: SessionLog, *more: dict[str, Any]) -> SessionLog:
    first = len(session.answers)
    trials = [
        new_answer(
            1,
            first + number,
            "all_pairs",
            (("up", 1.0),),
            1.0,
            "2026-01-02T03:04:05Z",
            {"first": "a", "second": "b", **data},
        )
        for number, data in enumerate(more)
    ]
    return replace(session, answers=(*session.answers, *trials))


def test_ties_are_left_out_of_the_wins_and_counted(make_session: Maker) -> None:
    plain = make_session(names="ab", answers=[("a", "b"), ("b", "a")])
    assert from_sessions([plain]).ties == 0
    comparisons = from_sessions([_with(plain, {"answer": "no_difference"}, {"answer": "not_sure"})])
    assert comparisons.ties == 2
    assert comparisons.wins.tolist() == [[0, 1], [1, 0]]


def test_ties_alone_are_no_comparison(make_session: Maker) -> None:
    with pytest.raises(ResultsError, match="the one answer prefers neither"):
        from_sessions([_with(make_session(names="ab", answers=[]), {"answer": "not_sure"})])


def test_catch_trials_are_left_out(make_session: Maker) -> None:
    plain = make_session(names="ab", answers=[("a", "b")])
    obvious = {"answer": "first", "chosen": "a", "rejected": "b", "catch": "obvious", "correct": True}
    identical = {"second": "a", "answer": "first", "catch": "identical"}
    comparisons = from_sessions([_with(plain, obvious, identical, {**identical, "answer": "not_sure"})])
    assert comparisons.wins.tolist() == [[0, 1], [0, 0]]
    assert comparisons.ties == 0


def test_another_kind_of_comparison_is_not_mixed_in(make_session: Maker) -> None:
    session = make_session(names="ab", answers=[("a", "b")])
    preference = new_answer(2, 0, "preference", (), 1.0, data={"chosen": "a", "rejected": "b"})
    assert from_sessions([replace(session, answers=(*session.trials, preference))]).wins.sum() == 1
