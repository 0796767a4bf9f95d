"""Where a session stands, in words."""

from __future__ import annotations

from runner.session import SessionStatus
from tests.answers import new_answer
from tests.runner.every_kind import met, setting

PLACE = setting("abcde")
PAIRS = met("all_pairs", PLACE)  # 10 trials of 5 s
UTC = "2026-01-01T00:00:00.000+00:00"


SCENE = {"what": "pair", "frames": 3, "asked_ms": 50.0, "shown_ms": 50.0}


class _Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def _status() -> tuple[SessionStatus, _Clock]:
    clock = _Clock()
    look = met("instructions", PLACE, text="Look.")
    blocks = (("instructions", look.trials, look.expected_s), ("all_pairs", PAIRS.trials, PAIRS.expected_s))
    return SessionStatus(blocks, clock), clock


def _answer(status: SessionStatus, clock: _Clock, trial: int, took_s: float, attempt: int = 0, missed: int = 0) -> None:
    clock.now_s += took_s
    data = {"answer": "first", "timed": [{**SCENE, "missed_frames": missed}]}
    status.update(new_answer(1, trial, "all_pairs", (("up", 1.0),), min(took_s, 1.24), UTC, data, attempt))


def test_time_left_follows_the_observer_s_own_pace() -> None:
    status, clock = _status()
    assert status.minutes_left * 60 == 50 + 3
    clock.now_s += 30  # a slow reader says nothing of the pace
    status.update(new_answer(0, 0, "instructions", (("space", 30.0),), 30.0, UTC))
    assert status.minutes_left * 60 == 50
    for trial in range(5):
        _answer(status, clock, trial, 2.5)
    assert abs(status.minutes_left * 60 - 12.5) < 1e-9
    _answer(status, clock, 5, 600.0)  # a long pause is one trial of many
    assert abs(status.minutes_left * 60 - 10.0) < 1e-9


def test_the_line_says_all_of_it() -> None:
    status, clock = _status()
    status.update(new_answer(0, 0, "instructions", (("space", 3.0),), 3.0, UTC))
    for trial in range(4):
        _answer(status, clock, trial, 5.0, missed=trial)
    assert status.line() == (
        "trial 4 of 10 · block 2 of 2: all pairs · about 30 s left · missed frames 6 · "
        "last: first 1.2 s, first 1.2 s, first 1.2 s"
    )


def test_a_trial_asked_again_counts_once() -> None:
    status, clock = _status()
    for trial in range(10):
        _answer(status, clock, trial, 5.0)
    _answer(status, clock, 3, 5.0, attempt=1)
    assert (status.answered, status.trials) == (10, 10)
    assert "all answered" in status.line()
    assert status.line().endswith("first 1.2 s (again)")


def test_what_a_resumed_session_reads_from_its_log_says_nothing_of_the_pace() -> None:
    status, clock = _status()
    for trial in range(6):
        clock.now_s += 0.001
        status.update(new_answer(1, trial, "all_pairs", (("up", 2.0),), 2.0, UTC, {"answer": "first"}))
    assert status.answered == 6
    assert abs(status.minutes_left * 60 - (20 + 3)) < 1e-9
    assert "last:" not in status.line()


def test_words_that_someone_typed_are_cut_and_harmless() -> None:
    status, clock = _status()
    clock.now_s += 5
    status.update(new_answer(1, 0, "questionnaire", (), 5.0, UTC, {"answer": "\x1b[2J" + "long " * 20}))
    assert "\x1b" not in status.line()
    assert len(status.line()) < 140
