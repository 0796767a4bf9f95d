"""When things happened in a session, counted from its start: rising, however the machine's clock was set.

A log's times rise: the session's clock cannot be set back, and a resumed session counts on from the last record. Those
of a log in which it did not (`older_logs`) are moved to begin at that record; how long it stood still is not known.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime

from analysis.records.lines import Resumption
from analysis.records.older_logs import moved_on_s
from analysis.records.session_record import Record, SessionLog

_LABEL = re.compile(r"\d{8}T\d{6}")


@dataclass(frozen=True, slots=True)
class Stop:
    """A session was resumed ``onset_s`` after its start.

    ``gap_s`` is how long it had stood still, None where the machine's clock had been set back by ``clock_behind_s``.
    """

    onset_s: float
    gap_s: float | None
    clock_behind_s: float

    @property
    def sentence(self) -> str:
        """What became of the time, in words."""
        if self.gap_s is None:
            back = duration(self.clock_behind_s)
            return f"the clock had been set back by {back} when it was resumed; how long it stood still is not known"
        return f"it was resumed after {duration(self.gap_s)}"


@dataclass(frozen=True, slots=True)
class SessionTimes:
    """The seconds from a session's start to each record; ``moved_s``, how far some were moved, is 0 but in old logs."""

    moved_s: float
    _onsets_s: Mapping[int, float | None] = field(repr=False)
    _stops: Mapping[int, Stop] = field(repr=False)

    @property
    def stops(self) -> tuple[Stop, ...]:
        """Each time that the session was resumed, and for how long it had stood still."""
        return tuple(self._stops.values())

    def stop(self, resumption: Resumption) -> Stop | None:
        """Return the stop that ended with ``resumption``; None if its time is not valid."""
        return self._stops.get(id(resumption))

    def onset_s(self, record: Record) -> float | None:
        """Return the seconds from the start to a record of the log; None if a time is not valid."""
        return self._onsets_s.get(id(record))

    @classmethod
    def of(cls, log: SessionLog) -> SessionTimes:
        """Return the times of ``log``.

        Parameters
        ----------
        log
            One session.

        Returns
        -------
        SessionTimes
            Times that rise from record to record.

        Examples
        --------
        >>> from pathlib import Path
        >>> from analysis.kinds import new_trial
        >>> from analysis.records import SessionLog, new_header
        >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
        >>> trial = new_trial(0, 0, "instructions", (), 1.2, "2026-01-31T09:31:00Z")
        >>> log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
        >>> SessionTimes.of(log).onset_s(trial)
        60.0
        """
        start = read_utc(log.header.started_utc)
        onsets_s: dict[int, float | None] = {}
        stops: dict[int, Stop] = {}
        latest_s = moved_s = 0.0
        for record in log.records:
            utc = read_utc(record.utc)
            if start is None or utc is None:
                onsets_s[id(record)] = None
                continue
            onset_s = (utc - start).total_seconds() + moved_s
            behind_s = latest_s - onset_s
            moved_s += moved_on_s(behind_s, resumed=isinstance(record, Resumption))
            onset_s = max(onset_s, latest_s)
            if isinstance(record, Resumption):
                set_back_s = max(behind_s, record.clock_behind_s, 0.0)
                gap_s = None if set_back_s > 0 else round(onset_s - latest_s, 3)
                stops[id(record)] = Stop(round(onset_s, 3), gap_s, round(set_back_s, 3))
            onsets_s[id(record)] = round(onset_s, 3)
            latest_s = onset_s
        return cls(round(moved_s, 3), onsets_s, stops)


def read_utc(text: object) -> datetime | None:
    """Return the time that ``text`` states, UTC where it names no zone; None if it is not valid."""
    try:
        time = datetime.fromisoformat(text) if isinstance(text, str) else None
    except ValueError:
        return None
    if time is None:
        return None
    return time if time.tzinfo else time.replace(tzinfo=UTC)


def latest_utc(log: SessionLog) -> datetime | None:
    """Return the latest time that ``log`` states.

    Parameters
    ----------
    log
        One session.

    Returns
    -------
    datetime | None
        The time, with its zone; None if the log states none that is valid.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> trial = new_trial(0, 0, "instructions", (), 1.2, "2026-01-31T09:31:00Z")
    >>> log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
    >>> latest_utc(log).isoformat()
    '2026-01-31T09:31:00+00:00'
    """
    stated = (log.header.started_utc, *(record.utc for record in log.records))
    return max((time for utc in stated if (time := read_utc(utc))), default=None)


def in_time(sessions: Iterable[SessionLog]) -> list[SessionLog]:
    """Return the sessions in the order in which they began.

    An observer's session labels rise in that order also where the machine's clock was set back between sessions.

    Parameters
    ----------
    sessions
        Sessions of any observers.

    Returns
    -------
    list[SessionLog]
        The same sessions, sorted by the time in their labels, or by their start where labels have none.

    Examples
    --------
    >>> in_time([])
    []
    """

    def began(session: SessionLog) -> tuple[str, str, str]:
        header = session.header
        label, started = _LABEL.match(header.session), str(header.started_utc)
        return label[0] if label else re.sub(r"[-:]", "", started)[:15], started, header.session

    return sorted(sessions, key=began)


_UNITS = ((86400, "day"), (3600, "hour"), (60, "minute"))


def duration(seconds: float) -> str:
    """Return a time in words, in its two largest units.

    Parameters
    ----------
    seconds
        The time, 0 or more.

    Returns
    -------
    str
        Days, hours, minutes or seconds.

    Examples
    --------
    >>> duration(7384), duration(60), duration(12.25)
    ('2 hours 3 minutes', '1 minute', '12.2 s')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.3g} s"
    parts = []
    for unit_s, unit in _UNITS:
        count, whole = divmod(whole, unit_s)
        if count:
            parts.append(f"{count} {unit}{'s' * (count != 1)}")
    return " ".join([*parts, f"{whole} s"][: 2 if whole else len(parts)][:2])
