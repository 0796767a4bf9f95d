"""A window pushed about while an observer answers: nothing is lost, and the session goes on."""

from __future__ import annotations

import time
from typing import Any

import pytest

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.stress, pytest.mark.window]


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
