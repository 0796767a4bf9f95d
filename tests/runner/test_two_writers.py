"""Two processes that would write one session: the second is refused, whatever became of the system's lock."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, check_log, read_session, session_files
from documents.files import LogInUseError, OwnedLock, in_use, owned_lock
from documents.files.owned_lock import STALE_S, Owner
from documents.platform import process_start
from runner.errors import SessionError, SessionStoppedError
from runner.session import SessionOptions, run_session
from runner.session.folders import Recorder

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


def _gone() -> int:
    """Return the number of a process that ran."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def _run(study: Study, on_trial: Any = lambda status: None, **more: Any) -> list[str]:
    said: list[str] = []
    options = SessionOptions(study.results, simulate=study.observers, on_trial=on_trial, notify=said.append, **more)
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


@pytest.mark.parametrize("how", ["the lock removed", "no locks on this disk", "both"])
def test_a_second_process_is_refused_and_told_who_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    file = tmp_path / ".lock"
    if how != "the lock removed":
        _no_locks(monkeypatch)
    code = (
        "import sys; from pathlib import Path; from documents.files import OwnedLock\n"
        "lock = OwnedLock.take(Path(sys.argv[1])); print('taken', flush=True); sys.stdin.read(); lock.release()"
    )
    if how != "the lock removed":
        code = f"import fcntl; fcntl.flock = lambda *given: None\n{code}"
    with subprocess.Popen(
        [sys.executable, "-c", code, str(file)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout
        assert other.stdin
        assert other.stdout.readline() == "taken\n"
        if how != "no locks on this disk":
            file.unlink()
        assert in_use(file)
        with pytest.raises(LogInUseError) as refused:
            OwnedLock.take(file)
        assert refused.value.owner
        assert refused.value.owner.process == other.pid
        assert refused.value.owner.is_here
        other.stdin.close()
        other.wait()
    assert in_use(file) is None
    OwnedLock.take(file).release()
    assert not list(tmp_path.glob("*.owner"))


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


@pytest.mark.parametrize("what", ["gone", "its number is another's now", "torn", "not ours any more"])
def test_what_a_killed_process_of_this_machine_left_holds_nobody_up(tmp_path: Path, what: str) -> None:
    here = Owner.here()
    left = {
        "gone": replace(here, process=_gone(), token="1"),
        "its number is another's now": replace(here, process=os.getppid(), started="1", token="1"),
        "not ours any more": replace(here, token="1"),
    }.get(what)
    if left is None:
        (tmp_path / ".lock.owner").write_text('{"host": "fa')
    else:
        _put(tmp_path, left)
    assert in_use(tmp_path / ".lock") is None
    lock = OwnedLock.take(tmp_path / ".lock")
    assert lock.taken_over == left
    assert lock.lost() is None
    lock.release()


def test_a_process_of_this_machine_that_runs_is_never_taken_for_dead(tmp_path: Path) -> None:
    parent = os.getppid()
    started = process_start(parent)
    if not started:
        pytest.skip("this system does not say when a process was started")
    _put(tmp_path, replace(Owner.here(), process=parent, started=started, token="1"), 10 * STALE_S)
    assert in_use(tmp_path / ".lock")


def test_a_disk_without_locks_is_no_obstacle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(descriptor: int, what: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", none)
    lock = OwnedLock.take(tmp_path / ".lock")
    with pytest.raises(LogInUseError):
        OwnedLock.take(tmp_path / ".lock")
    lock.release()
    OwnedLock.take(tmp_path / ".lock").release()


def test_there_is_a_sign_of_life_while_the_lock_is_held_and_in_nobody_else_s_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(owned_lock, "BEAT_S", 0.01)
    lock = OwnedLock.take(tmp_path / ".lock")
    record = tmp_path / ".lock.owner"

    def beats() -> bool:
        os.utime(record, (1, 1))
        end = time.monotonic() + 10
        while time.monotonic() < end:
            if record.stat().st_mtime > 1:
                return True
            time.sleep(0.01)
        return False

    assert beats()
    assert lock.lost() is None
    theirs = json.dumps(asdict(_elsewhere()))
    draft = tmp_path / "draft"
    draft.write_text(theirs)
    draft.replace(record)
    time.sleep(0.1)
    lost = lock.lost()
    assert lost
    assert "on far" in lost
    assert lock.is_taken
    lock.release()
    assert record.read_text() == theirs


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

    with pytest.raises(SessionStoppedError, match="another process took the log over") as stopped:
        _run(study, take)
    assert "The other process continues the session" in str(stopped.value)
    (file,) = session_files(study.results)
    (kept,) = session_files(tmp_path / "state" / "rescued")
    assert str(kept) in str(stopped.value)
    assert len(read_session(kept).answers) == len(read_session(file).answers) + 1
    other[0].append(read_session(kept).answers[-1])
    other[0].close()
    assert check_log(file).findings == ()
    assert list(file.parent.glob("session.found*")) == []


def test_an_undisturbed_session_leaves_no_record_and_says_nothing(study: Study) -> None:
    assert not [line for line in _run(study) if "closing" in line]
    assert not list(study.results.rglob("*.owner"))
    assert read_session(next(iter(session_files(study.results)))).notes == ()
