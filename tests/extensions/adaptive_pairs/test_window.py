"""Pairs chosen by the answers of all observers, in a real window with real keys, while another station records."""

from __future__ import annotations

from typing import Any

import pytest

from analysis.records import SessionLog, read_session, session_files
from analysis.seals import check_log
from runner.protocol import read_experiment
from tests.extensions.adaptive_pairs.pooled_sessions import asked, sit

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.window, pytest.mark.nightly]


def own_log(person: Person) -> SessionLog:
    """Return the log of the person's own session: others lie beside it."""
    (file,) = session_files(person.study.results / "small" / "sub-07")
    return read_session(file)


def answer(person: Person, *keys: str) -> None:
    """Answer pairs, each once the one before is on disk and the next is on the screen."""
    for key in keys:
        before, seen = len(asked(own_log(person))), person.look()
        person.press(key)
        person.until(lambda before=before: len(asked(own_log(person))) > before, f"'{key}' to be on disk", looked_s=0.0)
        person.until(lambda seen=seen: (person.look() != seen).any(), "the next screen")


def test_a_person_is_asked_by_what_others_answered_before_and_meanwhile(person: Person) -> None:
    study = person.study
    study.edit("small.yaml", "{kind: all_pairs, break_every: 4}", "{kind: active_pairs, trials: 8, pool: results}")
    design = read_experiment(study.experiment)
    before = sit(design, study.results, "01", seed=1)
    person.sit_down()
    person.turn("space")
    answer(person, "Up", "Down", "Up")
    person.process.kill()
    person.process.communicate()
    stopped = own_log(person)
    meanwhile = sit(design, study.results, "02", seed=2)
    person.sit_down("--resume")
    answer(person, "Up", "Down", "Up", "Down")
    answer(person, "Up")
    person.leave()
    log = own_log(person)
    assert log.complete
    assert not check_log(log.file).findings
    assert log.pooled[: len(stopped.pooled)] == stopped.pooled
    earlier, later = f"01/{before.header.session}", f"02/{meanwhile.header.session}"
    assert log.pooled[0].sessions == {earlier: 8}
    assert log.pooled[-1].sessions == {earlier: 8, later: 8}
    chosen = [(one.stimuli[i], one.stimuli[j]) for one in log.pooled for i, j in one.pairs]
    assert asked(log) == chosen
    assert len(chosen) == 8
