"""The rows of a session's tables: answers, one row per trial that counts, and events, what happened beside them.

Events are answers that a later attempt replaced, marks, notes, and the times at which the session was resumed.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from datetime import UTC, datetime
from typing import Any

from analysis.bids.columns import FIXED, Column, flatten
from analysis.bids.text import MISSING, cell
from analysis.errors import ResultsError
from analysis.records.session_record import SessionLog, Trial
from documents import Finding

_BIDS_TIME = re.compile(
    r"\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])T([01]\d|2[0-3]):[0-5]\d:[0-5]\d(\.\d{1,6})?(Z|[+-]([01]\d|2[0-3]):[0-5]\d)?",
    re.ASCII,
)


def time_cell(utc: object) -> str:
    """Return a time of day as a cell, ``n/a`` if it is none."""
    return utc if isinstance(utc, str) and _BIDS_TIME.fullmatch(utc) else MISSING


def seconds_between(start_utc: object, utc: object) -> float | None:
    """Return the seconds from one time of day to another, negative if the clock was set back; None if one is none."""
    times = []
    for text in (start_utc, utc):
        try:
            time = datetime.fromisoformat(text) if isinstance(text, str) else None
        except ValueError:
            time = None
        if time is None:
            return None
        times.append(time if time.tzinfo else time.replace(tzinfo=UTC))
    return round((times[1] - times[0]).total_seconds(), 3)


def check_trial(trial: Trial, log: SessionLog) -> Trial:
    """Return ``trial`` if its numbers are numbers.

    Raises
    ------
    ResultsError
        If they are not: the file was written by something else.
    """
    whole = all(isinstance(n, int) and not isinstance(n, bool) for n in (trial.block, trial.trial, trial.attempt))
    timed = isinstance(trial.response_time_s, int | float) and not isinstance(trial.response_time_s, bool)
    if not (whole and timed and isinstance(trial.kind, str)):
        what = f"the trial {trial.trial!r} of block {trial.block!r} has no proper number, kind or response time"
        raise ResultsError(Finding(what, str(log.file), remedy="restore the file"))
    return trial


def answer_columns(columns: Sequence[Column]) -> tuple[str, ...]:
    """Return the names of the table's columns."""
    return (*FIXED, *(column.name for column in columns))


def answer_rows(
    log: SessionLog, columns: Sequence[Column], stimuli: Collection[str], whole: Collection[str]
) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a session's table as cells, in the order in which the trials were first answered."""
    for trial in log.trials:
        recorded = dict(flatten(trial.data, stimuli, whole))
        yield (
            cell(seconds_between(log.header.started_utc, trial.utc)),
            cell(trial.block),
            cell(trial.trial),
            cell(trial.attempt),
            cell(trial.kind),
            cell(trial.response_time_s),
            time_cell(trial.utc),
            cell([list(event) for event in trial.events]),
            *(cell(recorded.get(column.place)) for column in columns),
        )


EVENT_COLUMNS = ("onset", "duration", "trial_type", "block", "trial", "attempt", "by", "response_time", "utc", "value")
EVENT_DEFINITIONS: dict[str, Any] = {
    "onset": {
        "Description": "When it was recorded, from the start of the session, by the clock of the computer; the start "
        "is known to the second.",
        "Units": "s",
        "Format": "number",
    },
    "duration": {"Description": "Not recorded.", "Units": "s", "Format": "number"},
    "trial_type": {
        "Description": "What happened.",
        "Levels": {
            "superseded_answer": "an answer that does not count, because the trial was answered again",
            "mark": "a wish that a trial be asked again",
            "note": "words written down",
            "resumption": "the session was resumed after a stop",
        },
        "Format": "string",
    },
    "block": {"Description": "Number of the block it belongs to, from 0.", "Format": "integer"},
    "trial": {
        "Description": "Number of the trial in its block, from 0; for a note, how many of the block's trials had been "
        "answered.",
        "Format": "integer",
    },
    "attempt": {"Description": "How often the trial had been answered before.", "Format": "integer"},
    "by": {
        "Description": "Who wrote the note or wished the mark.",
        "Format": "string",
    },
    "response_time": {"Description": "Response time of the superseded answer.", "Units": "s", "Format": "number"},
    "utc": {"Description": "Coordinated universal time at which it was recorded.", "Format": "datetime"},
    "value": {
        "Description": "The words of a note, with active characters escaped; of a superseded answer all that was "
        "recorded, as JSON; of a resumption the SHA-256, before and after, of what had changed meanwhile, as JSON.",
        "Format": "string",
    },
}


def _whole(number: object) -> str:
    return cell(number) if isinstance(number, int) and not isinstance(number, bool) else MISSING


def event_rows(log: SessionLog) -> list[tuple[str, ...]]:
    """Return the rows of a session's table of events as cells, by time; those without a time come last."""
    counting = {id(trial) for trial in log.trials}
    timed: list[tuple[float | None, tuple[str, ...]]] = []

    def add(utc: object, *cells: str) -> None:
        onset = seconds_between(log.header.started_utc, utc)
        kind, block, trial, attempt, by, response_time, value = cells
        row = (cell(onset), MISSING, kind, block, trial, attempt, by, response_time, time_cell(utc), value)
        timed.append((onset, row))

    for answer in log.answers:
        if id(answer) not in counting:
            what = cell({**answer.data, "kind": answer.kind})
            place = (cell(answer.block), cell(answer.trial), cell(answer.attempt))
            add(answer.utc, "superseded_answer", *place, MISSING, cell(answer.response_time_s), what)
    for mark in log.marks:
        add(mark.utc, "mark", _whole(mark.block), _whole(mark.trial), MISSING, cell(mark.by), MISSING, MISSING)
    for note in log.notes:
        by, text = cell(note.by), cell(note.text)
        add(note.utc, "note", _whole(note.block), _whole(note.trial), MISSING, by, MISSING, text)
    for resumption in log.resumptions:
        changes = cell(dict(resumption.accepted_changes)) if resumption.accepted_changes else MISSING
        add(resumption.utc, "resumption", MISSING, MISSING, MISSING, MISSING, MISSING, changes)
    timed.sort(key=lambda item: (item[0] is None, item[0] or 0.0))
    return [row for _, row in timed]
