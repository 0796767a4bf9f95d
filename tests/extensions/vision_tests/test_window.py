"""Vision tests in a real window, answered by real keys and clicks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analysis.observers import passed_screening
from runner.blocks import Block
from runner.observers import walk
from runner.ports import Ask, Choose
from runner.protocol import read_experiment

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.window, pytest.mark.nightly]
SCREENING = """\
blocks:
  - kind: screening
    on_fail: stop
    tests:
      - {test: stereo_acuity, levels_arcsec: [400], repeats: 2, required: 2}
      - {test: near_acuity, levels_logmar: [0.4], repeats: 1, required: 1}
"""


@pytest.fixture
def screening(person: Person) -> Block:
    """The block that the person who sits down will meet."""
    told = person.study.experiment.read_text()
    person.study.experiment.write_text(told[: told.index("blocks:")] + SCREENING)
    return read_experiment(person.study.experiment).blocks("07")[0]


def screened(person: Person) -> int:
    return len(person.log().answers) if list(person.study.results.rglob("session.jsonl")) else 0


def act(person: Person, key: str, *, records: bool) -> None:
    """Press a key, and wait for the next screen and, if it answers, for its record."""
    before, seen = screened(person), person.look()
    person.press(key)
    if records:
        person.until(lambda: screened(person) > before, f"the record of '{key}'")
    person.until(lambda: person.process.poll() is not None or np.any(person.look() != seen), "the next screen")


def test_a_person_who_sees_passes(person: Person, screening: Block) -> None:
    person.sit_down()
    for ask in walk(screening):
        if isinstance(ask, Ask):
            asked = ask.task
            right = str(asked.correct).capitalize() if isinstance(asked, Choose) else "space"
            act(person, right, records=isinstance(asked, Choose))
    person.leave()
    log = person.log()
    assert log.complete
    assert passed_screening([log]) is True
    assert sum(not trial.is_outcome for trial in log.trials) == screening.trials
    shown = [trial for trial in log.trials if "correct" in trial.details()]
    assert all(trial.details()["correct"] and 0.0 < trial.response_time_s < 60.0 for trial in shown)
