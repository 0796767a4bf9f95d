"""What a mark is of, in words that another machine can keep: which trial, which event, what was shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import quote

from devices.timing_marks.port import Event


@dataclass(frozen=True, slots=True)
class Marked:
    """An onset or an answer of the trial number ``trial`` of the block number ``block``, as the log counts them.

    Parameters
    ----------
    event
        ``onset`` or ``answer``.
    block, trial, attempt
        Numbers from 0; ``attempt`` is above 0 where the trial is asked once more. A page before a trial has its number.
    timed
        The name of a scene that stands for a given time, such as a fixation cross; empty for one that asks.
    stimuli
        The names of those shown, in drawing order.
    condition
        The levels of the factors that all of them share, by factor.

    Examples
    --------
    >>> shown = Marked("onset", 1, 4, stimuli=("a", "b 2"), condition={"light": "sun"})
    >>> shown.text
    'event=onset block=1 trial=4 stimuli=a,b%202 condition.light=sun'
    >>> shown.fits("condition.light=sun"), shown.fits("event=answer stimuli=a"), shown.fits("stimuli=a block=1")
    (True, False, True)
    """

    event: Event
    block: int = 0
    trial: int = 0
    attempt: int = 0
    timed: str = ""
    stimuli: tuple[str, ...] = ()
    condition: Mapping[str, str] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """Everything as ``name=value``, one space between; what is empty is left out, and what is no letter, digit or
        one of ``_.-~`` in a value is written as ``%`` and hexadecimal digits, as in an address of the web."""
        return self.text_as(self.event)

    def text_as(self, event: str) -> str:
        """Return `text` with another word for the event."""
        pairs = [("event", quote(event, "")), ("block", str(self.block)), ("trial", str(self.trial))]
        pairs += [("attempt", str(self.attempt))] if self.attempt else []
        pairs += [("timed", quote(self.timed, ""))] if self.timed else []
        pairs += [("stimuli", ",".join(quote(name, "") for name in self.stimuli))] if self.stimuli else []
        pairs += [(f"condition.{quote(name, '')}", quote(level, "")) for name, level in self.condition.items()]
        return " ".join(f"{name}={value}" for name, value in pairs)

    def fits(self, rule: str) -> bool:
        """Return whether each ``name=value`` of ``rule`` holds; ``stimuli`` does for each of those that are shown.

        A rule that names no event is one of onsets.
        """
        wanted = [pair.partition("=")[::2] for pair in rule.split()]
        if not any(name == "event" for name, _ in wanted):
            wanted.append(("event", "onset"))
        return all(value in self._values(name) for name, value in wanted)

    def _values(self, name: str) -> tuple[str, ...]:
        """Return what may stand for ``name`` in a rule, written as in `text`."""
        pairs = [pair.partition("=")[::2] for pair in self.text.split()]
        if name == "attempt":
            return (str(self.attempt),)
        return tuple(
            part for own, value in pairs if own == name for part in (value.split(",") if name == "stimuli" else [value])
        )
