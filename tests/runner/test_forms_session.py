"""Questionnaires and practice in whole sessions: answered by a simulated observer, and counted by no analysis."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from analysis.comparisons import from_sessions
from analysis.records import SessionLog, read_session, session_files
from runner.cli.main import group

Study = Any  # tests/conftest.py
BLOCKS = """\
blocks:
  - kind: questionnaire
    questions:
      - {name: age, kind: number, question: "How old are you?", unit: years, lowest: 16, highest: 99, whole: true}
      - {name: hand, kind: choice, question: "Which hand do you write with?", options: [Left, Right]}
      - {name: remarks, kind: text, question: "Anything else?", required: false}
  - kind: practice
    trials: 4
    block: {kind: all_pairs, catch: {every: 2, pairs: [[four, one]]}}
  - {kind: all_pairs}
"""


@pytest.fixture
def log(study: Study) -> SessionLog:
    """The log of a session of forms, practice and pairs."""
    text = study.experiment.read_text()
    study.experiment.write_text(text[: text.index("blocks:")] + BLOCKS)
    words = ["run", str(study.experiment), "--observer", "07", "--simulate", str(study.observers)]
    told = CliRunner().invoke(group, [*words, "--results", str(study.results)], catch_exceptions=False)
    assert told.exit_code == 0, told.output
    (file,) = session_files(study.results)
    return read_session(file)


def test_every_kind_is_recorded_and_the_session_is_complete(log: SessionLog) -> None:
    assert log.complete
    kinds = [trial.kind for trial in log.trials]
    assert kinds == ["questionnaire"] * 3 + ["practice"] * 4 + ["all_pairs"] * 6
    age, hand, remarks = (trial.data["answer"] for trial in log.trials[:3])
    assert isinstance(age, int)
    assert 16 <= age <= 99
    assert hand in ("Left", "Right")
    assert remarks is None or isinstance(remarks, str)


def test_practice_knows_what_it_was_of_and_what_was_right(log: SessionLog) -> None:
    practice = [trial for trial in log.trials if trial.kind == "practice"]
    assert {trial.data["practice_of"] for trial in practice} == {"all_pairs"}
    assert any(isinstance(trial.data.get("correct"), bool) for trial in practice)


def test_no_analysis_counts_it(log: SessionLog) -> None:
    comparisons = from_sessions([log])
    assert comparisons.wins.sum() == 6


def test_the_export_takes_it(log: SessionLog, study: Study, tmp_path: Path) -> None:
    out = tmp_path / "bids"
    told = CliRunner().invoke(group, ["export", str(study.results), "-o", str(out)], catch_exceptions=False)
    assert told.exit_code == 0, told.output
    table = "".join(file.read_text() for file in out.rglob("*_beh.tsv"))
    assert "practice" in table
    assert "questionnaire" in table
