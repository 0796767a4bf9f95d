"""What a measurement needs of an instrument: a reading of the patch that is on the screen now.

What can go wrong with an instrument, by what can be done about it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from devices.errors import DeviceError
from devices.readings.patch import Patch

Triple = tuple[float, float, float]


class InstrumentError(DeviceError):
    """An instrument did not do as asked."""


class RangeError(InstrumentError):
    """This patch is too bright, too dark or too unsteady to be read; others may be read."""


class GarbledError(InstrumentError):
    """What came is no answer; asking again may help."""


class TimedOutError(GarbledError):
    """No answer came in time; asking again may help."""


class LostError(InstrumentError):
    """The instrument is gone, or will not work: nothing can be read any more."""


@dataclass(frozen=True, slots=True)
class PatchOnScreen:
    """What stands on the screen: the patch's ``label`` and ``codes`` in 0..1, its place in the order, and since when.

    ``time_s`` counts from the beginning of the measurement. ``other`` are the codes of the eye that is not read, and
    ``patch`` says how the instrument stands; both may be unknown. ``place`` is where on the panel it points, across and
    down, as shares of it. Only those look at it that ask a person or simulate.
    """

    label: str
    codes: Triple
    position: int
    time_s: float = 0.0
    other: Triple | None = None
    patch: Patch | None = None
    place: tuple[float, float] = (0.5, 0.5)


@dataclass(frozen=True, slots=True)
class Reading:
    """``XYZ_cd_m2``: CIE 1931 2°, Y in cd/m²; where the instrument gives it, the spectral radiance besides.

    ``spectrum`` is in W/(sr m² nm) at ``wavelengths_nm``; both are empty where there is none. Raises GarbledError if a
    number is not finite.
    """

    XYZ_cd_m2: Triple
    spectrum: tuple[float, ...] = ()
    wavelengths_nm: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.XYZ_cd_m2, *self.spectrum, *self.wavelengths_nm))):
            raise GarbledError("the reading holds a number that is not finite")
        if len(self.spectrum) != len(self.wavelengths_nm):
            raise GarbledError(f"{len(self.spectrum)} spectral values came for {len(self.wavelengths_nm)} wavelengths")


class Instrument(Protocol):
    """Reads light. ``name`` says which instrument it is, as it names itself."""

    @property
    def name(self) -> str:
        """What to record of it."""

    def read(self, showing: PatchOnScreen) -> Reading:
        """Measure what is shown now and return it; it may take minutes.

        Raises
        ------
        InstrumentError
            As `devices.readings.instrument` has them.
        """

    def close(self) -> None:
        """Give the instrument back to the hands on its keys; never raises."""


class Line(Protocol):
    """What a driver speaks through: a command out, lines in; `devices.readings.serial_line.SerialLine` is one."""

    @property
    def port(self) -> str:
        """What messages name."""

    def send(self, command: str) -> None:
        """Forget what came unasked, and send ``command``. Raises LostError."""

    def line(self, within_s: float) -> str:
        """Return the next line that is not empty. Raises TimedOutError or LostError."""

    def close(self) -> None:
        """Close it; never raises."""
