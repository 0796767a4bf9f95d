"""What a session owns is removed, cut off, replaced or changed while it runs: no answer is lost, and it is said."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import Trial
from analysis.records import FILE_NAME, read_session, session_files
from analysis.seals import check_log
from documents.files import DurableLog, LogDisturbedError, durable_log
from documents.files.chain import sealed
from runner.errors import SessionError, SessionStoppedError
from runner.session import Recorder, SessionOptions, run_session, simulate
from tests.runner.every_kind import OnStatus
from tests.runner.harms import HARMS, Harm

Study = Any  # tests/conftest.py


AFTER = (1, 3, 6)  # of six answers
# Each harm at one of these moments, at the others nightly.
WHEN = [
    pytest.param(what, after, marks=[] if number % 3 == place else pytest.mark.nightly)
    for number, what in enumerate(HARMS)
    for place, after in enumerate(AFTER)
]


def _run(study: Study, harm: Harm | None, after: int, **more: Any) -> list[str]:
    """Run a session, do ``harm`` to its log after some answers; return the keys that were recorded before it."""
    before: list[str] = []
    given = 0

    def on_trial(status: Any) -> None:
        nonlocal given
        given += 1
        if given == after and harm:
            file = study.log_file()
            before.extend(answer.utc for answer in read_session(file).answers)
            harm(file)

    told = (OnStatus(on_trial),)
    run_session(study.experiment, "01", SessionOptions(study.results, simulate=study.observers, listeners=told, **more))
    return before


@pytest.mark.parametrize(("what", "after"), WHEN)
def test_no_answer_is_lost_and_the_session_stops(study: Study, what: str, after: int) -> None:
    seen: list[bytes] = []

    def harm(file: Path) -> None:
        seen.append(file.read_bytes())
        HARMS[what](file)

    with pytest.raises(SessionStoppedError) as stopped:
        _run(study, harm, after)
    (file,) = [file for file in session_files(study.results) if file.parent.name != "away"]
    assert str(file) in str(stopped.value)
    assert file.read_bytes().startswith(seen[0])
    assert check_log(file).findings == ()
    # It stopped before another answer was taken than the one that was being given.
    assert len(read_session(file).answers) <= len(seen[0].splitlines())
    if what in ("edited", "added to"):
        assert [len(path.read_bytes()) > 0 for path in file.parent.glob("session.found-*.bin")] == [True]
    if not read_session(file).complete:
        shutil.rmtree(file.parent.with_name("away"), ignore_errors=True)
        _run(study, None, 0, resume=True)
    assert read_session(file).complete
    assert check_log(file).findings == ()


def test_where_the_place_is_of_no_use_the_state_folder_has_all_lines(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "state"))

    def harm(file: Path) -> None:
        shutil.rmtree(study.results)
        study.results.write_bytes(b"")  # no folder can be made here

    with pytest.raises(SessionStoppedError) as stopped:
        _run(study, harm, 3)
    (file,) = session_files(tmp_path / "state" / "rescued")
    assert str(file) in str(stopped.value)
    assert check_log(file).findings == ()
    assert len(read_session(file).answers) >= 3


def test_where_nothing_can_be_written_it_says_so(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.write_bytes(b"")
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path / "state"))

    def harm(file: Path) -> None:
        monkeypatch.setenv("CYCLOPEAN_STATE", str(blocked / "state"))
        shutil.rmtree(study.results)
        study.results.write_bytes(b"")

    with pytest.raises(SessionStoppedError, match="CANNOT BE WRITTEN") as stopped:
        _run(study, harm, 3)
    assert "is saved" not in str(stopped.value)


LATE = ("removed", "last line taken", "emptied", "added to")


def test_an_undisturbed_session_says_nothing(study: Study) -> None:
    def look(file: Path) -> None:
        os.utime(file)  # as a backup that reads it, and changes its times
        os.link(file, file.with_name("link"))

    _run(study, look, 3)
    file = study.log_file()
    assert read_session(file).complete
    assert list(file.parent.glob("*.bin")) == []


def test_a_note_that_finds_it_stops_the_next_answer(tmp_path: Path) -> None:
    file = tmp_path / "a.jsonl"
    log = DurableLog.create(file, tmp_path / ".lock", {"record": "session"})
    file.unlink()
    for number in range(3):
        with pytest.raises(LogDisturbedError):
            log.append({"record": "trial", "trial": number})
    log.close()
    assert file.read_bytes().count(b"\n") == 4


@pytest.mark.parametrize(
    "what", [pytest.param(what, marks=[] if what == "edited" else pytest.mark.nightly) for what in HARMS]
)
def test_simulated_observers_stop_with_one_error(study: Study, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    """The second observer's log is harmed after the third answer; the first observer's session stays whole."""
    append, done = Recorder.append, 0

    def then_harmed(self: Recorder, record: Any) -> None:
        nonlocal done
        append(self, record)
        if self.folder.parent.name == "sub-02" and isinstance(record, Trial):
            done += 1
            if done == 3:
                HARMS[what](self.folder / FILE_NAME)

    monkeypatch.setattr(Recorder, "append", then_harmed)
    with pytest.raises(SessionStoppedError, match="another program") as stopped:
        simulate(study.experiment, study.observers, 3, results=study.results)
    assert "--observer 02" in str(stopped.value)
    files = [file for file in session_files(study.results) if file.parent.name != "away"]
    logs = {file.parent.parent.name: read_session(file) for file in files}
    assert "sub-03" not in logs
    assert (len(logs["sub-02"].answers), logs["sub-02"].complete) in ((3, False), (4, False))
    if what != "results removed":
        assert logs["sub-01"].complete


@pytest.mark.parametrize("what", ["cut off", "edited", *(pytest.param(one, marks=pytest.mark.nightly) for one in LATE)])
def test_what_is_done_after_the_log_was_closed_is_found_before_it_is_said_where_answers_are(
    study: Study, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    """As while the end page stands, or the copy of the log is waited for."""
    close = Recorder.close

    def then_harmed(self: Recorder) -> None:
        close(self)
        HARMS[what](self.folder / FILE_NAME)

    monkeypatch.setattr(Recorder, "close", then_harmed)
    told = study.run(expect=1)
    assert "answers are in" not in told.stdout
    file = study.log_file()
    assert str(file) in told.stderr
    assert "The session was complete" in told.stderr
    assert len(read_session(file).answers) == 7
    assert read_session(file).complete


def test_a_line_that_was_not_written_as_it_was_meant_is_found_when_the_log_is_read_back(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What memory and file share, no comparison of the two can find: here a checksum that was computed wrongly."""

    def wrong(line: Any, number: int, before: str) -> tuple[bytes, str]:
        data, digest = sealed(line, number, before)
        return (data.replace(b'"response_time_s":', b'"response_time_s":1', 1) if number == 4 else data), digest

    monkeypatch.setattr(durable_log, "sealed", wrong)
    told = study.run(expect=1)
    assert f": {study.log_file()}:4" in told.stderr
    assert "answers are in" not in told.stdout


def test_a_second_process_is_refused_though_the_locks_were_removed(study: Study) -> None:
    """The running session stops at its next answer if its record is gone too, and nothing of it is lost."""
    refused: list[str] = []

    def harm(file: Path) -> None:
        for lock in (file.with_name(".lock"), file.parents[1] / ".lock"):
            lock.unlink()
        with pytest.raises(SessionError) as second:
            run_session(study.experiment, "01", SessionOptions(study.results, simulate=study.observers, resume=True))
        refused.append(str(second.value))

    _run(study, harm, 3)
    assert f"process {os.getpid()} on " in refused[0]
    file = study.log_file()
    assert read_session(file).complete
    assert check_log(file).findings == ()
