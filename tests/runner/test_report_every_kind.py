"""A report on sessions of every kind of block, as they are really recorded."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from analysis.errors import ResultsError
from analysis.kinds import KINDS
from analysis.records import SessionLog, new_header
from analysis.report import describe, write_report
from runner.protocol import Experiment
from runner.session import Session
from tests.answers import changed
from tests.pages import Page
from tests.runner import every_kind as EVERY
from tests.runner.every_kind import VARIANTS


def log_of(experiment: Experiment, observer: str) -> SessionLog:
    stage = EVERY.Stage()
    Session(experiment.blocks(observer), stage, EVERY.Fickle(int(observer)), stage).run()
    kept = tuple(changed(trial, data=json.loads(json.dumps(trial.details()))) for trial in stage.trials)
    stimuli = tuple({"name": name, "factors": {}, "flat": True} for name in "abcdef")
    header = new_header("every_kind", observer, "s", "2026-01-01T00:00:00Z", simulated=True, stimuli=stimuli)
    return SessionLog(Path(f"{observer}.jsonl"), header, kept, complete=True)


# All variants, each with its figures, and by one observer: tests/stress.
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(("kind", "variant"), [one for one in VARIANTS if not one[1]])
def test_sessions_of_every_kind_make_a_page_or_a_clear_refusal(kind: str, variant: int, tmp_path: Path) -> None:
    make_a_page(kind, variant, 3, tmp_path)


def make_a_page(kind: str, variant: int, observers: int, tmp_path: Path) -> None:
    experiment = EVERY.of_kind(kind, variant)
    sessions = [log_of(experiment, f"{number:02d}") for number in range(1, observers + 1)]
    report = write_report(sessions, tmp_path / "report.html", csv_folder=tmp_path / "tables")
    json.dumps(report.to_json(), allow_nan=False)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    words = set(re.findall(r"[a-z]+", Page(re.sub(r"<style.*?</style>", "", page, flags=re.DOTALL)).text.lower()))
    assert not words & {"nan", "none", "inf"}
    assert any((tmp_path / "tables").iterdir())
    scored = {t.kind for session in sessions for t in session.trials if t.kind in KINDS and KINDS[t.kind].heading}
    assert any("the sessions have no comparison" in note for note in report.notes) != bool(scored)


def test_sessions_that_stopped_before_an_answer_are_refused() -> None:
    log = log_of(EVERY.of_kind("instructions", 0), "01")
    assert describe([log]).kinds == ()
    with pytest.raises(ResultsError, match="the results hold no answer"):
        describe([replace(log, complete=False)])
