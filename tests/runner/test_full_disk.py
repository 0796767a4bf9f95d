"""A disk that is full, or a folder that cannot be written, is told plainly, and the log stays whole."""

from __future__ import annotations

import errno
import os
import pwd
import subprocess
import sys
from pathlib import Path

import pytest

from analysis.records import FILE_NAME, new_header
from runner.errors import SessionError
from runner.session import Recorder
from tests.answers import new_answer

UTC = "2026-01-01T00:00:01.000+00:00"
HEADER = new_header("e", "01", "s", UTC, question="Which?", simulated=True, stimuli=({"name": "a"}, {"name": "b"}))
CHOICE = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b"}
ANSWER = new_answer(0, 0, "all_pairs", (("up", 1.25),), 1.25, UTC, CHOICE)


def test_a_disk_that_is_full_from_the_start_begins_no_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(SessionError, match=r"disk of the folder .* is full"):
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
    assert "the folder s may only be read" in told.stdout
    assert (folder / FILE_NAME).read_bytes() == before
