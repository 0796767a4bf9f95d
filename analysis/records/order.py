"""What the lines of a log say together: each record must follow from those before it."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from analysis.records.fields import RecordError, read_fields
from analysis.records.other_records import (
    Clipping,
    ClippingRecord,
    EndRecord,
    HeaderRecord,
    MarkRecord,
    NoteRecord,
    ResumptionRecord,
    WindowRecord,
    read_header,
)
from analysis.records.trial_kinds import PRACTICE, read_trial
from analysis.records.trial_record import Session, TrialRecord

# Notes and events of the window come from other threads, and presses are stamped before they are read.
_SLACK_S = 1.0
# The machine's clock may be set right after a header was written.
_FIRST_SLACK_S = 60.0

Place = tuple[int, int]


class Order:
    """What the records so far have said. Each method takes the next line, or raises RecordError."""

    def __init__(self, line: dict[str, Any]) -> None:
        self.header: HeaderRecord = read_header(line)
        self.complete = False
        factors = {stimulus.name: stimulus.factors for stimulus in self.header.stimuli}
        self._session = Session(factors, own_keys=bool(self.header.interface.keys))
        # What the gamut clip costs each stimulus, as it was stated first; None where it was not.
        self.costs: dict[str, Any] = {stimulus["name"]: stimulus.get("clipping") for stimulus in line["stimuli"]}
        self._asked: dict[Place, tuple[Any, ...]] = {}
        self._attempts: dict[Place, int] = {}
        self._last: Place = (-1, -1)
        self._changed = self._screened_out = False
        self._run_began_s = self._latest_s = _seconds(self.header.started_utc)
        self._slack_s = _FIRST_SLACK_S

    def trial(self, line: dict[str, Any]) -> TrialRecord:
        """Take an answer."""
        trial = read_trial(line)
        self._place(trial)
        self._time(trial.utc)
        self._waited(trial)
        self._stimuli(trial, line)
        for what in trial.contradictions(self._session, practised=trial.kind == PRACTICE):
            raise RecordError(what)
        for what in trial.timed_by_events():
            raise RecordError(what)
        self._screened_out = "screened_out" in line
        return trial

    def note(self, line: dict[str, Any]) -> NoteRecord:
        """Take a note."""
        note = read_fields(NoteRecord, line)
        self._time(note.utc)
        self._reached(note.block, note.trial)
        return note

    def mark(self, line: dict[str, Any]) -> MarkRecord:
        """Take a mark."""
        mark = read_fields(MarkRecord, line)
        self._time(mark.utc)
        if (mark.block, mark.trial) not in self._asked:
            raise RecordError(f"it marks trial {mark.trial} of block {mark.block}, which was not answered before")
        return mark

    def window(self, line: dict[str, Any]) -> WindowRecord:
        """Take an event of the window."""
        event = read_fields(WindowRecord, line)
        self._time(event.utc)
        self._reached(event.block, event.trial)
        return event

    def resumption(self, line: dict[str, Any]) -> ResumptionRecord:
        """Take a resumption: the clock may stand anywhere then."""
        resumption = read_fields(ResumptionRecord, line)
        self._run_began_s = self._latest_s = _seconds(resumption.utc)
        self._changed = self._changed or bool(resumption.accepted_changes)
        return resumption

    def clipping(self, line: dict[str, Any]) -> ClippingRecord:
        """Take what the gamut clip costs stimuli of which it was not said before."""
        record = read_fields(ClippingRecord, line)
        self._time(record.utc)
        for name, costs in line["stimuli"].items():
            if name not in self.costs:
                raise RecordError(f"it states the clipping of '{name}', which is no stimulus of the session")
            self._cost(name, costs)
        return record

    def end(self, line: dict[str, Any]) -> EndRecord:
        """Take the end."""
        end = read_fields(EndRecord, line)
        if end.screened_out != self._screened_out:
            raise RecordError("the session ends as screened out if its last trial says so, and not otherwise")
        self.complete = True
        return end

    def _place(self, trial: TrialRecord) -> None:
        """Check that the trial is the next one, or the next attempt at an earlier one."""
        place = trial.block, trial.trial
        block, number = self._last
        if trial.attempt == 0:
            if place not in ((block, number + 1), (block + 1, 0)) or (number < 0 and place != (0, 0)):
                follows = f"trial {number} of block {block}" if number >= 0 else "the header"
                raise RecordError(f"trial {trial.trial} of block {trial.block} does not follow {follows}")
            self._asked[place] = _asked(trial)
            self._last = place
        else:
            asked = self._asked.get(place)
            if asked is None:
                raise RecordError(f"attempt {trial.attempt} is at a trial that was not answered before")
            if trial.attempt != self._attempts[place] + 1:
                raise RecordError(f"attempt {trial.attempt} follows attempt {self._attempts[place]}")
            if _asked(trial) != asked:
                raise RecordError("it asks something else than the attempt before")
        self._attempts[place] = trial.attempt

    def _time(self, utc: str) -> None:
        """Check that time goes on; it may jump where the session was resumed."""
        now_s = _seconds(utc)
        if now_s < self._latest_s - self._slack_s:
            raise RecordError(f"its time {utc} is before that of the record before it")
        if self._slack_s == _FIRST_SLACK_S:
            self._run_began_s = min(now_s, self._run_began_s)
        self._latest_s, self._slack_s = now_s, _SLACK_S

    def _waited(self, trial: TrialRecord) -> None:
        """Check that nobody waited longer than the session runs; those who do not wait are simulated.

        Where a scene looked like the one before, older logs time it from the onset of that one.
        """
        since_s = self._latest_s - self._run_began_s
        if not self.header.simulated and trial.response_time_s > since_s + _SLACK_S:
            ran = f"the session began or was resumed {since_s:.1f} s before"
            what = f"the response time is {trial.response_time_s:g} s, and {ran}"
            raise RecordError(what)

    def _reached(self, block: int, trial: int) -> None:
        last_block, last_trial = self._last
        ahead = block > last_block + 1 or (block == last_block + 1 and trial > 0)
        if ahead or (block == last_block and trial > last_trial + 1):
            raise RecordError(f"the session had not come to trial {trial} of block {block}")

    def _stimuli(self, trial: TrialRecord, line: dict[str, Any]) -> None:
        """Check that the header lists what is shown, and that clipping costs what was said of it first.

        Costs that do are one object from then on: a trial's are most of what it says.
        """
        for name in trial.stimuli:
            if name not in self.costs:
                raise RecordError(f"it shows '{name}', which is no stimulus of the session")
        clipping = line.get("clipping") or {}
        for name, costs in clipping.items():
            if name not in trial.stimuli:
                raise RecordError(f"its clipping is that of '{name}', which it does not show")
            clipping[name] = self._cost(name, costs)

    def _cost(self, name: str, costs: Any) -> Any:
        """Check what clipping costs a stimulus of the header, and return it."""
        stated = self.costs[name]
        if costs == stated:
            return stated
        if not (self._changed or stated is None):
            raise RecordError(f"the clipping of '{name}' is another than in the session's header")
        read_fields(Clipping, costs)
        if stated is None:
            self.costs[name] = costs
        return costs


def _asked(trial: TrialRecord) -> tuple[Any, ...]:
    values = (getattr(trial, name) for name in trial.asked)
    return trial.kind, *(tuple(value) if isinstance(value, list) else value for value in values)


def _seconds(utc: str) -> float:
    try:
        return datetime.fromisoformat(utc).timestamp()
    except ValueError:
        raise RecordError(f"'{utc}' is no time") from None
