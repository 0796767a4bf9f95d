"""Two processes that would write one session: the second is refused, whatever became of the system's lock."""

from __future__ import annotations

import fcntl
import json
import os
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, read_session, session_files
from analysis.seals import check_log
from documents.files.owned_lock import STALE_S, Owner
from runner.errors import SessionError, SessionStoppedError
from runner.session import Recorder, SessionOptions, run_session
from tests.runner.every_kind import OnStatus

Study = Any  # tests/conftest.py


def _no_locks(patch: pytest.MonkeyPatch) -> None:
    """Let the system's locks hold nothing, as on some network drives."""
    patch.setattr(fcntl, "flock", lambda descriptor, what: None)


def _put(folder: Path, owner: Owner, silent_s: float = 0.0) -> Path:
    record = folder / ".lock.owner"
    record.write_text(json.dumps(asdict(owner)))
    then = time.time() - silent_s
    os.utime(record, (then, then))
    return record


def _elsewhere(**more: Any) -> Owner:
    return replace(Owner.here(), host="far", machine="0123", token="4567", **more)


def _run(study: Study, on_trial: Any = lambda status: None, **more: Any) -> list[str]:
    said: list[str] = []
    told = (OnStatus(on_trial),)
    options = SessionOptions(study.results, simulate=study.observers, listeners=told, notify=said.append, **more)
    run_session(study.experiment, "01", options)
    return said


def _stopped(study: Study) -> Path:
    """Run a session that is stopped after two answers; return its folder."""

    class _Killed(BaseException):
        pass

    def stop(status: Any) -> None:
        if status.answered == 2:
            raise _Killed

    with pytest.raises(_Killed):
        _run(study, stop)
    (file,) = session_files(study.results)
    return file.parent


@pytest.mark.parametrize("resume", [False, True])
def test_a_session_that_another_machine_writes_is_refused_and_taken_over_once_it_is_silent(
    study: Study, *, resume: bool
) -> None:
    folder = _stopped(study)
    _put(folder, _elsewhere(), STALE_S - 20)
    before = (folder / FILE_NAME).read_bytes()
    with pytest.raises(SessionError) as refused:
        _run(study, resume=resume)
    assert "on far, since 2" in str(refused.value)
    assert not resume or "2 minutes" in str(refused.value)
    assert (folder / FILE_NAME).read_bytes() == before
    _put(folder, _elsewhere(), STALE_S + 1)
    said = _run(study, resume=True)
    assert any("ended without closing it" in line and "on far" in line for line in said)
    log = read_session(folder / FILE_NAME)
    assert log.complete
    assert any("on far" in note.text for note in log.notes)
    assert not (folder / ".lock.owner").exists()


def test_one_observer_has_one_session_on_all_machines(study: Study) -> None:
    folder = study.results / "small" / "sub-01"
    folder.mkdir(parents=True)
    record = _put(folder, _elsewhere())
    with pytest.raises(SessionError, match=r"running now \(process \d+ on far"):
        _run(study)
    assert not list(session_files(study.results))
    assert record.exists()


def test_a_session_whose_record_was_removed_stops_before_another_answer(study: Study) -> None:
    def remove(status: Any) -> None:
        if status.answered == 3:
            for record in study.results.rglob("ses-*/.lock.owner"):
                record.unlink()

    with pytest.raises(SessionStoppedError, match=r"removed the record .* written there again.*--resume"):
        _run(study, remove)
    (file,) = session_files(study.results)
    assert check_log(file).findings == ()
    assert sum(answer.kind == "all_pairs" for answer in read_session(file).answers) == 4
    _run(study, resume=True)
    assert read_session(file).complete


def test_a_session_that_was_taken_over_stops_and_leaves_the_log_to_the_other(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by a machine that saw no sign of life while this one slept: nobody's answer is lost, and no line is cut."""
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "state"))
    _no_locks(monkeypatch)
    other: list[Recorder] = []

    def take(status: Any) -> None:
        if status.answered == 3 and not other:
            (file,) = session_files(study.results)
            _put(file.parent, _elsewhere(), STALE_S + 1)
            other.append(Recorder.resume(file.parent, {})[0])

    with pytest.raises(SessionStoppedError, match="took the log over") as stopped:
        _run(study, take)
    assert "other process continues" in str(stopped.value)
    (file,) = session_files(study.results)
    (kept,) = session_files(tmp_path / "state" / "rescued")
    assert str(kept) in str(stopped.value)
    assert len(read_session(kept).answers) == len(read_session(file).answers) + 1
    other[0].append(read_session(kept).answers[-1])
    other[0].close()
    assert check_log(file).findings == ()
    assert list(file.parent.glob("session.found*")) == []
