"""What a session owns is removed, cut off, replaced or changed while it runs: no answer is lost, and it is said."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.records import check_log, read_session, session_files
from documents.files import DurableLog, LogDisturbedError
from runner.errors import SessionStoppedError
from runner.session.options import SessionOptions
from runner.session.run import run_session

Study = Any  # tests/conftest.py
Harm = Callable[[Path], None]


def _replace(file: Path) -> None:
    """Do what a program that synchronises folders does, or an editor: the same bytes, as another file."""
    shutil.copy(file, file.with_name("t"))
    os.replace(file.with_name("t"), file)


def _edit(file: Path) -> None:
    """Change a letter of the first line, and no length."""
    data = file.read_bytes()
    with open(file, "r+b") as stream:
        stream.write(data.replace(b'"observer":"01"', b'"observer":"02"', 1))


def _add(file: Path) -> None:
    with open(file, "ab") as stream:
        stream.write(b'{"by":"another"}\n')


HARMS: dict[str, Harm] = {
    "replaced": _replace,
    "removed": Path.unlink,
    "cut off": lambda file: os.truncate(file, file.stat().st_size // 2),
    "emptied": lambda file: os.truncate(file, 0),
    "edited": _edit,
    "added to": _add,
    "folder removed": lambda file: shutil.rmtree(file.parent),
    "results removed": lambda file: shutil.rmtree(file.parents[3]),
    "folder moved": lambda file: (file.parent.rename(file.parent.with_name("away")), None)[1],
}
AFTER = [1, 3, 6]  # of six answers


def _run(study: Study, harm: Harm | None, after: int, **more: Any) -> list[str]:
    """Run a session, do ``harm`` to its log after some answers; return the keys that were recorded before it."""
    before: list[str] = []
    given = 0

    def on_trial(status: Any) -> None:
        nonlocal given
        given += 1
        if given == after and harm:
            (file,) = session_files(study.results)
            before.extend(answer.utc for answer in read_session(file).answers)
            harm(file)

    run_session(
        study.experiment, "01", SessionOptions(study.results, simulate=study.observers, on_trial=on_trial, **more)
    )
    return before


@pytest.mark.parametrize("after", AFTER)
@pytest.mark.parametrize("what", HARMS)
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


def test_an_undisturbed_session_says_nothing(study: Study) -> None:
    def look(file: Path) -> None:
        os.utime(file)  # as a backup that reads it, and changes its times
        os.link(file, file.with_name("link"))

    _run(study, look, 3)
    (file,) = session_files(study.results)
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
