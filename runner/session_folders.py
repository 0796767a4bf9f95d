"""Where sessions lie: `RESULTS/EXPERIMENT/sub-OBSERVER/ses-TIMErandom/`, names that never collide between stations."""

from __future__ import annotations

import secrets
from datetime import UTC, datetime
from pathlib import Path

from analysis.records import FILE_NAME, SessionLog, read_session
from documents import Finding
from runner.errors import SessionError

_LETTERS = "abcdefghijkmnpqrstuvwxyz23456789"


def new_label() -> str:
    """Return a session label: UTC time to the second and four random letters, a valid BIDS label."""
    time = datetime.now(UTC).strftime("%Y%m%dT%H%M%S")
    return time + "".join(secrets.choice(_LETTERS) for _ in range(4))


def observer_folder(results: Path, experiment: str, observer: str) -> Path:
    """Return the folder of all of an observer's sessions."""
    return results / experiment / f"sub-{observer}"


def unfinished(results: Path, experiment: str, observer: str) -> SessionLog | None:
    """Return the observer's latest session if it was not completed, else None."""
    files = sorted(observer_folder(results, experiment, observer).glob(f"ses-*/{FILE_NAME}"))
    if not files:
        return None
    latest = read_session(files[-1])
    return None if latest.complete else latest


def to_resume(results: Path, experiment: str, observer: str) -> SessionLog:
    """Return the observer's unfinished session; raise SessionError if there is none."""
    log = unfinished(results, experiment, observer)
    if log is None:
        folder = observer_folder(results, experiment, observer)
        raise SessionError(
            Finding("there is no unfinished session to resume", str(folder), remedy="leave out --resume to begin one")
        )
    return log
