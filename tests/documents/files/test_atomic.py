"""Files with all their text or none."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from documents.files import unwritable, whole_file, whole_folder, write_whole


def test_a_file_is_written_with_its_folder_and_nothing_beside_it(tmp_path: Path) -> None:
    file = tmp_path / "new" / "folder" / "page.html"
    write_whole(file, "ΔE00\r\nsecond\n")
    assert file.read_bytes() == "ΔE00\r\nsecond\n".encode()
    write_whole(file, "other")
    assert file.read_text(encoding="utf-8") == "other"
    assert list(file.parent.iterdir()) == [file]
    assert file.stat().st_mode & 0o077 == _usual_mode(tmp_path) & 0o077


def _usual_mode(folder: Path) -> int:
    other = folder / "usual"
    other.touch()
    return other.stat().st_mode


def test_what_was_there_stays_when_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "page.html"
    file.write_text("before", encoding="utf-8")

    def full(self: Path, data: bytes) -> int:
        with open(self, "wb") as stream:
            stream.write(data[:3])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        write_whole(file, "after")
    assert file.read_text(encoding="utf-8") == "before"
    assert list(tmp_path.iterdir()) == [file]


def test_a_folder_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "page.html").mkdir()
    with pytest.raises(OSError):  # noqa: PT011  # which one differs between systems
        write_whole(tmp_path / "page.html", "text")
    assert [one.name for one in tmp_path.iterdir()] == ["page.html"]


def test_a_body_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def fail() -> None:
        with whole_file(tmp_path / "plate.exr", keep_suffix=True) as draft:
            draft.write_bytes(b"half")
            assert draft.suffix == ".exr"
            raise ValueError("halfway")

    with pytest.raises(ValueError, match="halfway"):
        fail()
    assert list(tmp_path.iterdir()) == []


KILLED = """
import os, signal, sys
from pathlib import Path
from documents.files import atomic

path, kind, when = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
if when == "between":
    real = atomic.rename
    def rename(source, target):
        real(source, target)
        os.kill(os.getpid(), signal.SIGKILL)
    atomic.rename = rename
with (atomic.whole_file(path) if kind == "file" else atomic.whole_folder(path, replace=True)) as draft:
    (draft if kind == "file" else draft / "inside").write_text("new")
    if when == "body":
        os.kill(os.getpid(), signal.SIGKILL)
"""
posix = pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL")


def killed(path: Path, kind: str, when: str) -> None:
    """Write ``path`` in a process that is killed at it."""
    root = Path(__file__).parents[3]
    command = [sys.executable, "-c", KILLED, str(path), kind, when]
    assert subprocess.run(command, check=False, cwd=root).returncode == -signal.SIGKILL


@pytest.mark.nightly
@posix
def test_what_killed_processes_left_goes_whatever_is_written_into_the_folder(tmp_path: Path) -> None:
    replaced = tmp_path / "dataset"
    replaced.mkdir()
    (replaced / "inside").write_text("old")
    long = "a" * 90
    for name in ("page.html", long):
        killed(tmp_path / name, "file", "body")
    killed(tmp_path / "made", "folder", "body")
    killed(replaced, "folder", "between")
    write_whole(tmp_path / "other.html", "whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dataset", "other.html"]
    assert (replaced / "inside").read_text() == "old"
    killed(tmp_path / "page.html", "file", "body")
    with whole_folder(tmp_path / "third"):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dataset", "other.html", "third"]


@posix
def test_a_folder_that_was_being_replaced_comes_back(tmp_path: Path) -> None:
    folder = tmp_path / "dataset"
    folder.mkdir()
    (folder / "inside").write_text("old")
    killed(folder, "folder", "between")
    assert not folder.exists()
    with suppress(InterruptedError), whole_folder(folder, replace=True):
        assert (folder / "inside").read_text() == "old"
        raise InterruptedError
    assert [path.name for path in tmp_path.iterdir()] == ["dataset"]
    assert (folder / "inside").read_text() == "old"


def test_drafts_of_others_stay(tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    with whole_file(file) as draft:
        draft.write_text("first")
        alive = draft.name
        elsewhere = alive.replace(alive.split("-")[1], "0" * 8).replace(f".{os.getpid()}-", ".999999999-")
        others = {elsewhere, ".page.html.0a1b2c3d.part", ".page.html.txt", ".page.html.part"}
        for name in others:
            (tmp_path / name).touch()
        write_whole(file, "second")
        assert {path.name for path in tmp_path.iterdir()} == {alive, "page.html", *others}
    assert file.read_text() == "first"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pipes and devices among its files")
@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize("kind", ["a pipe", "a device", "a socket"])
def test_a_pipe_a_device_or_a_socket_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, linked: bool
) -> None:
    """Whoever may write to /dev, as in a container, would lose /dev/null to ``-o /dev/null``."""
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "page.html"
    with socket.socket(socket.AF_UNIX) as made:
        if kind == "a device":
            place.symlink_to(os.devnull)
        elif kind == "a pipe":
            os.mkfifo(place)
        else:
            made.bind(place.name)
    if linked:
        (tmp_path / "link.html").symlink_to(place)
        place = tmp_path / "link.html"
    before = place.stat().st_mode, place.lstat().st_mode
    with pytest.raises(OSError, match=f"it is {kind}, not a file") as refused:
        write_whole(place, "new")
    assert (place.stat().st_mode, place.lstat().st_mode) == before
    assert sorted(file.name for file in tmp_path.iterdir()) == ["link.html", "page.html"][1 - linked :]
    words = f"{place}: the page cannot be written: it is {kind}, not a file (name a file)"
    assert str(unwritable(refused.value, place, "page")) == words


def test_what_is_no_text_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(UnicodeEncodeError):
        write_whole(tmp_path / "page.html", "\ud800")
    assert not list(tmp_path.iterdir())
