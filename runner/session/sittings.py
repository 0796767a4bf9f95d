"""Observers who sat before: how many sessions they have, and whether a code is likely to be somebody else's."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, SessionLog, latest_utc, plain_code, read_session
from documents.text import counted
from runner.errors import UsedCodeError
from runner.session.folders import answered, observer_folder


def next_sitting(results: Path, experiment: str, observer: str, *, simulated: bool) -> int:
    """Return the number of the observer's next session: 1 and those before it in which something was answered."""
    return 1 + sum(log is None or bool(answered(log)) for log in _earlier(results, experiment, observer, simulated))


def refuse_used(results: Path, experiment: str, observer: str, again: str, *, simulated: bool) -> None:
    """Raise UsedCodeError if the observer finished a session, with how to have ``again`` another."""
    logs = _earlier(results, experiment, observer, simulated)
    done = [log for log in logs if log is not None and log.complete and answered(log)]
    if done:
        ended = latest_utc(done[-1])
        when = f"{ended:%Y-%m-%d %H:%M} UTC" if ended else done[-1].header.started_utc
        what = f"observer {observer} finished a session of '{experiment}' on {when}"
        what += f", with {counted(answered(done[-1]), 'answer', 'answers')}"
        raise UsedCodeError(what, str(done[-1].file), again)


def near_codes(results: Path, experiment: str, observer: str) -> Iterator[str]:
    """Yield that there are sessions of a code that differs from the observer's in leading zeros only."""
    own = observer_folder(results, experiment, observer)
    for other in sorted(own.parent.glob("sub-*")):
        code = other.name.removeprefix("sub-")
        if other != own and plain_code(code) == plain_code(observer):
            yield f"there are sessions of observer {code}, and {observer} counts as somebody else"


def _earlier(results: Path, experiment: str, observer: str, simulated: bool) -> Iterator[SessionLog | None]:
    """Yield the observer's sessions, the oldest first; None for one that cannot be read, which others report."""
    for file in sorted(observer_folder(results, experiment, observer).glob(f"ses-*/{FILE_NAME}")):
        try:
            log = read_session(file)
        except ResultsError:
            yield None
            continue
        if log.header.simulated == simulated:
            yield log
