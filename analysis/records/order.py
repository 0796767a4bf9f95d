"""What the lines of a log say together: each record must follow from those before it."""

from __future__ import annotations

from typing import Any

from analysis.kinds.fields import RecordError, read_fields
from analysis.kinds.kinds import read_trial
from analysis.kinds.trial import PRACTICE, SoFar, Trial
from analysis.records.lines import (
    Clipping,
    EndRecord,
    Header,
    Mark,
    Note,
    Resumption,
    SharedParts,
    StimulusCosts,
    WindowEvent,
    read_header,
)
from analysis.records.pooled_batches import PooledBatch, PooledBatches

Place = tuple[int, int]
_NOTHING: dict[str, Any] = {}  # no trial is changed


class LogOrder:
    """What the records so far have said. Each method takes the next line, or raises RecordError.

    ``added`` are stimuli that the header does not list: those of a recipe that was changed, where that was accepted.
    """

    def __init__(self, line: dict[str, Any], shared: SharedParts) -> None:
        self.header: Header = read_header(line, shared)
        self.complete = False
        self._session = SoFar(self.header.factors, own_keys=bool(self.header.interface.keys))
        # What the gamut clip costs each stimulus, as it was stated first; None where it was not.
        self.costs: dict[str, Any] = {}
        self._shared = shared
        for stimulus, stated in zip(self.header.stimuli, line["stimuli"], strict=True):
            costs = stated.get("clipping")
            if stimulus.clipping is not None:
                costs, stimulus.clipping = self._one_object(stimulus.name, costs, stimulus.clipping)
            self.costs[stimulus.name] = costs
        self._given: dict[tuple[Any, ...], set[str]] = {}
        self._first: dict[Place, Trial] = {}
        self._attempts: dict[Place, int] = {}
        self._pooled = PooledBatches()
        self._last: Place = (-1, -1)
        self._resumed = self._changed = self._screened_out = False
        self.added: list[str] = []

    def trial(self, line: dict[str, Any], *, as_recorded: bool = False) -> Trial:
        """Take an answer; where the line is ``as_recorded``, by its checksum, its presses are not compared with it."""
        trial = read_trial(line)
        self._share(trial, line)
        practised = trial.kind == PRACTICE
        self._place(trial)
        self._stimuli(trial)
        if self._pooled.are_any and trial.attempt == 0:
            self._pooled.check(trial)
        for what in trial.contradictions(self._session, practised=practised):
            raise RecordError(what)
        if not as_recorded:
            for what in trial.pressed_otherwise(self._session, practised=practised):
                raise RecordError(what)
        self._screened_out = "screened_out" in line
        return trial

    def note(self, line: dict[str, Any]) -> Note:
        """Take a note."""
        note = read_fields(Note, line)
        self._reached(note.block, note.trial)
        return note

    def mark(self, line: dict[str, Any]) -> Mark:
        """Take a mark."""
        mark = read_fields(Mark, line)
        if (mark.block, mark.trial) not in self._first:
            raise RecordError(f"it marks trial {mark.trial} of block {mark.block}, which was not answered before")
        return mark

    def window(self, line: dict[str, Any]) -> WindowEvent:
        """Take an event of the window."""
        event = read_fields(WindowEvent, line)
        self._reached(event.block, event.trial)
        return event

    def resumption(self, line: dict[str, Any]) -> Resumption:
        """Take a resumption: on another machine, clipping may cost other last digits; what was changed may be all."""
        resumption = read_fields(Resumption, line)
        self._resumed = True
        if resumption.accepted_changes:
            self._changed = True
            self._session.forget()
        return resumption

    def clipping(self, line: dict[str, Any]) -> StimulusCosts:
        """Take what the gamut clip costs stimuli of which it was not said before."""
        record = read_fields(StimulusCosts, line)
        for name, costs in line["stimuli"].items():
            self._known(name, "states the clipping of")
            self._cost(name, costs)
        return record

    def pool(self, line: dict[str, Any]) -> PooledBatch:
        """Take a batch of pairs that was chosen by the answers of all observers: before its first trial, and once."""
        batch = self._pooled.take(line, changed=self._changed)
        block, number = self._last
        if batch.place not in ((block, number + 1), (block + 1, 0)):
            raise RecordError(f"the session had not come to trial {batch.trial} of block {batch.block}")
        for name in batch.stimuli:
            self._known(name, "chooses among stimuli with")
        return batch

    def end(self, line: dict[str, Any]) -> EndRecord:
        """Take the end."""
        end = read_fields(EndRecord, line)
        if end.screened_out != self._screened_out:
            raise RecordError("the session ends as screened out if its last trial says so, and not otherwise")
        self.complete = True
        return end

    def _share(self, trial: Trial, line: dict[str, Any]) -> None:
        """Let trials that state the same have one object for it: two fifths of their memory."""
        given = self._given.setdefault((type(trial), *line), trial.__pydantic_fields_set__)
        object.__setattr__(trial, "__pydantic_fields_set__", given)
        if not trial.__pydantic_extra__:
            object.__setattr__(trial, "__pydantic_extra__", _NOTHING)
        if trial.clipping:
            trial.__dict__["clipping"] = line["clipping"]  # which the model copied

    def _place(self, trial: Trial) -> None:
        """Check that the trial is the next one, or the next attempt at an earlier one."""
        place = trial.block, trial.trial
        block, number = self._last
        if trial.attempt == 0:
            if place not in ((block, number + 1), (block + 1, 0)) or (number < 0 and place != (0, 0)):
                follows = f"trial {number} of block {block}" if number >= 0 else "the header"
                raise RecordError(f"trial {trial.trial} of block {trial.block} does not follow {follows}")
            self._first[place] = trial
            self._last = place
        else:
            first = self._first.get(place)
            if first is None:
                raise RecordError(f"attempt {trial.attempt} is at a trial that was not answered before")
            if trial.attempt != self._attempts[place] + 1:
                raise RecordError(f"attempt {trial.attempt} follows attempt {self._attempts[place]}")
            if _asked(trial) != _asked(first) and not self._changed:
                raise RecordError("it asks something else than the attempt before")
        self._attempts[place] = trial.attempt

    def _reached(self, block: int, trial: int) -> None:
        last_block, last_trial = self._last
        ahead = block > last_block + 1 or (block == last_block + 1 and trial > 0)
        if ahead or (block == last_block and trial > last_trial + 1):
            raise RecordError(f"the session had not come to trial {trial} of block {block}")

    def _stimuli(self, trial: Trial) -> None:
        """Check that the header lists what is shown, and that clipping costs what was said of it first.

        Costs that do are one object from then on: a trial's are most of what it says.
        """
        shown = trial.stimuli
        for name in shown:
            if name not in self.costs:
                self._known(name, "shows")
        clipping = trial.clipping or {}
        for name, costs in clipping.items():
            if name not in shown:
                raise RecordError(f"its clipping is that of '{name}', which it does not show")
            clipping[name] = self._cost(name, costs)

    def _known(self, name: str, what: str) -> None:
        """Check that the header lists a stimulus, or that the stimuli were changed and this was accepted."""
        if name not in self.costs:
            if not self._changed:
                raise RecordError(f"it {what} '{name}', which is no stimulus of the session")
            self.costs[name] = None
            self.added.append(name)

    def _cost(self, name: str, costs: Any) -> Any:
        """Check what clipping costs a stimulus, and return it; other last digits are another machine's."""
        stated = self.costs[name]
        if costs is stated or costs == stated:
            return stated
        if not (self._resumed or stated is None):
            raise RecordError(f"the clipping of '{name}' is another than in the session's header")
        read = read_fields(Clipping, costs)
        if stated is None:
            self.costs[name] = costs = self._one_object(name, costs, read)[0]
        return costs

    def cost_of(self, name: str) -> Clipping | None:
        """Return what clipping costs a stimulus as it was stated first; None where it was not."""
        costs = self.costs.get(name)
        return self._one_object(name, costs, read_fields(Clipping, costs))[1] if costs else None

    def _one_object(self, name: str, costs: Any, read: Clipping) -> tuple[Any, Clipping]:
        """Return ``costs``, and how they were ``read``, as the objects that logs before have, where these are equal."""
        known = self._shared.costs.setdefault(name, (costs, read))
        return known if known[0] == costs else (costs, read)


def _asked(trial: Trial) -> tuple[Any, ...]:
    values = (getattr(trial, name) for name in trial.asked)
    return trial.kind, *(tuple(value) if isinstance(value, list) else value for value in values)
