"""Whether answers can be kept, and what lies in the results folder already."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from filelock import FileLock, Timeout

from analysis.errors import ResultsError
from analysis.records.session_record import FILE_NAME, read_session
from documents import Finding
from runner.check.checked import Checked

# A session of a thousand trials takes about a megabyte.
LITTLE_ROOM_BYTES = 100_000_000


def look_at_results(checked: Checked, experiment: str, results: Path) -> None:
    """Say whether ``results`` can be written, who has a session that is not finished, and whose runs right now."""
    there = next(folder for folder in (results.absolute(), *results.absolute().parents) if folder.exists())
    checked.facts["results"] = str(results)
    if not there.is_dir():
        checked.errors.append(Finding("a file stands where the results should go", str(there), remedy="move it away"))
        return
    if not os.access(there, os.W_OK | os.X_OK):
        checked.errors.append(Finding("the results folder cannot be written", str(there), remedy="choose another"))
        return
    free_bytes = shutil.disk_usage(there).free
    if free_bytes < LITTLE_ROOM_BYTES:
        what = f"the disk has only {free_bytes / 1e6:.0f} MB left"
        checked.warnings.append(Finding(what, str(there), remedy="make room"))
    unfinished, running = [], []
    for person in sorted((results / experiment).glob("sub-*")):
        files = sorted(person.glob(f"ses-*/{FILE_NAME}"))
        if not files:
            continue
        try:
            complete = read_session(files[-1]).complete
        except ResultsError as error:
            checked.warnings += error.findings
            continue
        observer = person.name.removeprefix("sub-")
        if _is_running(files[-1].parent):
            running.append(observer)
        elif not complete:
            unfinished.append(observer)
    if unfinished:
        checked.facts["unfinished_sessions_of"] = unfinished
    if running:
        checked.facts["sessions_running_of"] = running


def _is_running(folder: Path) -> bool:
    """Return whether a process holds the session's lock; a lock's file that was left over holds nothing."""
    file = folder / ".lock"
    if not file.exists():
        return False
    try:
        with FileLock(file).acquire(timeout=0):
            return False
    except Timeout:
        return True
    except OSError:
        return False  # it cannot be opened: that is told when the session is to go on
