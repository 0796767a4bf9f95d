"""Tone curves of a display channel: the GOGO family, from device code to linear light and back.

y = max(0, gain·x + offset)^gamma + lift, with x the device code in 0..1 and y the share of the channel's
full light (Day, Taplin & Berns 2004; thesis Section 3.2.2). GOG has lift 0, GGO offset 0, and the simple
gamma gain 1, offset 0, lift 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from devices.display.srgb_curve import SrgbCurve
from devices.display.table_curve import TableCurve
from devices.errors import DeviceError
from documents.arrays import Floats

_BT1886_GAMMA = 2.4
_MOST_LIGHT = 100  # as a power of ten; beyond it squares of light overflow


@dataclass(frozen=True, slots=True)
class ToneCurve:
    """One channel's curve. ``gain``, ``offset`` and ``lift`` are shares of full drive or full light.

    Raises DeviceError if the curve does not rise with the code (gain or gamma not above 0) or holds a
    number that is not finite.
    """

    gain: float = 1.0
    offset: float = 0.0
    gamma: float = 1.0
    lift: float = 0.0

    def __post_init__(self) -> None:
        numbers = (self.gain, self.offset, self.gamma, self.lift)
        if not np.all(np.isfinite(numbers)) or self.gain <= 0 or self.gamma <= 0:
            raise DeviceError(f"a tone curve needs finite numbers and a gain and gamma above 0, not {self}")
        if self.gain + self.offset <= 0:
            raise DeviceError(f"a tone curve must give light at full drive; gain + offset is not above 0 in {self}")
        if self.gamma * np.log10(self.gain + self.offset) > _MOST_LIGHT:
            raise DeviceError(f"a tone curve must give finite light; (gain + offset) ^ gamma is not in {self}")

    def linear(self, code: ArrayLike) -> Floats:
        """Return linear light (share of full) for device codes in 0..1, of any shape."""
        drive = self.gain * np.asarray(code, dtype=np.float64) + self.offset
        return np.asarray(np.maximum(drive, 0.0) ** self.gamma + self.lift)

    def code(self, linear: ArrayLike) -> Floats:
        """Return device codes in 0..1 for linear light of any shape; what lies beyond the drive is clipped."""
        light = np.maximum(np.asarray(linear, dtype=np.float64) - self.lift, 0.0)
        return np.clip((light ** (1.0 / self.gamma) - self.offset) / self.gain, 0.0, 1.0)

    def unclipped_code(self, light_above_lift: ArrayLike) -> Floats:
        """Return device codes for light above ``lift``, at or above 0, also where no code of 0..1 gives it."""
        light = np.asarray(light_above_lift, dtype=np.float64)
        return np.asarray((light ** (1.0 / self.gamma) - self.offset) / self.gain)

    def normalised(self) -> ToneCurve:
        """Return the curve of the same shape that gives light 0 at code 0 and 1 at code 1: (y − y₀) / (y₁ − y₀)."""
        lowest, highest = (float(self.linear(code)) for code in (0.0, 1.0))
        span = highest - lowest
        scale = span ** (-1.0 / self.gamma)
        return ToneCurve(self.gain * scale, self.offset * scale, self.gamma, (self.lift - lowest) / span)


def bt1886_curve(white_cd_m2: float, black_cd_m2: float) -> ToneCurve:
    """Return the curve of ITU-R BT.1886 for a panel's white and black, without its black: light 0 at code 0.

    BT.1886 gives L = a·(V + b)^2.4 from black to white. Light above black, as a share of white above black, is of the
    GOGO family: (L − black) / (white − black).

    Parameters
    ----------
    white_cd_m2, black_cd_m2
        Luminances of the panel at code 1 and at code 0, black from 0 and below white.

    Returns
    -------
    ToneCurve
        A curve from 0 at code 0 to 1 at code 1 [BT1886].

    Raises
    ------
    DeviceError
        If black is below 0, or white not above it.

    Examples
    --------
    >>> curve = bt1886_curve(100.0, 0.1)
    >>> (0.1 + 99.9 * curve.linear([0.0, 0.5, 1.0])).round(3).tolist()
    [0.1, 21.605, 100.0]
    """
    if not (np.isfinite(white_cd_m2) and 0.0 <= black_cd_m2 < white_cd_m2):
        raise DeviceError(
            f"BT.1886 needs a black from 0 cd/m² and a white above it, not {black_cd_m2:g} and {white_cd_m2:g}"
        )
    span = (white_cd_m2 - black_cd_m2) ** (1.0 / _BT1886_GAMMA)
    dark = black_cd_m2 ** (1.0 / _BT1886_GAMMA)
    gain, offset = (white_cd_m2 ** (1.0 / _BT1886_GAMMA) - dark) / span, dark / span
    return ToneCurve(gain, offset, _BT1886_GAMMA, -black_cd_m2 / (white_cd_m2 - black_cd_m2))


# What a display model asks of a channel's curve: `lift`, `linear`, `code` and `unclipped_code`.
Curve = ToneCurve | TableCurve | SrgbCurve
