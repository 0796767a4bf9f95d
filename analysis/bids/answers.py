"""The table of answers: one row per trial that counts."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from datetime import UTC, datetime

from analysis.bids.columns import FIXED, Column
from analysis.bids.flatten import flatten
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


def header(columns: Sequence[Column]) -> tuple[str, ...]:
    """Return the names of the table's columns."""
    return (*FIXED, *(column.name for column in columns))


def rows(
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
