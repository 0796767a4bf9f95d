"""An instrument described by its line protocol, in a data file: what is sent, how the answer reads, what it may say.

A file says how the line is set (``line``), the pattern of an answer that tells a fault (``fault``, with a group
``code``) and what each code means (``faults``), and the steps that ``begin`` and ``read``: what each sends, and the
pattern that its whole answer must match. Named groups of ``begin`` are the instrument's ``model`` and ``number``, those
of ``read`` its reading: ``X``, ``Y``, ``Z``, or ``Y`` with the chromaticities ``x`` and ``y``. What matches neither
pattern is no answer: it never becomes a reading.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from devices.readings.instrument import (
    GarbledError,
    InstrumentError,
    Line,
    LostError,
    PatchOnScreen,
    RangeError,
    Reading,
)
from documents import FileModel, Finding, load_document

_ENDS = MappingProxyType({"cr": b"\r", "lf": b"\n", "crlf": b"\r\n"})
_THEN: Mapping[str, type[InstrumentError]] = MappingProxyType(
    {"range": RangeError, "again": GarbledError, "lost": LostError}
)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_LIGHT = ({"X", "Y", "Z"}, {"Y", "x", "y"})
_NAMES = {"model", "number"}


def _pattern(text: str) -> str:
    try:
        re.compile(text)
    except re.error as error:
        raise ValueError(f"it is no pattern: {error}") from None
    return text


def _with_code(text: str) -> str:
    if set(re.compile(text).groupindex) != {"code"}:
        raise ValueError("it has no group (?P<code>...), which says which fault it is")
    return text


Pattern = Annotated[str, AfterValidator(_pattern)]


class ProtocolStep(FileModel):
    """What is sent, and how its answer reads."""

    send: Annotated[str, Field(min_length=1, pattern=r"^[ -~]+$")] | None = None
    """The command, without its end; left out where another answer comes by itself."""
    answer: Pattern
    """The pattern that the whole answer matches, without the spaces around it."""
    wait: Literal["answer", "measurement"] = "answer"
    """Whether the answer comes at once, or when the measurement is done."""


class DeviceFault(FileModel):
    """What a fault means, and what is done then."""

    says: Annotated[str, Field(min_length=1)]
    """What the instrument says, in words."""
    then: Literal["range", "again", "lost"] = "lost"
    """``range``: this patch cannot be read, others can; ``again``: asking again may help; ``lost``: nothing helps."""


class LineSettings(FileModel):
    """How the line is set: 8 data bits, no parity, 1 stop bit."""

    baud_rate: Annotated[int, Field(ge=50, le=12_000_000)]
    end: Literal["cr", "lf", "crlf"]
    """What ends a command; an answer ends with any of them."""
    hardware_handshake: bool = False
    slowly: bool = False
    """Whether commands are sent a character at a time."""


class LineProtocol(FileModel):
    """The file of an instrument."""

    schema_version: Literal[1]
    name: Annotated[str, Field(min_length=1)]
    """The instrument, as logs and reports name it."""
    source: Annotated[str, Field(min_length=1)]
    """Where its commands are described."""
    line: LineSettings
    fault: Annotated[Pattern, AfterValidator(_with_code)]
    faults: dict[str, DeviceFault]
    begin: tuple[ProtocolStep, ...] = ()
    read: Annotated[tuple[ProtocolStep, ...], Field(min_length=1)]
    finish: str | None = None
    """The command that gives the instrument back to the hands on its keys."""
    cd_m2_per_unit: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    """What one unit of its X, Y and Z is in cd/m²: 3.4262591 for foot-lamberts."""

    def opened(self, port: str) -> Line:
        """Return the serial line on a port, set as the file says. Raises LostError."""
        from devices.readings.serial_line import SerialLine

        how = self.line
        handshake = how.hardware_handshake
        return SerialLine(port, how.baud_rate, _ENDS[how.end], hardware_handshake=handshake, slowly=how.slowly)


def read_protocol(file: str | Path) -> LineProtocol:
    """Read the file of an instrument with a line protocol.

    Raises
    ------
    InputError
        If a key or pattern is wrong, or the readings' groups are neither X, Y, Z nor Y, x, y.
    """
    protocol, source = load_document(Path(file), LineProtocol)
    groups = [set(re.compile(step.answer).groupindex) for step in protocol.read]
    given = set().union(*groups)
    if given not in _LIGHT or sum(map(len, groups)) != len(given):
        what = f"the answers give {', '.join(sorted(given)) or 'nothing'}, not X, Y, Z, nor Y, x, y, each once"
        raise InstrumentError(source.finding(("read",), what, "name them as groups: (?P<X>...)"))
    if unknown := set().union(*(re.compile(step.answer).groupindex for step in protocol.begin)) - _NAMES:
        what = f"the answers give {', '.join(sorted(unknown))}; of the beginning only model and number are taken"
        raise InstrumentError(source.finding(("begin",), what, None))
    return protocol


class LineInstrument:
    """An instrument on a ``line`` that speaks a ``protocol``.

    ``answer_s`` is how long to wait for an answer, ``measure_s`` for a measurement. It must be set to the 2° observer.

    Raises
    ------
    InstrumentError
        If nothing answers there as the protocol says.
    """

    def __init__(self, protocol: LineProtocol, line: Line, answer_s: float = 10.0, measure_s: float = 300.0) -> None:
        self._protocol, self._line = protocol, line
        self._within_s = {"answer": answer_s, "measurement": measure_s}
        try:
            said = self._said(protocol.begin)
        except BaseException:
            self._line.close()
            raise
        self.name = " ".join(filter(None, (protocol.name, said.get("model"), said.get("number"))))

    def read(self, showing: PatchOnScreen) -> Reading:
        """Measure, and return XYZ."""
        said = self._said(self._protocol.read)
        for group, text in said.items():
            if not _NUMBER.fullmatch(text.strip()):
                raise self._garbled(f"'{text}' for {group}")
        light = {group: float(text) for group, text in said.items()}
        if {"x", "y"} <= set(light):
            x, y, Y = light["x"], light["y"], light["Y"]
            if not (0 < y <= 1 and 0 <= x <= 1 and x + y <= 1):
                raise self._garbled(f"the chromaticities {x:g}, {y:g}")
            light = {"X": x * Y / y, "Y": Y, "Z": (1 - x - y) * Y / y}
        X, Y, Z = (light[group] * self._protocol.cd_m2_per_unit for group in "XYZ")
        if not math.isfinite(X + Y + Z):
            raise self._garbled("a number that is not finite")
        return Reading((X, Y, Z))

    def close(self) -> None:
        """End the remote mode and close the port."""
        with suppress(InstrumentError):
            if self._protocol.finish is not None:
                self._line.send(self._protocol.finish)
        self._line.close()

    def _said(self, steps: tuple[ProtocolStep, ...]) -> dict[str, str]:
        """Go through steps, and return what their answers' groups hold."""
        said: dict[str, str] = {}
        for step in steps:
            if step.send is not None:
                self._line.send(step.send)
            answer = self._line.line(self._within_s[step.wait])
            if fault := re.fullmatch(self._protocol.fault, answer):
                raise self._told(fault["code"], step)
            match = re.fullmatch(step.answer, answer)
            if match is None:
                raise self._garbled(f"'{answer[:60]}'" + (f" to {step.send}" if step.send else ""))
            said |= {group: text or "" for group, text in match.groupdict().items()}
        return said

    def _told(self, code: str, step: ProtocolStep) -> InstrumentError:
        fault = self._protocol.faults.get(code)
        if fault is None:
            return self._garbled(f"the code {code}, which its protocol does not have")
        what = f"the {self._protocol.name} says {code}: {fault.says}" + (f" ({step.send})" if step.send else "")
        return _THEN[fault.then](Finding(what, self._line.port))

    def _garbled(self, answer: str) -> GarbledError:
        return GarbledError(Finding(f"the {self._protocol.name} answers {answer}", self._line.port))
