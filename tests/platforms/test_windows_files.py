"""Logs, whole writes, caches, locks and sessions where files behave as on Windows: see `conftest.windows`."""

from __future__ import annotations

import json
import os
import threading
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from documents.files import DurableLog, LogInUseError, LogState, read_lines, whole_folder, write_whole
from runner.presenter.surfaces import identity_tables
from stimuli.build import build_set, leftovers, remove_leftovers
from stimuli.pictures import StereoImage, write_exr

Study = Any  # tests/conftest.py

pytestmark = pytest.mark.usefixtures("windows")


class Content(NamedTuple):
    """A log's lines, and its unfinished last one."""

    lines: list[Any]
    state: LogState


def read(file: Path) -> Content:
    lines: list[Any] = []
    with open(file, "rb") as stream:
        return Content(lines, read_lines(stream, lambda number, line: lines.append(line)))


def test_the_fixture_refuses_what_windows_refuses(tmp_path: Path) -> None:
    file, folder = tmp_path / "a.txt", tmp_path / "folder"
    file.write_text("a", encoding="utf-8")
    folder.mkdir()
    with file.open("rb"):
        for what in (file.unlink, lambda: file.rename(tmp_path / "b.txt")):
            with pytest.raises(PermissionError):
                what()
    (tmp_path / "other").mkdir()
    with pytest.raises(PermissionError):
        folder.replace(tmp_path / "other")
    for name in ("aux.yaml", "NUL", "a ", "a.", "com1.csv", "a:b"):
        with pytest.raises(OSError, match="syntax"):
            (tmp_path / name).write_text("a", encoding="utf-8")
    with pytest.raises(PermissionError):
        os.open(folder, os.O_RDONLY)


def test_a_log_is_made_torn_resumed_and_locked(tmp_path: Path) -> None:
    names = tmp_path / "session.jsonl", tmp_path / ".lock"
    with DurableLog.create(*names, {"record": "header"}) as log:
        log.append({"trial": 1})
        with pytest.raises(LogInUseError):
            DurableLog.reopen(*names, tmp_path / "torn.bin", read)
    with names[0].open("ab") as stream:
        stream.write(b'{"trial":2,"ans')
    log, content = DurableLog.reopen(*names, tmp_path / "torn.bin", read)
    with log:
        assert content.state.torn_tail == b'{"trial":2,"ans'
        log.append({"trial": 2})
    assert read(names[0]).lines == [{"record": "header"}, {"trial": 1}, {"trial": 2}]


def test_a_log_with_line_ends_of_windows_reads_and_continues(tmp_path: Path) -> None:
    """As after an editor, or git with autocrlf, wrote it again."""
    names = tmp_path / "session.jsonl", tmp_path / ".lock"
    names[0].write_bytes(b'{"record": "header"}\r\n{"trial": 1}\r\n')
    log, content = DurableLog.reopen(*names, tmp_path / "torn.bin", read)
    with log:
        log.append({"trial": 2})
    assert content.state.torn_tail == b""
    assert read(names[0]).lines == [{"record": "header"}, {"trial": 1}, {"trial": 2}]


def test_a_file_that_someone_reads_is_replaced_when_it_is_closed(tmp_path: Path) -> None:
    file = tmp_path / "report.html"
    write_whole(file, "before")
    reader = file.open("rb")
    threading.Timer(0.05, reader.close).start()
    write_whole(file, "after")
    assert file.read_text(encoding="utf-8") == "after"


def test_a_file_that_stays_open_is_left_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "report.html"
    write_whole(file, "before")
    with file.open("rb"), pytest.raises(PermissionError):
        write_whole(file, "after")
    assert file.read_text(encoding="utf-8") == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.parametrize("there", ["nothing", "empty", "full"])
def test_a_folder_takes_the_place_of_another(tmp_path: Path, there: str) -> None:
    folder = tmp_path / "dataset"
    if there != "nothing":
        folder.mkdir()
    if there == "full":
        (folder / "old.txt").write_text("old", encoding="utf-8")
    with whole_folder(folder, replace=True) as draft:
        (draft / "new.txt").write_text("new", encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["dataset"]
    assert [path.name for path in folder.iterdir()] == ["new.txt"]


def test_a_folder_that_cannot_be_replaced_comes_back(tmp_path: Path) -> None:
    folder = tmp_path / "dataset"
    folder.mkdir()
    (folder / "old.txt").write_text("old", encoding="utf-8")
    with (folder / "old.txt").open("rb"), pytest.raises(PermissionError), whole_folder(folder, replace=True) as draft:
        (draft / "new.txt").write_text("new", encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["dataset"]
    assert [path.name for path in folder.iterdir()] == ["old.txt"]


def recipe(folder: Path, grey: float) -> Path:
    write_exr(folder / "a.exr", StereoImage.flat(np.full((8, 8, 3), grey, np.float32)))
    data = {"schema_version": 1, "kind": "pictures", "stimuli": [{"name": "a", "file": "a.exr"}]}
    (folder / "recipe.yaml").write_text(json.dumps(data), encoding="utf-8")
    return folder / "recipe.yaml"


def test_stimuli_are_built_built_again_and_cleaned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    file = recipe(tmp_path, 10)
    first = build_set(file, 0.25)
    again = build_set(file, 0.25, force=True)
    assert first.digest == again.digest
    (tmp_path / "cache" / f".{32 * '0'}").mkdir()
    assert len(list(leftovers())) == 1
    assert len(remove_leftovers(0.0)) == 1


def test_a_lock_of_a_table_to_restore_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that held the identity table and died leaves the file of its lock."""
    monkeypatch.setenv("CYCLOPEAN_STATE", str(tmp_path))
    place = identity_tables._Place("HDMI-1")
    place.file.parent.mkdir(parents=True, exist_ok=True)
    dead = place.file.with_name(f"{place.file.stem}.1-dead.use")
    dead.touch()
    lock = place.use()
    assert place.in_use()
    assert not dead.exists()
    place.leave(lock)
    assert not place.in_use()


@pytest.mark.nightly
def test_a_session_runs_and_is_reported_and_exported(study: Study, tmp_path: Path) -> None:
    """The whole way, with simulated observers; the second writes over the first one's report and dataset."""
    for observer in ("01", "02"):
        run = ("run", study.experiment, "--observer", observer, "--results", study.results)
        study.cyclopean(*run, "--simulate", study.observers)
        study.cyclopean("report", study.results / "small", "--csv", tmp_path / "tables")
        export = (
            "export",
            study.results / "small",
            "--output",
            tmp_path / "bids",
            "--name",
            "Small",
            "--author",
            "A. B.",
        )
        study.cyclopean(*export)
    assert (study.results / "small" / "report.html").is_file()
