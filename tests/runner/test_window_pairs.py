"""Pairs in sequence and preferences in a real window, answered by real keys."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np
import pytest

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.window, pytest.mark.nightly]

BLOCKS = """\
  - {kind: all_pairs, stimuli: [one, two], presentation: sequence, exposure_s: 0.3, blank_between_s: 0.2, repeats: 3,
     ties: both}
  - {kind: preference, pairs: [[one, three]], presentation: simultaneous}
  - {kind: preference, pairs: [[two, four]], blank_between_s: 0}
"""
STILL_S = 1.0  # longer than anything that goes by itself


def settle(person: Person) -> None:
    """Wait until the screen has not changed for a while."""
    seen, since = person.look(), time.monotonic()
    while time.monotonic() - since < STILL_S:
        time.sleep(0.05)
        now = person.look()
        if np.any(now != seen):
            seen, since = now, time.monotonic()


def recorded(person: Person, kind: str) -> list[Any]:
    """Return the trials of a kind that are on disk."""
    return [trial for trial in person.log().trials if trial.kind == kind]


def more_than(person: Person, kind: str, count: int) -> bool:
    return len(recorded(person, kind)) > count


def answered(person: Person, kind: str, *keys: str) -> None:
    """Answer what is on the screen once it stands still, and wait for the record."""
    for key in keys:
        settle(person)
        before = len(recorded(person, kind))
        person.press(key)
        person.until(partial(more_than, person, kind, before), f"the answer '{key}' to be on disk")


def test_pairs_and_preferences_with_real_keys(person: Person) -> None:
    person.study.edit("small.yaml", "  - {kind: all_pairs, break_every: 4}\n", BLOCKS)
    person.sit_down()
    person.press("space")
    settle(person)
    person.press("space")  # two pictures will follow one another
    answered(person, "all_pairs", "2", "u", "Left")
    answered(person, "preference", "Down")
    settle(person)
    person.press("space")
    settle(person)
    person.press("space")
    settle(person)
    person.press("space")
    answered(person, "preference", "Right")
    assert "5 answers are in" in person.leave()
    log = person.log()
    assert log.complete
    pairs, preferences = recorded(person, "all_pairs"), recorded(person, "preference")
    assert [trial.details()["answer"] for trial in pairs] == ["second", "not_sure", "first"]
    for trial in pairs:
        held = [scene["what"] for scene in trial.details()["timed"]]
        assert held == ["interval_1", "between", "interval_2"]
    assert [trial.details()["answer"] for trial in preferences] == ["second", "second"]
    assert [trial.details()["first_position"] for trial in preferences] == ["top", "interval_1"]
    views = {"one": "stereo", "two": "stereo", "three": "flat", "four": "flat"}
    assert [trial.details()["chosen_view"] for trial in preferences] == [
        views[trial.details()["chosen"]] for trial in preferences
    ]
    at_once, own_pace = (trial.details().get("interval_s") for trial in preferences)
    assert at_once is None
    assert len(own_pace) == 2
    assert all(seconds >= STILL_S / 2 for seconds in own_pace)
