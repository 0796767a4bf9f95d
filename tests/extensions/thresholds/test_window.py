"""Thresholds in a real window, answered by real keys and clicks: a forced choice, then yes or no."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest

from extensions.thresholds import Staircase
from tests.runner.test_window_pairs import answered, more_than, recorded, settle

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.window, pytest.mark.nightly]

BLOCKS = """\
  - {kind: threshold, factor: contrast, task: two_places, reference: four, trials: 4,
     method: {kind: staircase, up: 1, start: [below]}}
  - {kind: threshold, factor: contrast, task: yes_no, stimuli: [one, two, three], trials: 3}
"""


def test_levels_follow_real_keys_and_clicks(person: Person) -> None:
    study = person.study
    for level, name in enumerate(("one", "two", "three"), 1):
        study.edit("recipe.yaml", f"{name}.exr}}", f"{name}.exr, factors: {{contrast: {level}}}}}")
    study.edit("small.yaml", "  - {kind: all_pairs, break_every: 4}\n", BLOCKS)
    person.sit_down()
    person.press("space")
    answered(person, "threshold", "Up", "Up", "Down")
    settle(person)
    person.click(0, 30)  # the lower picture
    person.until(partial(more_than, person, "threshold", 3), "the click to be on disk")
    answered(person, "threshold", "Left", "Right")
    settle(person)
    person.click(-40, 25)  # "left arrow: yes"
    person.until(partial(more_than, person, "threshold", 6), "the click to be on disk")
    assert "7 answers are in" in person.leave()
    assert person.log().complete
    trials = [trial.details() for trial in recorded(person, "threshold")]
    forced, yes_no = trials[:4], trials[4:]
    assert [data["answer"] for data in forced] == ["first", "first", "second", "second"]
    assert [data["answer"] for data in yes_no] == ["yes", "no", "yes"]
    stairs = Staircase(3, 1, 1, 1)
    for data in forced:
        assert data["level"] == 1 + stairs.next_level()
        stairs.learn(stairs.next_level(), right=data["answer"] == data["correct_answer"])
    assert {data["stimulus"] for data in yes_no} <= {"one", "two", "three"}
