"""Presses and pushes in a real window: no answer that was not meant, nothing lost."""

from __future__ import annotations

import time
from itertools import cycle
from typing import Any

import numpy as np
import pytest

from analysis.observers import FastAnswers

pytestmark = [pytest.mark.stress, pytest.mark.window]


# A window pushed about while an observer answers: nothing is lost, and the session goes on.

Person = Any  # tests/conftest.py


@pytest.mark.parametrize(
    "shoves",
    [
        [("windowmove", "37", "21"), ("windowmove", "0", "0")],
        [("windowunmap",), ("windowmap",)],
        [("windowsize", "500", "400"), ("windowsize", "640", "480")],
    ],
    ids=["moved", "taken away and brought back", "resized"],
)
def test_a_window_shoved_in_mid_trial(person: Person, shoves: list[tuple[str, ...]]) -> None:
    person.sit_down("--windowed")
    page = person.look()
    person.press("space")
    person.until(lambda: (person.look() != page).any(), "the first pair")
    person.answer("Up")
    time.sleep(0.3)
    before = person.look()
    for words in shoves:
        person.window(*words)
        time.sleep(0.3)
    person.window("windowfocus")
    person.until(lambda: (person.look() == before).all(), "the same pair to be on the screen again")
    person.answer("Down", "Up", "Down")
    person.press("space")
    time.sleep(0.3)
    person.answer("Up")
    person.press("Down")
    assert "6 answers are in" in person.leave()
    answers = [trial.details()["answer"] for trial in person.log().trials if trial.kind == "all_pairs"]
    assert answers == ["first", "second", "first", "second", "first", "second"]


# Double presses and storms in a real window, on disks of any speed: no answer that was not meant.

SLOW_DISK = """
import os, time
_fsync = os.fsync
def _slow(file):
    _fsync(file)
    time.sleep({delay_s})
os.fsync = _slow
"""
PRESSES = 30
READY_S = 0.5
AGAIN_S = 10.0  # a busy machine may show a pair so late that what was pressed came too soon: then press again


def begin(person: Person, repeats: int) -> None:
    person.study.edit("small.yaml", "break_every: 4", f"repeats: {repeats}")
    person.sit_down()
    page = person.look()
    person.press("space")
    person.until(lambda: np.any(person.look() != page), "the first pair")


@pytest.mark.parametrize("delay_s", [0.0, 0.03, 0.15])
def test_of_thirty_double_presses_none_answers_twice(person: Person, delay_s: float) -> None:
    person.before = SLOW_DISK.format(delay_s=delay_s)
    begin(person, 6)
    pressed = 0
    for number, gap_s in zip(range(1, PRESSES + 1), cycle([0.02, 0.04, 0.06]), strict=False):
        second = "Up" if number % 2 else "Down"
        while person.answers() < number:
            assert pressed < 1.4 * PRESSES, person.answers()
            person._xdotool("key", "--delay", "0", "Up", "sleep", str(gap_s), "key", "--delay", "0", second)
            pressed += 1
            end = time.monotonic() + AGAIN_S
            while person.answers() < number and time.monotonic() < end:
                time.sleep(0.1)
        time.sleep(READY_S)
        assert person.answers() == number
    trials = [trial for trial in person.log().trials if trial.kind == "all_pairs"]
    assert {trial.details()["answer"] for trial in trials} == {"first"}


@pytest.mark.parametrize(("delay_ms", "pairs"), [(5, 700), (20, 700), (45, 350), (150, 150)])
def test_a_storm_of_presses_does_not_complete_a_session_unnoticed(person: Person, delay_ms: int, pairs: int) -> None:
    begin(person, 50)  # 300 trials
    time.sleep(READY_S)
    person._xdotool("key", "--delay", str(delay_ms), *["Up", "Down"] * pairs)
    answered = person.answers()
    print(f"{2 * pairs} presses, one every {delay_ms} ms: {answered} of 300 answered")
    haste = FastAnswers.of(person.log().trials)
    assert answered < 10 or haste.striking
