"""Where sessions lie: `RESULTS/EXPERIMENT/sub-OBSERVER/ses-TIMErandom/`, names that never collide between stations."""

from __future__ import annotations

import re
import secrets
from datetime import UTC, datetime, timedelta
from pathlib import Path

from analysis.records.session_record import FILE_NAME, SessionLog, read_session
from documents import Finding
from runner.errors import SessionError

_LETTERS = "abcdefghijkmnpqrstuvwxyz23456789"
_RANDOM = 10
_NAMED = 12
_TIME = "%Y%m%dT%H%M%S"
_LABEL = re.compile(rf"ses-(\d{{8}}T\d{{6}})[{_LETTERS}]+")


def new_label(folder: Path | None = None, now: datetime | None = None) -> str:
    """Return a session label: UTC time to the second and ten random letters, a valid BIDS label.

    Labels in one observer's ``folder`` rise in the order in which the sessions began: where the clock stands before the
    latest of them, as it does after it was set back, the time is a second after that one's. Of labels made in the same
    second on any number of stations, two in a thousand million million are the same.
    """
    time = (now or datetime.now(UTC)).replace(microsecond=0, tzinfo=None)
    taken = (
        [_read_time(found[1]) for path in folder.glob("ses-*") if (found := _LABEL.fullmatch(path.name))]
        if folder
        else []
    )
    if taken:
        time = max(time, max(taken) + timedelta(seconds=1))
    return time.strftime(_TIME) + "".join(secrets.choice(_LETTERS) for _ in range(_RANDOM))


def _read_time(text: str) -> datetime:
    try:
        return datetime.strptime(text, _TIME)
    except ValueError:  # someone's own digits
        return datetime.min


def observer_folder(results: Path, experiment: str, observer: str) -> Path:
    """Return the folder of all of an observer's sessions."""
    return results / experiment / f"sub-{observer}"


def unfinished(results: Path, experiment: str, observer: str) -> SessionLog | None:
    """Return the observer's latest session if it was not completed, else None.

    One in which nothing was asked yet, as where ``--resume`` was forgotten and the session left at once, does not stand
    before an unfinished one in which something was.
    """
    latest: SessionLog | None = None
    for file in sorted(observer_folder(results, experiment, observer).glob(f"ses-*/{FILE_NAME}"), reverse=True):
        log = read_session(file)
        if log.complete:
            break
        if _asked_something(log):
            return log
        latest = latest or log
    return latest


def _asked_something(log: SessionLog) -> bool:
    """Return whether more than pages of words were answered."""
    return any(answer.kind not in ("instructions", "break") for answer in log.answers)


def to_resume(results: Path, experiment: str, observer: str) -> SessionLog:
    """Return the observer's unfinished session; raise SessionError if there is none."""
    log = unfinished(results, experiment, observer)
    if log is None:
        folder = observer_folder(results, experiment, observer)
        others = sorted(path.name.removeprefix("sub-") for path in folder.parent.glob("sub-*"))
        remedy = "leave out --resume to begin one"
        if not folder.exists() and others:
            remedy += f"; sessions there are of the observers {', '.join(others[:_NAMED])}"
            remedy += ", ..." if len(others) > _NAMED else ""
        raise SessionError(Finding("there is no unfinished session to resume", str(folder), remedy=remedy))
    return log
