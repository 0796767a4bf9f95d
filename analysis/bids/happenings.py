"""The table of events: what happened in a session beside the answers that count.

Answers that a later attempt replaced, marks, notes, and the times at which the session was taken up again.
"""

from __future__ import annotations

from typing import Any

from analysis.bids.answers import seconds_between, time_cell
from analysis.bids.text import MISSING, cell
from analysis.records.session_record import SessionLog

HEADER = ("onset", "duration", "trial_type", "block", "trial", "attempt", "by", "response_time", "utc", "value")
DEFINITIONS: dict[str, Any] = {
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
            "resumption": "the session was taken up again after a stop",
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


def rows(log: SessionLog) -> list[tuple[str, ...]]:
    """Return the rows of a session's table of events as cells, by time; those without a time come last."""
    counting = {id(trial) for trial in log.trials}
    found: list[tuple[float | None, tuple[str, ...]]] = []

    def add(utc: object, *cells: str) -> None:
        onset = seconds_between(log.header.started_utc, utc)
        kind, block, trial, attempt, by, response_time, value = cells
        row = (cell(onset), MISSING, kind, block, trial, attempt, by, response_time, time_cell(utc), value)
        found.append((onset, row))

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
    found.sort(key=lambda item: (item[0] is None, item[0] or 0.0))
    return [row for _, row in found]
