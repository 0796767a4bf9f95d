"""What a mark is of, the port that it goes to, and what entries of every kind of a rig's ``timing_marks`` have."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Protocol, TypeAlias
from urllib.parse import quote

from pydantic import AfterValidator, Field

from devices.errors import DeviceError
from devices.timing_marks import MarksKind

Event: TypeAlias = Literal["onset", "answer"]
Code: TypeAlias = int | str
Byte = Annotated[int, Field(ge=1, le=255)]
PulseMs = Annotated[float, Field(ge=0.1, le=1000)]
_PAIR = r"(event=(onset|answer)|(block|trial|attempt)=[0-9]+|(timed|stimuli|condition\.[^\s=]+)=[^\s=,]+)"


class MarkError(DeviceError):
    """A port cannot be opened, or did not take this mark; another mark may go through."""


class PortLostError(MarkError):
    """The port is gone, such as an adapter that was pulled out: no mark will go through any more."""


class MarkPort(Protocol):
    """An open port. Nothing that is done to it waits for whatever reads from it."""

    @property
    def is_heard(self) -> bool:
        """Whether something reads what is sent; True also where no port could tell."""

    def send(self, code: Code, event_s: float, trial_byte: int | None = None) -> None:
        """Send ``code`` for what happened at ``event_s`` of ``time.monotonic``, without waiting.

        ``trial_byte`` follows it, 0 to 255, where the port takes two bytes. Raises MarkError if it could not be sent:
        PortLostError if no other will be either.
        """

    def close(self) -> None:
        """Close the port. Pins and lines are left at 0."""


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


@dataclass(frozen=True, slots=True)
class Loopback:
    """An open ``port``, what it goes through (``by``), and ``receive``.

    ``receive`` waits for the next mark, for so many seconds at most, and returns whether it came.
    """

    port: MarkPort
    by: str
    receive: Callable[[float], bool]


def _checked_rule(rule: str) -> str:
    if not re.fullmatch(rf"{_PAIR}( {_PAIR})*", rule):
        raise ValueError(
            "write name=value, with one space before the next, such as condition.light=sun or event=answer block=1; "
            "names are event, block, trial, attempt, timed, stimuli and condition.FACTOR"
        )
    return rule


Rule = Annotated[str, Field(max_length=1000), AfterValidator(_checked_rule)]
Codes = Annotated[dict[Rule, Byte], Field(max_length=255)]


class MarksSpec(MarksKind):
    """What entries of every kind have: how their port is opened, and the codes of events."""

    part = "extensions.marks.session:SentMarks"

    @abstractmethod
    def open_port(self) -> MarkPort:
        """Open the port, which no other program has.

        Raises
        ------
        MarkError
            If it cannot be opened; the message names the port and what to do.
        """

    @contextmanager
    def loopback(self) -> Iterator[Loopback | None]:
        """Open a loopback of this kind, with its codes; None where none can be had. Its own port is not opened.

        Raises
        ------
        MarkError
            If what it needs is missing, or what is sent does not come back.
        """
        yield None

    def code(self, marked: Marked) -> Code | None:
        """Return what is sent for ``marked``, None if nothing."""
        code: Code | None = getattr(self, marked.event)
        return code

    @property
    def with_trial_byte(self) -> bool:
        """Whether the number of the trial follows each code, in a byte."""
        return False

    @property
    def waits_s(self) -> float:
        """How many seconds a session waits, before its window opens, for someone who reads the marks."""
        return 0.0

    @property
    def facts(self) -> dict[str, Any]:
        """What a session's record states of it."""
        return self.model_dump(mode="json")


class CodedMarks(MarksSpec):
    """Marks that are a byte each."""

    codes: Codes = Field(default_factory=dict)
    """A byte by what is marked, such as condition.light=sun or timed=fixation; the first that fits is sent."""

    def code(self, marked: Marked) -> Code | None:
        """Return the byte of the first of ``codes`` that fits ``marked``, else that of its event; None for no mark."""
        return next((code for rule, code in self.codes.items() if marked.fits(rule)), super().code(marked))
