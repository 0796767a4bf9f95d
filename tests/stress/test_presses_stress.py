"""Double presses and storms in a real window, on disks of any speed: no answer that was not meant."""

from __future__ import annotations

import time
from itertools import cycle
from typing import Any

import numpy as np
import pytest

from analysis.observers import FastAnswers

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.stress, pytest.mark.window]

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
