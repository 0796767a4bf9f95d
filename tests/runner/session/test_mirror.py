"""A session whose rig names a second folder: its copy is whole, and nothing that the folder does stops the session."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, read_session, session_files
from analysis.seals import check_results, copy_in_mirror
from documents import InputError
from documents.files import mirror as module
from runner.session import SessionOptions, run_session, simulate

Study = Any  # tests/conftest.py


@pytest.fixture
def backup(study: Study, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(module, "_AGAIN_S", 0.05)
    folder = Path(study.folder / "backup")
    folder.mkdir()
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: 700\nresults_mirror: backup")
    return folder


def run(study: Study, **more: Any) -> tuple[Path, list[str]]:
    said: list[str] = []
    options = SessionOptions(study.results, simulate=study.observers, notify=said.append, **more)
    run_session(study.experiment, "01", options)
    (file,) = session_files(study.results)
    return file, [words for words in said if "cop" in words]


def test_the_copy_of_a_session_is_the_same_files(study: Study, backup: Path) -> None:
    file, said = run(study)
    assert said == []
    ours = {path.relative_to(study.results): path.read_bytes() for path in study.results.rglob("*") if path.is_file()}
    theirs = {path.relative_to(backup): path.read_bytes() for path in backup.rglob("*") if path.is_file()}
    assert theirs == {path: data for path, data in ours.items() if path.name != ".lock"}
    (check,) = check_results(study.results, mirror=backup).logs
    assert check.mirror == "whole"
    assert check.complete
    assert read_session(file).header.presentation.results_mirror == str(backup)


def test_the_next_session_catches_up_those_before(study: Study, backup: Path) -> None:
    study.edit("rig.yaml", "results_mirror: backup", "")
    simulate(study.experiment, study.observers, ["02", "03"], results=study.results)
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: 700\nresults_mirror: backup")
    second, third = session_files(study.results)
    copy = copy_in_mirror(third, backup)
    copy.parent.mkdir(parents=True)
    copy.write_bytes(third.read_bytes()[:700])  # the computer was turned off before the copy was complete
    simulate(study.experiment, study.observers, ["01"], results=study.results)
    assert [log.mirror for log in check_results(study.results, mirror=backup).logs] == ["whole"] * 3
    copy_in_mirror(second, backup).write_bytes(b"other")
    simulate(study.experiment, study.observers, ["04"], results=study.results)
    logs = check_results(study.results, mirror=backup).logs
    assert [log.mirror for log in logs] == ["whole", "differs at line 1", "whole", "whole"]
    (note,) = read_session(logs[-1].file).notes
    assert f"is another file than {second}" in note.text


def test_a_folder_that_is_not_there_is_noted_and_the_session_completed(study: Study, backup: Path) -> None:
    backup.rmdir()
    file, said = run(study)
    log = read_session(file)
    assert log.complete
    assert [note.by for note in log.notes] == ["program"]
    assert "there is no such folder" in log.notes[0].text
    assert len(said) == 1
    assert "there is no such folder" in said[0]
    assert not backup.exists()
    (check,) = check_results(study.folder).logs
    assert str(check.mirror).startswith("not compared")
    backup.mkdir()
    checked = check_results(study.folder)
    assert [finding.message for finding in checked.findings] == [f"the copy of {file} is missing"]


def test_a_session_that_stopped_is_caught_up_when_it_is_resumed(study: Study, backup: Path) -> None:
    file, _ = run(study)
    whole = file.read_bytes()
    lines = whole.splitlines(keepends=True)
    for ours, theirs in [(5, 3), (6, 6), (4, 0)]:
        file.write_bytes(b"".join(lines[:ours]) + lines[ours][:30])
        copy = copy_in_mirror(file, backup)
        copy.write_bytes(b"".join(lines[:theirs]) + lines[theirs][: 20 if theirs < ours else 0])
        assert run(study, resume=True) == (file, [])
        assert copy.read_bytes() == file.read_bytes()
        assert read_session(file).complete
        torn = {path.name for path in file.parent.glob("torn-*.bin")}
        assert torn == {path.name for path in copy.parent.glob("torn-*.bin")} != set()


@pytest.mark.parametrize("mirror", ["results", "results/copies", "."])
def test_results_and_copies_in_one_folder_are_refused(study: Study, backup: Path, mirror: str) -> None:
    study.edit("rig.yaml", "results_mirror: backup", f"results_mirror: {mirror}")
    with pytest.raises(InputError, match="one lies in the other"):
        run(study)
    assert not list(study.results.rglob(FILE_NAME))


def test_verify_compares_with_the_copies(study: Study, backup: Path) -> None:
    file, _ = run(study)
    told = study.cyclopean("verify", study.results, "--mirror", backup)
    assert f"{file}: " in told.stdout
    assert "chained, complete, copy: whole, digest " in told.stdout
    copy = copy_in_mirror(file, backup)
    os.truncate(copy, copy.stat().st_size - 3)
    told = study.cyclopean("verify", study.results, "--mirror", backup, expect=1)
    assert f"the copy of {file} is behind by 1 line" in told.stderr
    (log,) = json.loads(study.cyclopean("verify", study.results, "--mirror", backup, "--json", expect=1).stdout)["logs"]
    assert log["mirror"] == "behind by 1 line"
    assert "no such folder of copies" in study.cyclopean("verify", study.results, "--mirror", "no", expect=2).stderr


def test_verify_follows_a_folder_that_a_log_names_only_within_what_it_is_given(
    study: Study, backup: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, _ = run(study)
    copy_in_mirror(file, backup).write_bytes(b"the diary of somebody else\n")

    def of(place: Path, expect: int) -> dict[str, str]:
        told = json.loads(study.cyclopean("verify", place, "--json", expect=expect).stdout)
        return {log["file"]: log["mirror"] for log in told["logs"]}

    assert of(study.folder, 1)[str(file)] == "differs at line 1"
    link = study.folder.with_name("link")
    link.symlink_to(study.folder)
    assert of(link, 1)[str(link / file.relative_to(study.folder))] == "differs at line 1"
    link.unlink()
    looked: list[str] = []
    real = os.stat

    def stat(path: Any, *more: Any, **other: Any) -> os.stat_result:
        looked.append(str(path))
        return real(path, *more, **other)

    monkeypatch.setattr(os, "stat", stat)
    monkeypatch.setattr(os, "lstat", stat)
    assert of(study.results, 0)[str(file)].startswith("not looked at: ")
    assert of(file, 0)[str(file)].startswith("not looked at: ")
    assert not [path for path in looked if path.startswith(str(backup))]
    monkeypatch.undo()
    elsewhere = study.folder.with_name("elsewhere")
    backup.rename(elsewhere)
    backup.symlink_to(elsewhere)
    assert of(study.folder, 0)[str(file)].startswith("not looked at: ")
