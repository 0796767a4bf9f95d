"""A person's session by mouse and wheel, and a questionnaire, in a real window with real events sent by xdotool."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from runner.blocks.questionnaire import Questionnaire
from runner.ports import Ask
from runner.protocol import read_experiment

Person = Any  # tests/conftest.py
pytestmark = pytest.mark.window

QUESTIONS = """\
  - kind: questionnaire
    questions:
      - {name: hand, kind: choice, question: "Which hand do you write with?", options: [Left, Right, Both]}
      - {name: glasses, kind: choice, question: "Do you wear glasses?", options: ["Yes", "No"], required: false}
      - {name: age, kind: number, question: "How old are you?", unit: years, lowest: 16, highest: 99, whole: true}
      - {name: remarks, kind: text, question: "Anything else?", required: false}
"""


def _recorded(person: Person, kind: str) -> list[Any]:
    return [trial for trial in person.log().trials if trial.kind == kind]


def _has(person: Person, kind: str, count: int) -> bool:
    return len(_recorded(person, kind)) == count


def _changed(person: Person, do: Callable[[], object]) -> None:
    """Do something, and wait until the screen shows something else."""
    seen = person.look()
    do()
    person.until(lambda: bool(np.any(person.look() != seen)), "another screen")


def test_all_pairs_by_click(person: Person) -> None:
    """The upper picture's middle is 30 px above the middle of each eye's view, in any mode."""
    person.sit_down()
    _changed(person, lambda: person.press("space"))
    for number, (y, clicked) in enumerate([(-30, "first"), (30, "second"), (30, "second"), (-30, "first")], start=1):
        person.click(0, 0)  # between the two: no answer
        time.sleep(0.2)
        assert len(_recorded(person, "all_pairs")) == number - 1
        person.click(10, y)
        person.until(partial(_has, person, "all_pairs", number), f"the click on the {clicked} picture to be on disk")
        assert _recorded(person, "all_pairs")[-1].events[-1][0] == f"click {clicked}"
    person.turn("space")  # the break after four
    person.answer("Down")
    person.press("Up")
    assert "6 answers are in" in person.leave()
    pairs = _recorded(person, "all_pairs")
    assert [trial.details()["answer"] for trial in pairs] == ["first", "second", "second", "first", "second", "first"]
    assert all(0.0 < trial.response_time_s < 30.0 for trial in pairs)


@pytest.mark.nightly
def test_a_questionnaire_by_mouse_wheel_and_typing(person: Person) -> None:
    text = person.study.experiment.read_text()
    person.study.experiment.write_text(text[: text.index("  - {kind: instructions")] + QUESTIONS)
    (block,) = read_experiment(person.study.experiment).blocks("07")
    assert isinstance(block.entry, Questionnaire)
    first = next(block.steps())
    assert isinstance(first, Ask)
    person.sit_down()
    person.click(*first.targets["2"].offset_px)
    person.until(partial(_has, person, "questionnaire", 1), "the clicked hand")
    time.sleep(0.3)
    _changed(person, lambda: person.wheel(-1))
    _changed(person, lambda: person.wheel(-1))
    person.press("Return")
    person.until(partial(_has, person, "questionnaire", 2), "the answer on glasses")
    time.sleep(0.3)
    person.type("7")
    _changed(person, lambda: person.press("Return"))  # told, and not accepted
    assert len(_recorded(person, "questionnaire")) == 2
    person.type("x2")
    person.press("Return")
    person.until(partial(_has, person, "questionnaire", 3), "the age")
    time.sleep(0.3)
    person.type("Very good oops")
    person._xdotool("keydown", "BackSpace", "sleep", "1.5", "keyup", "BackSpace")  # held: it rubs out more than one
    time.sleep(0.3)
    person.type("Fine.")
    person.press("Return")
    assert "4 answers are in" in person.leave()
    hand, glasses, age, remarks = (trial.details()["answer"] for trial in _recorded(person, "questionnaire"))
    assert (hand, glasses, age) == ("Right", "No", 72)
    assert remarks.endswith("Fine.")
    assert len(remarks) < len("Very good oops") - 1 + len("Fine.")
    assert _recorded(person, "questionnaire")[0].events[-1][0] == "click 2"
