"""Sessions recorded before logs were chained are read, reported, exported, resumed and replayed as they were."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import KINDS, PRACTICE
from analysis.records import SessionLog, read_results, read_session, session_files
from analysis.report import write_report
from extensions.bids import About, export_dataset
from runner.session import SessionOptions, run_session

RECORDED = Path(__file__).parent / "recorded"
# "others" has nearly every kind; "pairs" are resumed.
SOME = ["others", *(pytest.param(name, marks=pytest.mark.nightly) for name in ("groups", "pairs", "sequence"))]
LATER = {"threshold"}  # kinds that came after logs were chained


@pytest.fixture
def recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the recorded sessions and of what they were made with."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    return Path(shutil.copytree(RECORDED, tmp_path / "study"))


def log_of(study: Path, experiment: str, observer: str) -> SessionLog:
    *_, file = session_files(study / "results" / experiment / f"sub-{observer}")
    return read_session(file)


def test_they_have_every_kind_and_every_other_record() -> None:
    logs = read_results(RECORDED / "results")
    assert {trial.kind for log in logs for trial in log.trials} == {*KINDS, PRACTICE} - LATER
    assert {log.chained_from for log in logs} == {None}
    assert all(log.notes for log in logs if len(log.trials) > 10)
    assert sum(bool(log.marks) for log in logs) > 2
    assert sum(bool(log.resumptions) for log in logs) == 2
    assert sum(answer.attempt > 0 for log in logs for answer in log.answers) > 2
    assert [log.complete for log in logs].count(False) == 2


def test_what_is_read_is_written_again_as_it_was() -> None:
    """Byte by byte: the record that is read is the one that is written."""
    for file in session_files(RECORDED / "results"):
        lines = [line for line in file.read_text(encoding="utf-8").splitlines() if '"record":"trial"' in line]
        again = [trial.to_json() for trial in read_session(file).answers]
        assert [json.dumps(line, ensure_ascii=False, separators=(",", ":")) for line in again] == lines


@pytest.mark.usefixtures("undrawn")  # figures of every kind: test_report_every_kind.py
@pytest.mark.parametrize("experiment", SOME)
def test_they_are_reported(experiment: str, tmp_path: Path) -> None:
    report = write_report(read_results(RECORDED / "results" / experiment), tmp_path / "report.html")
    assert report.to_json()
    assert (tmp_path / "report.html").stat().st_size > 10_000


def test_they_are_exported(tmp_path: Path) -> None:
    done = export_dataset([RECORDED / "results"], tmp_path / "bids", About())
    logs = read_results(RECORDED / "results")
    assert (done.sessions, done.trials) == (7, sum(len(log.trials) for log in logs))
    raw = {file.read_bytes() for file in session_files(tmp_path / "bids" / "sourcedata")}
    assert raw == {file.read_bytes() for file in session_files(RECORDED / "results")}


@pytest.mark.parametrize(("experiment", "observer"), [("others", "02"), ("pairs", "03")])
def test_those_that_stopped_are_resumed(recorded: Path, experiment: str, observer: str) -> None:
    before = log_of(recorded, experiment, observer)
    options = SessionOptions(
        results=recorded / "results", simulate=recorded / "observers.yaml", resume=True, accept_changes=True
    )
    done = run_session(recorded / f"{experiment}.yaml", observer, options)
    assert (done.ending, done.answered) == ("completed", done.trials)
    after = log_of(recorded, experiment, observer)
    assert after.complete
    assert after.answers[: len(before.answers)] == before.answers
    assert len({answer.place for answer in after.answers}) == len(after.trials) > len(before.trials)
    (old,) = (RECORDED / "results" / experiment / f"sub-{observer}").rglob("session.jsonl")
    assert after.file.read_bytes().startswith(old.read_bytes())
    assert after.chained_from == len(old.read_bytes().splitlines()) + 1


@pytest.mark.parametrize("experiment", SOME)
def test_they_are_replayed(recorded: Path, experiment: str) -> None:
    log = log_of(recorded, experiment, "01")
    options = SessionOptions(results=recorded / "again", replay=log.file, accept_changes=True)
    run_session(recorded / f"{experiment}.yaml", "01", options)
    (file,) = session_files(recorded / "again")
    again = read_session(file)
    assert [_lasting(answer) for answer in again.answers] == [_lasting(answer) for answer in log.answers]


def _lasting(answer: Any) -> tuple[Any, ...]:
    data = {key: value for key, value in answer.details().items() if key not in ("timed", "clipping")}
    return answer.place, answer.attempt, answer.kind, answer.events, answer.response_time_s, data


def test_they_are_verified(cyclopean: Callable[..., Any]) -> None:
    told = cyclopean("verify", RECORDED / "results")
    assert "7 logs are unchained" in told.stdout
    assert "fits" not in told.stdout
    assert cyclopean("verify", "--strict", RECORDED / "results", expect=1).stderr.count("error: ") == 7
