"""A disk that is full, or a folder that cannot be written, is told plainly, and the log stays whole."""

from __future__ import annotations

import errno
import os
import pwd
import subprocess
import sys
from io import FileIO
from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, Header, Note, Trial, read_session
from runner.errors import SessionError
from runner.session.folders import Recorder

UTC = "2026-01-01T00:00:01.000+00:00"
HEADER = Header("e", "01", "s", UTC, 0, "Which?", True, ({"name": "a"}, {"name": "b"}), {}, {}, {}, {}, {})
NOTE = Note("a lamp went out", "experimenter", 0, 0, UTC)
CHOICE = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b"}
ANSWER = Trial(0, 0, "all_pairs", (("up", 1.25),), 1.25, UTC, CHOICE)


class _Disk(FileIO):
    """A file on a disk with room for so many bytes more."""

    room = 0

    def write(self, data: Any, /) -> int:
        if self.room == 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written = super().write(memoryview(data)[: self.room])
        self.room -= written
        return written


@pytest.mark.parametrize("room", [0, 1, 20, 60])
def test_a_note_that_did_not_fit_spoils_no_later_answer(tmp_path: Path, room: int) -> None:
    folder = tmp_path / "s"
    with Recorder.create(folder, HEADER) as recorder:
        recorder._log._stream.close()
        disk = _Disk(folder / FILE_NAME, "ab")
        recorder._log._stream = disk
        disk.room = room
        with pytest.raises(OSError, match="No space left"):
            recorder.note(NOTE)
        disk.room = 10_000
        recorder.append(ANSWER)
    log = read_session(folder / FILE_NAME)
    assert (log.answers, log.notes, log.torn_tail) == ((ANSWER,), (), b"")


def test_a_line_that_could_not_be_synced_is_taken_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "s"
    with Recorder.create(folder, HEADER) as recorder:
        before = (folder / FILE_NAME).read_bytes()

        def fail(descriptor: int) -> None:
            raise OSError(errno.EIO, os.strerror(errno.EIO))

        monkeypatch.setattr(os, "fsync", fail)
        with pytest.raises(OSError, match="Input/output"):
            recorder.append(ANSWER)
    assert (folder / FILE_NAME).read_bytes() == before


def test_a_disk_that_is_full_from_the_start_begins_no_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(SessionError, match=r"the session cannot be written: the disk of the folder .* is full"):
        Recorder.create(tmp_path / "s", HEADER)
    assert not (tmp_path / "s" / FILE_NAME).exists()


def test_a_folder_that_may_not_be_written_is_one_clear_message(tmp_path: Path) -> None:
    """Root may write anywhere, so that another user has to try."""
    folder = tmp_path / "s"
    with Recorder.create(folder, HEADER) as recorder:
        recorder.append(ANSWER)
    before = (folder / FILE_NAME).read_bytes()
    for path in (folder / FILE_NAME, folder / ".lock"):
        path.chmod(0o444)
    folder.chmod(0o555)
    code = (
        "import os, sys; from pathlib import Path\n"
        "from runner.session.folders import Recorder; from runner.errors import SessionError\n"
        "import filelock\n"  # loaded only where a lock is taken, when the packages' folder may be closed to that user
        "if os.geteuid() == 0: os.setuid(int(sys.argv[2]))\n"
        "try: Recorder.reopen(Path(sys.argv[1]))\n"
        "except SessionError as error: print(error)"
    )
    tmp_path.chmod(0o755)
    nobody = str(pwd.getpwnam("nobody").pw_uid)
    # From inside the folder: the folders above it may be closed to others.
    told = subprocess.run(
        [sys.executable, "-c", code, "s", nobody], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    folder.chmod(0o755)
    assert "the session cannot be written: the folder s may only be read" in told.stdout
    assert (folder / FILE_NAME).read_bytes() == before
