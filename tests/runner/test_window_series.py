"""Series and ratings in a real window, answered by real keys, wheel and mouse."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np
import pytest

from runner.observers import walk
from runner.ports import Ask
from runner.protocol import read_experiment

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.window, pytest.mark.nightly]

STILL_S = 1.0
BLOCKS = """\
  - kind: rating
    stimuli: [one]
    ratings: [{name: quality, question: How good, lowest: 0, highest: 100}]
  - kind: best_of_series
    series: {all: [one, two, three, four]}
    start: first
    ratings: [{name: similarity, question: How similar}]
"""


def changed(person: Person, seen: Any) -> bool:
    return bool(np.any(person.look() != seen))


def do(person: Person, *acts: Any) -> None:
    """Do one thing after another, each once the screen shows what came of the last."""
    for act in acts:
        seen = person.look()
        act()
        person.until(partial(changed, person, seen), "the screen to change")


def stand_still(person: Person) -> None:
    """Wait until the screen has not changed for a while: a click meets what is seen."""
    seen, since = person.look(), time.monotonic()
    while time.monotonic() - since < STILL_S:
        time.sleep(0.1)
        if changed(person, seen):
            seen, since = person.look(), time.monotonic()


def ended(person: Person) -> bool:
    return bool(person.log().complete)


def test_a_rating_by_mouse_and_a_series_by_wheel_and_keys(person: Person) -> None:
    person.study.edit("small.yaml", "  - {kind: all_pairs, break_every: 4}\n", BLOCKS)
    person.sit_down()
    do(person, partial(person.press, "space"))
    for meaning in ("37", "accept"):
        stand_still(person)
        person.click(*_place(person, meaning))
    stand_still(person)
    key, wheel = partial(partial, person.press), partial(partial, person.wheel)
    do(person, wheel(-1), key("Right"))
    person.press("Return")  # nothing can be chosen yet
    do(person, key("Right"), wheel(1), key("Return"), key("7"), wheel(1), key("Left"), key("Right"))
    person.press("Return")
    person.until(partial(ended, person), "the session to end")
    assert "2 answers are in" in person.leave()
    rating, series = (trial for trial in person.log().trials if trial.kind in ("best_of_series", "rating"))
    assert [index for index, _ in series.details()["path"]] == [0, 1, 2, 3, 2]
    assert series.details()["chosen"] == "three"
    assert series.details()["ratings"] == {"similarity": 8}
    assert rating.details()["ratings"] == {"quality": 37}
    assert [pressed for pressed, _ in rating.events] == ["click 37", "click accept"]


def _place(person: Person, meaning: str) -> tuple[int, int]:
    """Return where to click on the rating's scale, from the middle of a view."""

    block = read_experiment(person.study.experiment).blocks("07")[1]
    rating = next(step for step in walk(block) if isinstance(step, Ask) and meaning in step.targets)
    x, y = rating.targets[meaning].offset_px
    return x, y
