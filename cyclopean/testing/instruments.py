"""The promises of every instrument on a line, tried on one: whatever comes is a reading, or a clear error."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path

from cyclopean.testing.promises import kept
from devices.readings import (
    Instrument,
    InstrumentError,
    Line,
    LineInstrument,
    LostError,
    PatchOnScreen,
    Reading,
    TimedOutError,
    read_protocol,
)

_SHOWING = PatchOnScreen("white", (1.0, 1.0, 1.0), 0)
_PORT = "a scripted line"
_NUMBER = re.compile(r"\d+\.\d+(?:[eE][+-]?\d+)?")


def prove_instrument(
    instrument: str | Path | Callable[[Line], Instrument],
    answers: Sequence[str],
    XYZ_cd_m2: tuple[float, float, float],
    faults: Mapping[str, type[InstrumentError]] | None = None,
) -> tuple[str, ...]:
    """Prove that an instrument on a line never gives a wrong reading.

    It is opened and read once on a line that gives ``answers``, and again on lines that give them otherwise: silent
    from any place on, with an answer left out, doubled or noise, with a number that is none, with each line that tells
    a fault, and pulled out at any place. Each is an InstrumentError, the right one, or the same
    reading; a line is closed where it cannot be opened, and closing never raises.

    Parameters
    ----------
    instrument
        The file of a line protocol, or what opens the instrument on a `Line`.
    answers
        The lines that it gives when it is opened and then read once.
    XYZ_cd_m2
        What it then reads.
    faults
        Lines that tell a fault, and the error that each is: ``{"ER10": RangeError}``.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If the file is no protocol.
    """
    if isinstance(instrument, str | Path):
        instrument = partial(LineInstrument, read_protocol(instrument))
    tried = _Tried(instrument, list(answers), XYZ_cd_m2, faults or {})
    return kept(
        {
            "what it answers is the reading": tried.right,
            "silence is an error": tried.silent,
            "what is no answer is never another reading": tried.garbled,
            "a fault is told as what it is": tried.faulty,
            "an instrument that is gone is lost": tried.pulled,
        }
    )


class _Unasked(str):
    """A line that came with the one before it: what is sent next forgets it, as a serial line does."""


@dataclass(slots=True)
class _Line:
    """Gives lines in the order told, whatever is sent; silent at their end, or ``gone``."""

    left: deque[str]
    gone: bool = False
    port: str = _PORT
    closed: bool = field(default=False, init=False)

    def send(self, command: str) -> None:
        while self.left and isinstance(self.left[0], _Unasked):
            self.left.popleft()
        if self.gone and not self.left:
            raise LostError(f"{_PORT}: it is gone")

    def line(self, within_s: float) -> str:
        if self.left:
            return self.left.popleft()
        raise (LostError if self.gone else TimedOutError)(f"{_PORT}: nothing comes")

    def close(self) -> None:
        self.closed = True


@dataclass(frozen=True, slots=True)
class _Tried:
    """An instrument, what it answers, and what it then reads; each attempt returns what broke."""

    opens: Callable[[Line], Instrument]
    answers: list[str]
    XYZ_cd_m2: tuple[float, float, float]
    faults: Mapping[str, type[InstrumentError]]

    def _read(self, answers: Sequence[str], *, gone: bool = False) -> Reading | InstrumentError:
        line = _Line(deque(answers), gone)
        try:
            instrument = self.opens(line)
        except InstrumentError as error:
            if not line.closed:
                raise ValueError("it leaves its line open where it cannot be opened") from error
            return error
        try:
            return instrument.read(_SHOWING)
        except InstrumentError as error:
            return error
        finally:
            instrument.close()

    def right(self) -> str | None:
        read = self._read(self.answers)
        if isinstance(read, InstrumentError):
            return str(read)
        near = all(
            abs(got - said) <= 1e-6 * abs(said) for got, said in zip(read.XYZ_cd_m2, self.XYZ_cd_m2, strict=True)
        )
        return None if near else f"{read.XYZ_cd_m2} in place of {self.XYZ_cd_m2}"

    def silent(self) -> str | None:
        for place in range(len(self.answers)):
            if not isinstance(self._read(self.answers[:place]), TimedOutError):
                return f"after {place} of {len(self.answers)} answers it waits for no more"
        return None

    def garbled(self) -> str | None:
        whole = self._read(self.answers)
        for answers in self._spoilt():
            read = self._read(answers)
            if not isinstance(read, InstrumentError) and read != whole:
                return f"{answers} is read as {read.XYZ_cd_m2}"
        return None

    def _spoilt(self) -> Iterator[list[str]]:
        """Yield the answers with one of them left out, doubled, or exchanged for what is none."""
        for place, answer in enumerate(self.answers):
            before, after = self.answers[:place], self.answers[place + 1 :]
            others = ["", "\x00\xff?", answer + answer, "?" + answer]
            for number in islice(_NUMBER.finditer(answer), 5):
                for wrong in ("", "nan", "inf", "1e999", "-", "1.2.3", "0x10"):
                    others.append(answer[: number.start()] + wrong + answer[number.end() :])
            yield [*before, *after]
            yield [*before, answer, _Unasked(answer), *after]
            yield from ([*before, other, *after] for other in others if other != answer)

    def faulty(self) -> str | None:
        for answer, kind in self.faults.items():
            for place in range(len(self.answers)):
                read = self._read([*self.answers[:place], answer])
                if type(read) is not kind:
                    return f"'{answer}' in place of answer {place + 1} is {type(read).__name__}, not {kind.__name__}"
        return None

    def pulled(self) -> str | None:
        for place in range(len(self.answers)):
            if not isinstance(self._read(self.answers[:place], gone=True), LostError):
                return f"after {place} answers it goes on"
        return None
