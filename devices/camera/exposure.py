"""How long, how wide and how sensitive: a camera's exposure, and how much light one exposure takes beside another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from devices.errors import DeviceError
from documents import Finding
from documents.text import JsonResult

# Two exposures that differ by less count as the same: metadata round 1/3 s to 0.333.
SAME = 2e-3
# Beyond these no camera is, and numbers overflow.
_LEAST, _MOST = 1e-12, 1e12


@dataclass(frozen=True, slots=True)
class Exposure(JsonResult):
    """``time_s`` in seconds, ``f_number`` (8 for f/8) and ``iso``; DeviceError unless all are 1e-12..1e12."""

    time_s: float
    f_number: float
    iso: float = 100.0
    json_also: ClassVar = ("ev",)

    def __post_init__(self) -> None:
        for name, value in (("time_s", self.time_s), ("f_number", self.f_number), ("iso", self.iso)):
            if isinstance(value, bool) or not (math.isfinite(value) and value > 0):
                raise DeviceError(Finding(f"'{name}' of an exposure is {value!r}", remedy="give a number above 0"))
            if not _LEAST <= value <= _MOST:
                remedy = f"{_LEAST:g} to {_MOST:g} is what exposures can be"
                raise DeviceError(Finding(f"'{name}' of an exposure is {float(value):g}", remedy=remedy))

    @property
    def ev(self) -> float:
        """Exposure value log2(N² / t), thesis Expression 4.9; the ISO is no part of it, as in the thesis."""
        return math.log2(self.f_number**2 / self.time_s)

    @property
    def light(self) -> float:
        """Sensor signal for a given luminance, t · ISO / N², in units of no meaning but beside each other."""
        return self.time_s * self.iso / self.f_number**2

    def relative_to(self, other: Exposure) -> float:
        """Return how many times the signal of ``other`` the same luminance gives at this exposure."""
        return self.light / other.light

    def same_signal(self, other: Exposure) -> bool:
        """Return whether the same luminance gives the same signal at both, within what metadata round."""
        return abs(self.relative_to(other) - 1.0) <= SAME

    @property
    def time_text(self) -> str:
        """The time in seconds as cameras show it: 1.3 or 1/15."""
        return f"{self.time_s:.3g}" if self.time_s >= 0.3 else f"1/{1.0 / self.time_s:.4g}"

    def __str__(self) -> str:
        return f"{self.time_text} s, f/{self.f_number:g}, ISO {self.iso:g}"


def parse_exposure(text: str) -> Exposure:
    """Return the exposure written as ``time_s,f_number,iso``, such as ``1/15,8,800``; ISO 100 where it is left out.

    Parameters
    ----------
    text
        Seconds, f-number and ISO with commas between. Seconds are written ``1/15`` or ``1.3``, the f-number ``8`` or
        ``f/8``.

    Returns
    -------
    Exposure
        The exposure: time in seconds, f-number and ISO.

    Raises
    ------
    DeviceError
        If the text is anything else.

    Examples
    --------
    >>> str(parse_exposure("1/15,8,800"))
    '1/15 s, f/8, ISO 800'
    >>> parse_exposure("0.5,f/11")
    Exposure(time_s=0.5, f_number=11.0, iso=100.0)
    """
    parts = text.split(",")
    try:
        if len(parts) not in (2, 3):
            raise ValueError(text)
        numbers = [parse_seconds(parts[0]), float(parts[1].strip().lower().removeprefix("f/")), 100.0]
        if len(parts) == 3:
            numbers[2] = float(parts[2])
    except ValueError:
        raise DeviceError(
            Finding(f"the exposure is '{text}'", remedy="write seconds, f-number and ISO, such as 1/15,8,800")
        ) from None
    return Exposure(*numbers)


def parse_seconds(text: str) -> float:
    """Return a shutter speed as it stands on a camera, ``1/15``, ``1/2.5`` or ``1.3``, in seconds; else ValueError."""
    above, slash, below = text.strip().partition("/")
    if not slash:
        return float(above)
    if float(below) == 0:
        raise ValueError(text)
    return float(above) / float(below)
