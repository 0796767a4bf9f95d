"""The rig file's ``timing_marks``: where marks go, and which code stands for what."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import AfterValidator, Discriminator, Field, Tag

from devices.timing_marks.marked import Marked
from devices.timing_marks.port import Code
from documents.yaml import FileModel

Byte = Annotated[int, Field(ge=1, le=255)]
Words = Annotated[str, Field(min_length=1, max_length=100)]
PulseMs = Annotated[float, Field(ge=0.1, le=1000)]
_PAIR = r"(event=(onset|answer)|(block|trial|attempt)=[0-9]+|(timed|stimuli|condition\.[^\s=]+)=[^\s=,]+)"


def _checked_rule(rule: str) -> str:
    if not re.fullmatch(rf"{_PAIR}( {_PAIR})*", rule):
        raise ValueError(
            "write name=value, with one space before the next, such as condition.light=sun or event=answer block=1; "
            "names are event, block, trial, attempt, timed, stimuli and condition.FACTOR"
        )
    return rule


Rule = Annotated[str, Field(max_length=1000), AfterValidator(_checked_rule)]
Codes = Annotated[dict[Rule, Byte], Field(max_length=255)]


class _Marks(FileModel):
    """What entries of every kind have: the key that says where marks go, and the codes of events."""

    place: ClassVar[Literal["port", "stream"]] = "port"
    kind: str

    @property
    def name(self) -> str:
        """What it is called in records and messages, such as ``serial /dev/ttyUSB0``."""
        return f"{self.kind} {getattr(self, self.place)}"

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


class LslMarksSpec(_Marks):
    """Marks on Lab Streaming Layer: a stream of text, of the type Markers."""

    place = "stream"
    kind: Literal["lsl"]
    """Lab Streaming Layer, with the package pylsl."""
    stream: Words = "cyclopean"
    """The name of the stream, by which a recorder finds it."""
    onset: Words | None = "onset"
    """The word for an onset in the text of each onset's mark; null sends none."""
    answer: Words | None = "answer"
    """The word for an answer in the text of each answer's mark; null sends none."""
    wait_s: Annotated[float, Field(ge=0, le=3600)] = 30.0
    """Seconds that a session waits, before its window opens, for a recorder that receives the stream."""

    def code(self, marked: Marked) -> Code | None:
        """Return the text of ``marked``, with this stream's word for the event; None if nothing is sent."""
        word = super().code(marked)
        return None if word is None else marked.text_as(str(word))

    @property
    def waits_s(self) -> float:
        """How many seconds a session waits for a recorder."""
        return self.wait_s


class _Coded(_Marks):
    """Marks that are a byte each."""

    codes: Codes = Field(default_factory=dict)
    """A byte by what is marked, such as condition.light=sun or timed=fixation; the first that fits is sent."""

    def code(self, marked: Marked) -> Code | None:
        """Return the byte of the first of ``codes`` that fits ``marked``, else that of its event; None for no mark."""
        fitting = (code for rule, code in self.codes.items() if marked.fits(rule))
        return next(fitting, super().code(marked))


class SerialMarksSpec(_Coded):
    """Marks on a serial port: one byte each, 8 data bits, no parity, 1 stop bit."""

    kind: Literal["serial"]
    """A serial port, also one of an adapter or a trigger box at USB."""
    port: str = Field(min_length=1)
    """The port, such as /dev/ttyUSB0 or COM4."""
    baud: Annotated[int, Field(ge=50, le=4_000_000)] = 115_200
    """The speed of the line, in baud."""
    onset: Byte | None = 1
    """The byte at each onset, 1 to 255; null sends none."""
    answer: Byte | None = 2
    """The byte at each answer, 1 to 255; null sends none."""
    pulse_ms: PulseMs | None = None
    """Milliseconds after which the byte 0 follows each mark; null sends no 0."""
    trial_byte: bool = False
    """Whether a second byte follows each mark: how many trials were recorded before it, 0 to 255 and from 0 again."""

    @property
    def with_trial_byte(self) -> bool:
        """Whether the number of the trial follows each code."""
        return self.trial_byte


class ParallelMarksSpec(_Coded):
    """Marks on the eight data pins of a parallel port of Linux."""

    kind: Literal["parallel"]
    """A parallel port of Linux."""
    port: str = Field(default="/dev/parport0", min_length=1)
    """The port, such as /dev/parport0."""
    onset: Byte | None = 1
    """The value of the pins at each onset, 1 to 255; null sends none."""
    answer: Byte | None = 2
    """The value of the pins at each answer, 1 to 255; null sends none."""
    pulse_ms: PulseMs = 5.0
    """Milliseconds after which the pins go back to 0."""


MarksSpec: TypeAlias = LslMarksSpec | SerialMarksSpec | ParallelMarksSpec
_Entry: TypeAlias = Annotated[MarksSpec, Discriminator("kind")]


def _shape(value: Any) -> str:
    return "several" if isinstance(value, list | tuple) else "one"


TimingMarksSpec: TypeAlias = Annotated[
    Annotated[_Entry, Tag("one")] | Annotated[list[_Entry], Tag("several"), Field(min_length=1)], Discriminator(_shape)
]


def listed_twice(marks: Sequence[MarksSpec]) -> Iterator[int]:
    """Yield which of ``marks``, counted from 0, go where one before them goes."""
    names = [spec.name for spec in marks]
    yield from (index for index, name in enumerate(names) if name in names[:index])


def listed_marks(spec: TimingMarksSpec | None) -> tuple[MarksSpec, ...]:
    """Return a rig's ``timing_marks`` as a tuple, whether they are one mapping or a list; empty if there are none."""
    if spec is None:
        return ()
    return tuple(spec) if isinstance(spec, list) else (spec,)
