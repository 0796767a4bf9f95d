"""Nobody else on the machine reads what has people's data, unless that is asked for."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from documents.files import DurableLog, LogDisturbedError
from documents.platform import state_folder

Study = Any  # tests/conftest.py

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes"),
    pytest.mark.usefixtures("undrawn"),
]


@pytest.fixture(autouse=True)
def open_umask(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """As on most machines: others may read."""
    monkeypatch.delenv("CYCLOPEAN_ACCESS", raising=False)
    before = os.umask(0o022)
    yield
    os.umask(before)


def _modes(*folders: Path) -> tuple[set[int], set[int]]:
    """Return the modes of all folders and of all files, but for locks, which are empty."""
    paths = [path for folder in folders for path in (folder, *folder.rglob("*")) if path.name != ".lock"]
    folders_of = {path.stat().st_mode & 0o777 for path in paths if path.is_dir()}
    return folders_of, {path.stat().st_mode & 0o777 for path in paths if path.is_file()}


def _everything(study: Study) -> list[Path]:
    """Record a session with its copy, and make of it all that holds answers; return where it lies."""
    backup = study.folder / "backup"
    backup.mkdir(mode=0o700)
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: 700\nresults_mirror: backup")
    study.run()
    study.cyclopean("seal", study.results)
    out = study.folder / "out"
    tables = ["--csv", out / "tables", "--figures", out / "figures"]
    study.cyclopean("report", study.results, "-o", out / "report.html", *tables)
    study.cyclopean("export", study.results, "-o", out / "bids")
    assert len(list(backup.rglob("session.jsonl"))) == len(list((out / "bids").rglob("session.jsonl"))) == 1
    return [study.results, backup, out]


def test_results_reports_and_exports_are_for_their_owner(study: Study) -> None:
    assert _modes(*_everything(study)) == ({0o700}, {0o600})


@pytest.mark.parametrize(("access", "folders", "files"), [("group", 0o750, 0o640), ("all", 0o755, 0o644)])
@pytest.mark.nightly
def test_others_may_read_where_it_is_asked_for(
    study: Study, monkeypatch: pytest.MonkeyPatch, access: str, folders: int, files: int
) -> None:
    monkeypatch.setenv("CYCLOPEAN_ACCESS", access)
    results, backup, out = _everything(study)
    backup.chmod(folders)  # was there before
    assert _modes(results, backup, out) == ({folders}, {files})


def test_an_access_that_means_nothing_is_refused_before_anything_is_written(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLOPEAN_ACCESS", "everyone")
    assert "CYCLOPEAN_ACCESS" in study.run(expect=2).stderr
    assert not study.results.exists()


def test_what_a_power_cut_tore_off_and_what_was_saved_is_for_its_owner(study: Study) -> None:
    study.run()
    file = study.log_file()
    file.write_bytes(b"".join(file.read_bytes().splitlines(keepends=True)[:4]) + b'{"record":"tri')
    study.run("--resume")
    assert [path.name[:5] for path in file.parent.glob("torn*")] == ["torn-"]
    assert _modes(study.results) == ({0o700}, {0o600})
    other = study.folder / "gone" / "session.jsonl"
    other.parent.mkdir()
    log = DurableLog.create(other, study.folder / ".lock", {})
    other.unlink()
    other.parent.rmdir()
    other.parent.write_text("a file in the place of the folder")
    with pytest.raises(LogDisturbedError):
        log.append({"record": "trial"})
    log.close()
    assert _modes(state_folder() / "rescued")[1] == {0o600}


def test_folders_that_were_there_stay_as_they_were(study: Study) -> None:
    study.results.mkdir(mode=0o755)
    study.run()
    assert study.results.stat().st_mode & 0o777 == 0o755
    assert _modes(*study.results.iterdir()) == ({0o700}, {0o600})


def test_a_measurement_of_a_display_is_for_all(tmp_path: Path) -> None:
    from devices.readings import MeasurementLog

    with MeasurementLog.create(tmp_path / "display.jsonl", {"steps": []}):
        pass
    assert (tmp_path / "display.jsonl").stat().st_mode & 0o777 == 0o644
