"""Photo Research PR-655 and PR-670, by their remote commands.

``PHOTO`` takes the instrument over and is answered ``REMOTE MODE``; a command ends in a carriage return and is sent a
character at a time. ``M0`` measures; ``D2`` then gives status, units, X, Y, Z, and ``D5`` the spectral radiance, a line
of wavelength and value each; ``SU1`` asks for metric units and ``D120`` returns the number of points and their range.

Source: Photo Research, SpectraScan PR-655/PR-670 user manual [PhotoResearchPR655].
"""

from __future__ import annotations

import itertools
import re
from contextlib import suppress
from types import MappingProxyType

from devices.readings import (
    GarbledError,
    InstrumentError,
    Line,
    LostError,
    PatchOnScreen,
    RangeError,
    Reading,
    SerialLine,
)
from documents import Finding

BAUD_RATE = 9600
_FAULTS = MappingProxyType(
    {
        -1: "the light is not steady",
        -2: "the light is too bright",
        -3: "it cannot follow the light's frequency",
        -4: "its adaptive mode failed",
        -8: "the light is too weak",
        -9: "it lost the light's frequency",
        -10: "it cannot find the light's frequency",
        -12: "the light is not steady: its adaptive mode took too long",
        -1000: "it does not know the command",
    }
)
_STATUS = re.compile(r"^\s*([+-]?\d{1,5})(?:,(.*))?$")
_POINT = re.compile(r"^\s*(\d{3,4}(?:\.\d*)?)\s*,\s*([+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)\s*$")
_METRIC = 1
_FEWEST_POINTS, _MOST_POINTS = 31, 2001


class PhotoResearch:
    """The instrument on ``port``. ``answer_s`` is how long to wait for an answer, ``measure_s`` for a measurement.
    ``line`` is spoken through in place of the port's own.

    It must be set to the 2° observer.

    Raises
    ------
    InstrumentError
        If nothing answers there as a PR-655 or PR-670 does.
    """

    spectral = True

    def __init__(self, port: str, answer_s: float = 10.0, measure_s: float = 300.0, line: Line | None = None) -> None:
        self._line = line or SerialLine(port, BAUD_RATE, b"\r", slowly=True)
        self._answer_s = answer_s
        self._measure_s = measure_s
        try:
            self._line.send("PHOTO")
            answer = self._line.line(answer_s)
            if "REMOTE MODE" not in answer.upper():
                raise self._garbled("PHOTO", answer)
            self._ask("SU1", answer_s)
            model, number = (self._ask(command, answer_s) for command in ("D111", "D110"))
            self._points = self._how_many()
        except BaseException:
            self._line.close()
            raise
        self.name = f"Photo Research {model} {number}".strip()

    def read(self, showing: PatchOnScreen) -> Reading:
        """Measure, and return XYZ and the spectral radiance."""
        self._ask("M0", self._measure_s)
        units, *colour = self._ask("D2", self._answer_s).split(",")
        try:
            metric = int(units) == _METRIC
            X, Y, Z = map(float, colour)
        except ValueError:
            raise self._garbled("D2", ",".join((units, *colour))) from None
        if not metric:
            remedy = "set it to metric units"
            raise LostError(
                Finding(f"the instrument measures in units of code {units}", self._line.port, None, None, remedy)
            )
        self._ask("D5", self._answer_s)
        points: list[tuple[float, float]] = []
        lines = 0
        while len(points) < self._points:
            line = self._line.line(self._answer_s)
            lines += 1
            match = _POINT.match(line)
            if match:
                points.append((float(match[1]), float(match[2])))
            elif lines > 2 or points:  # the header may take two lines
                raise self._garbled("D5", line)
        wavelengths, spectrum = zip(*points, strict=True)
        if any(after <= before for before, after in itertools.pairwise(wavelengths)):
            raise self._garbled("D5", "wavelengths out of order")
        return Reading((X, Y, Z), spectrum, wavelengths)

    def close(self) -> None:
        """End the remote mode and close the port."""
        with suppress(InstrumentError):
            self._line.send("Q")
        self._line.close()

    def _how_many(self) -> int:
        fields = self._ask("D120", self._answer_s).split(",")
        try:
            points = int(fields[0])
        except ValueError:
            points = 0
        if not _FEWEST_POINTS <= points <= _MOST_POINTS:
            raise self._garbled("D120", ",".join(fields))
        return points

    def _ask(self, command: str, within_s: float) -> str:
        """Send ``command`` and return what follows the status in the first line of its answer."""
        self._line.send(command)
        answer = self._line.line(within_s)
        match = _STATUS.match(answer)
        if not match:
            raise self._garbled(command, answer)
        status = int(match[1])
        if status == 0:
            return (match[2] or "").strip()
        why = _FAULTS.get(status, "see its manual for the code")
        kind = RangeError if -12 <= status < 0 else LostError
        raise kind(Finding(f"the instrument says {status}: {why} ({command})", self._line.port))

    def _garbled(self, command: str, answer: str) -> GarbledError:
        return GarbledError(Finding(f"the instrument answers {command} with '{answer[:60]}'", self._line.port))
