"""Konica Minolta CS-2000 and CS-2000A, by their remote commands over USB or RS-232C.

``RMTS,1`` takes the instrument over, ``MEAS,1`` measures: it is answered at once with the seconds that it will take,
and by a second ``OK00`` when done; ``MEDR,1,0,n`` gives the spectral radiance of 380..780 nm at 1 nm in four blocks and
``MEDR,2,0,00`` the colorimetric values Le, Lv, X, Y, Z, ... Every answer begins with an error check code.

Source: Konica Minolta, CS-2000/CS-2000A communication specifications [KonicaMinoltaCS2000].
"""

from __future__ import annotations

import math
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

BAUD_RATE = 115200
_MODELS = MappingProxyType({"1": "CS-2000", "2": "CS-2000A"})
_FAULTS = MappingProxyType(
    {
        "ER00": "it does not know the command",
        "ER02": "the measurement failed",
        "ER05": "it has no user calibration",
        "ER10": "the light is above its measuring range, or flickers",
        "ER17": "it does not take the parameters",
        "ER20": "it has no data",
        "ER51": "its cooling is out of order (CCD Peltier)",
        "ER52": "its temperature is out of order",
        "ER71": "the light's frequency is outside the synchronisation range",
        "ER81": "its shutter is out of order",
        "ER82": "its internal ND filter is out of order",
        "ER83": "its measuring angle is between two settings",
        "ER99": "its program is out of order",
    }
)
_OUT_OF_RANGE = ("ER10", "ER71")
_AGAIN = ("ER02", "ER20")
_BLOCKS = (100, 100, 100, 101)
_WAVELENGTHS_NM = tuple(float(nm) for nm in range(380, 781))
# It looks at the light before it says how long it will take: so many times as long as another answer.
_PREMEASURES = 3.0
# Lv and Y are the same number, printed to four or more digits.
_LV_AGREES = 2e-3


class CS2000:
    """The instrument on ``port``. ``answer_s`` is how long to wait for an answer, ``measure_s`` for a measurement.
    ``line`` is spoken through in place of the port's own.

    It must be set to the 2° observer and to the synchronisation that suits the display.

    Raises
    ------
    InstrumentError
        If nothing answers there as a CS-2000 does.
    """

    spectral = True

    def __init__(self, port: str, answer_s: float = 10.0, measure_s: float = 300.0, line: Line | None = None) -> None:
        self._line = line or SerialLine(port, BAUD_RATE, b"\n", hardware_handshake=True)
        self._answer_s = answer_s
        self._measure_s = measure_s
        try:
            self._ask("RMTS,1")
            identity = self._ask("IDDR")
            if len(identity) < 3:
                raise self._garbled("IDDR", ",".join(identity))
        except BaseException:
            self._line.close()
            raise
        product, variation, number = identity[:3]
        self.name = f"Konica Minolta {_MODELS.get(variation.lstrip('0'), product)} {number}"

    def read(self, showing: PatchOnScreen) -> Reading:
        """Measure, and return XYZ and the spectral radiance."""
        answer = self._ask("MEAS,1", _PREMEASURES * self._answer_s)
        try:
            takes_s = float(answer[0])
        except (IndexError, ValueError):
            raise self._garbled("MEAS,1", ",".join(answer)) from None
        if not 0 <= takes_s <= self._measure_s:
            raise self._garbled("MEAS,1", answer[0])
        self._checked("MEAS,1", self._line.line(takes_s + self._answer_s))
        spectrum: list[float] = []
        for block, count in enumerate(_BLOCKS, start=1):
            spectrum += self._numbers(f"MEDR,1,0,{block}", count)
        colour = self._numbers("MEDR,2,0,00", 5, at_least=True)
        luminance, X, Y, Z = colour[1:5]
        if not math.isclose(luminance, Y, rel_tol=_LV_AGREES, abs_tol=1e-4):
            raise self._garbled("MEDR,2,0,00", f"Lv {luminance:g} and Y {Y:g}")
        return Reading((X, Y, Z), tuple(spectrum), _WAVELENGTHS_NM)

    def close(self) -> None:
        """End the remote mode and close the port."""
        with suppress(InstrumentError):
            self._line.send("RMTS,0")
        self._line.close()

    def _ask(self, command: str, within_s: float | None = None) -> list[str]:
        self._line.send(command)
        return self._checked(command, self._line.line(self._answer_s if within_s is None else within_s))

    def _checked(self, command: str, answer: str) -> list[str]:
        code, *fields = [field.strip() for field in answer.split(",")]
        if code == "OK00":
            return fields
        if code not in _FAULTS:
            raise self._garbled(command, answer)
        kind = RangeError if code in _OUT_OF_RANGE else GarbledError if code in _AGAIN else LostError
        raise kind(Finding(f"the CS-2000 says {code}: {_FAULTS[code]} ({command})", self._line.port))

    def _numbers(self, command: str, count: int, *, at_least: bool = False) -> list[float]:
        fields = self._ask(command)
        try:
            numbers = [float(field) for field in (fields[:count] if at_least else fields)]
        except ValueError:
            raise self._garbled(command, ",".join(fields)) from None
        if len(numbers) != count:
            raise self._garbled(command, f"{len(fields)} numbers in place of {count}")
        return numbers

    def _garbled(self, command: str, answer: str) -> GarbledError:
        return GarbledError(Finding(f"the CS-2000 answers {command} with '{answer[:60]}'", self._line.port))
