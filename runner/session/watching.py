"""The sessions that are running in a folder of results, on all stations, from their logs alone.

Nothing is written and no lock is taken: a session runs on as if nobody looked. A session counts as running while its
log has no end and was written to of late; the time is that of the files, since the clocks of stations differ.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, ClassVar

from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import SessionLog, read_session, read_utc, session_files
from documents import Finding, InputError
from documents.files import MOST_LOG_BYTES, looked_for, open_regular
from documents.options import Typed
from documents.text import JsonResult, visible
from runner.session.status import SessionStatus, time_left

RECENT_S = 1800.0
_MOST_IN_SECONDS_S = 90.0


@dataclass(frozen=True, slots=True)
class WatchedSession(JsonResult):
    """Where one session stands.

    Attributes
    ----------
    file, experiment, observer, session, station
        Its log, and what its header states.
    complete
        Whether the end was recorded.
    answered, trials
        Scored trials answered, and how many there are; None where an older version began the log.
    minutes_left
        What is left at this observer's pace; None where ``trials`` is.
    last
        The last answers with their response times in seconds, the latest last.
    missed_frames
        Of the timed scenes of all trials; those between trials stand in the log only at its end.
    idle_s
        Seconds since the log was last written to.
    """

    file: str
    experiment: str
    observer: str
    session: str
    station: str
    complete: bool
    answered: int
    trials: int | None
    minutes_left: float | None
    last: tuple[str, ...]
    missed_frames: int
    idle_s: float

    def line(self) -> str:
        """Return all of it on one line."""
        of = "" if self.trials is None else f" of {self.trials}"
        parts = [
            f"{visible(self.experiment)}, observer {visible(self.observer)}, station {visible(self.station or '?')}",
            f"trial {self.answered}{of}",
            "complete" if self.complete else "" if self.minutes_left is None else time_left(self.minutes_left),
            f"missed frames {self.missed_frames}",
            f"last: {', '.join(self.last)}" if self.last else "no answer yet",
            f"{_ago(self.idle_s)} ago",
        ]
        return " · ".join(part for part in parts if part)


@dataclass(frozen=True, slots=True)
class Watched(JsonResult):
    """What is running: the ``sessions``, the latest written first, and ``findings`` on logs that cannot be read.

    Sessions that were written to ``within_s`` are shown; ``again`` is whether it is looked at again and again.
    """

    sessions: tuple[WatchedSession, ...]
    findings: tuple[Finding, ...] = ()
    within_s: float = RECENT_S
    again: bool = False
    json_names: ClassVar = "sessions unreadable"

    @property
    def unreadable(self) -> list[str]:
        """The findings, in words."""
        return list(map(str, self.findings))

    def told(self) -> Iterator[str]:
        """Yield a line for each session."""
        yield from (session.line() for session in self.sessions)
        if not self.sessions:
            yield f"no session was written to in the last {self.within_s / 60:g} min"

    def apart(self, as_json: bool) -> Iterator[str]:
        """Yield a warning for each log that cannot be read, where JSON does not say it."""
        yield from (f"warning: {finding}" for finding in (() if as_json else self.findings))


def watch(
    results: Path,
    *,
    once: bool = False,
    every_s: Annotated[float, Typed("--every", "SECONDS", 0.2, 3600)] = 2.0,
    within_min: Annotated[float, Typed("--within", "MINUTES", 0.1, 1e6)] = 30.0,
) -> Iterator[Watched]:
    """Show the sessions that are running, on this station and others.

    RESULTS is a folder, which may lie on a drive that several stations share. For each session: the trial, the time
    left, the last answers, missed frames, and when its log was last written to. Only logs are read, and nothing is
    written.

    Parameters
    ----------
    results
        Folder of results.
    once
        Look once, not again and again until Ctrl-C.
    every_s
        How often to look again.
    within_min
        Show the sessions that were written to so lately.

    Yields
    ------
    Watched
        What is running now.

    Raises
    ------
    ResultsError
        If the folder does not exist.
    """
    looking = Watch(results, 60 * within_min)
    while True:
        yield replace(looking.look(), again=not once)
        if once:
            return
        try:
            time.sleep(every_s)
        except KeyboardInterrupt:
            return


@dataclass(slots=True)
class Watch:
    """Looks at ``results`` again and again; a log that did not change is not read again.

    ``recent_s`` is for how long after the last line a session is shown; ``now`` gives the time of the files' clock.
    """

    results: Path
    recent_s: float = RECENT_S
    now: Callable[[], float] = time.time
    read: int = 0
    """How many logs were read."""
    _known: dict[Path, tuple[tuple[int, int], SessionLog]] = field(default_factory=dict)

    def look(self) -> Watched:
        """Return what is running now.

        Raises
        ------
        ResultsError
            If the folder does not exist.
        """
        if not self.results.exists():
            raise ResultsError(
                Finding("there is no such folder or file", str(self.results), remedy=looked_for(self.results))
            )
        sessions: list[WatchedSession] = []
        findings: list[Finding] = []
        for file in session_files(self.results):
            try:
                facts = file.stat()
                idle_s = max(0.0, self.now() - facts.st_mtime)
                if idle_s > self.recent_s or not facts.st_size:
                    continue
                sessions.append(_session(self._log(file, (facts.st_mtime_ns, facts.st_size)), idle_s))
            except FileNotFoundError:
                continue  # it was moved away
            except ResultsError as error:
                findings += error.findings if _has_begun(file) else ()
        return Watched(tuple(sorted(sessions, key=lambda one: one.idle_s)), tuple(findings), self.recent_s)

    def _log(self, file: Path, version: tuple[int, int]) -> SessionLog:
        known = self._known.get(file)
        if known is not None and known[0] == version:
            return known[1]
        log = read_session(file)
        self.read += 1
        self._known[file] = version, log
        return log


def _session(log: SessionLog, idle_s: float) -> WatchedSession:
    header = log.header
    planned = [(one.kind, one.trials, one.expected_s) for one in header.planned]
    known = bool(planned)
    if not known:
        most = max((answer.block for answer in log.answers), default=0)
        planned = [("", len({a.place for a in log.answers if a.block == n}), 0.0) for n in range(most + 1)]
    at_s = _seconds(header.started_utc)
    clock = [at_s]
    status = SessionStatus(planned, lambda: clock[0])
    for answer in log.answers:
        clock[0] = max(clock[0], _ends(answer, clock[0]))
        if answer.block < len(planned):
            status.update(answer)
    parts = header.experiment, str(header.observer), header.session, header.station, log.complete
    return WatchedSession(
        str(log.file),
        *parts,
        status.answered,
        status.trials if known else None,
        round(status.minutes_left, 2) if known else None,
        status.last,
        status.missed,
        round(idle_s, 1),
    )


def _has_begun(file: Path) -> bool:
    """Return whether the first line of a log is there whole: another station may be writing it."""
    try:
        with open_regular(file, "log", limit_bytes=MOST_LOG_BYTES) as stream:
            return stream.readline().endswith(b"\n")
    except InputError:
        return True  # no line will make it a log


def _seconds(utc: str) -> float:
    found = read_utc(utc)
    return found.timestamp() if found else 0.0


def _ends(answer: Trial, before_s: float) -> float:
    """Return when an answer was given; its response time after the last one where the log's time is too coarse."""
    return max(_seconds(answer.utc), before_s + answer.response_time_s)


def _ago(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < _MOST_IN_SECONDS_S else f"{seconds / 60:.0f} min"
