"""Presses that were not meant for what is on the screen: real double presses and held keys in a real window."""

from __future__ import annotations

import time
from typing import Any

import pytest

from analysis.kinds import Trial

Person = Any  # tests/conftest.py
pytestmark = pytest.mark.window

# Each answer takes longer to be on disk than the one before; presses arrive meanwhile.
SLOW_DISK = """
import itertools, os, time
_fsync, _delays = os.fsync, itertools.cycle([0.0, 0.03, 0.15])
def _slow(file):
    _fsync(file)
    time.sleep(next(_delays))
os.fsync = _slow
"""
READY_S = 0.5  # after a scene was seen, until someone answers it


def begin(person: Person, *more: str) -> None:
    person.sit_down(*more)
    person.turn("space", "the first pair")


def pairs(person: Person) -> list[Trial]:
    return [trial for trial in person.log().trials if trial.kind == "all_pairs"]


def press_twice(person: Person, first: str, second: str, gap_s: float) -> None:
    """Press two keys; the second is meant for nothing."""
    time.sleep(READY_S)
    before = person.answers()
    person._xdotool("key", "--delay", "0", first, "sleep", str(gap_s), "key", "--delay", "0", second)
    person.until(lambda: person.answers() > before, "the answer to be on disk")
    time.sleep(READY_S)
    assert person.answers() == before + 1


@pytest.mark.nightly
@pytest.mark.promise("press")
def test_the_second_press_of_a_double_press_answers_nothing(person: Person) -> None:
    person.before = SLOW_DISK
    begin(person)
    for number in range(4):
        press_twice(person, "Up", "Up" if number % 2 else "Down", (0.02, 0.06)[number // 2])
    person.turn("space")  # the break after four
    press_twice(person, "Up", "Down", 0.04)
    person.press("Up")
    assert "6 answers are in" in person.leave()
    trials = pairs(person)
    assert [trial.details()["answer"] for trial in trials] == ["first"] * 6
    assert all(trial.response_time_s >= 0.1 for trial in trials)
    ignored = [press for trial in person.log().trials for press in trial.details().get("ignored", [])]
    meant = [why for _, _, why in ignored if why != "no_meaning"]
    assert len(meant) >= 3  # the fourth pair is followed by a page that no arrow answers
    assert set(meant) <= {"before", "early", "double"}
    assert {key for key, _, why in ignored if why == "no_meaning"} <= {"up", "down"}  # pressed at a page


def test_a_key_that_is_held_answers_one_trial_and_must_be_pressed_again(person: Person) -> None:
    begin(person)
    time.sleep(READY_S)
    person._xdotool("keydown", "Up", "sleep", "1.5")
    assert person.answers() == 1
    person._xdotool("keyup", "Up")
    time.sleep(READY_S)
    person.press("Up")
    person.until(lambda: person.answers() == 2, "the second answer")
    second = pairs(person)[1]
    assert ["Up".lower(), "held"] in [[key, why] for key, _, why in second.details()["ignored"]]
    person.press("alt+F4")
    person.close_the_window()
    person.leave()
