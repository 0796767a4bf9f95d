"""A tone curve as a table: light measured at chosen codes, joined by a monotone cubic.

The cubic of Fritsch & Carlson 1980 (SciPy's PchipInterpolator) runs through the square roots of the light, which a
display's curve makes nearly straight; its square is the light. It rises everywhere where the table does, so that it
can be undone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from devices.errors import DeviceError
from documents.arrays import Floats

# Newton's method kept between brackets ends far sooner; as many halvings alone come to less than a rounding error.
_MOST_STEPS = 60


@dataclass(frozen=True)
class TableCurve:
    """One channel's curve through ``light`` (shares of full light, 0 first and 1 last) at ``codes`` (0 to 1).

    Raises DeviceError unless both rise from 0 to 1 from entry to entry, and hold the same number of entries, 3 or more.
    """

    codes: tuple[float, ...]
    light: tuple[float, ...]

    def __post_init__(self) -> None:
        codes, light = np.asarray(self.codes, dtype=np.float64), np.asarray(self.light, dtype=np.float64)
        if codes.ndim != 1 or codes.shape != light.shape or len(codes) < 3:
            raise DeviceError(f"a table needs as much light as codes, 3 or more; it has {light.size} and {codes.size}")
        for what, values in (("codes", codes), ("light", light)):
            if not np.all(np.isfinite(values)) or values[0] != 0 or values[-1] != 1 or np.any(np.diff(values) <= 0):
                raise DeviceError(f"a table's {what} must rise from 0 to 1 from entry to entry")
        if np.any(np.diff(np.sqrt(light)) < 1e-9) or np.any(np.diff(codes) < 1e-9):
            raise DeviceError("two entries of a table are too nearly alike")
        object.__setattr__(self, "codes", tuple(codes.tolist()))
        object.__setattr__(self, "light", tuple(light.tolist()))

    @property
    def lift(self) -> float:
        """Light at code 0: none, because a display's black is a term of its own."""
        return 0.0

    @cached_property
    def cubics(self) -> tuple[Floats, Floats]:
        """The breaks (k + 1,) and coefficients (4, k), highest power first, of √light."""
        return monotone_cubics(np.asarray(self.codes), np.sqrt(self.light))

    def root(self, code: ArrayLike) -> tuple[Floats, Floats]:
        """Return √light and its slope for device codes of any shape; codes beyond 0..1 are taken as 0 or 1."""
        breaks, c = self.cubics
        codes = np.clip(np.asarray(code, dtype=np.float64), 0.0, 1.0)
        piece = np.clip(np.searchsorted(breaks, codes, side="right") - 1, 0, len(breaks) - 2)
        x = codes - breaks[piece]
        value = ((c[0, piece] * x + c[1, piece]) * x + c[2, piece]) * x + c[3, piece]
        slope = (3.0 * c[0, piece] * x + 2.0 * c[1, piece]) * x + c[2, piece]
        return value, slope

    def linear(self, code: ArrayLike) -> Floats:
        """Return linear light (share of full), in 0..1, for device codes of any shape; codes are clipped to 0..1."""
        return np.asarray(np.minimum(self.root(code)[0] ** 2, 1.0))

    def code(self, linear: ArrayLike) -> Floats:
        """Return device codes in 0..1 for linear light of any shape; what lies beyond the table is clipped."""
        breaks, _ = self.cubics
        wanted = np.sqrt(np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0))
        knots = np.sqrt(self.light)
        piece = np.clip(np.searchsorted(knots, wanted, side="right") - 1, 0, len(breaks) - 2)
        low, high = breaks[piece], breaks[piece + 1]
        x = low + (wanted - knots[piece]) / (knots[piece + 1] - knots[piece]) * (high - low)
        for _ in range(_MOST_STEPS):
            value, slope = self.root(x)
            over = value > wanted
            low, high = np.where(over, low, x), np.where(over, x, high)
            step = np.divide(value - wanted, slope, out=np.full_like(x, np.inf), where=slope > 0)
            new = x - step
            new = np.where((new >= low) & (new <= high), new, 0.5 * (low + high))
            moved = np.max(np.abs(new - x), initial=0.0)
            x = new
            if moved < 1e-15:
                break
        return np.asarray(x)

    def unclipped_code(self, light_above_lift: ArrayLike) -> Floats:
        """Return what `code` returns: a table says nothing of codes beyond its ends."""
        return self.code(light_above_lift)


def monotone_cubics(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the breaks (k + 1,) and coefficients (4, k), highest power first, of Fritsch and Carlson's cubics.

    ``x`` and ``y`` (k + 1,) rise from entry to entry, and there are 3 or more. Slopes at the breaks are weighted
    harmonic means of those of the pieces beside them, at the ends of three points [Moler2004], as
    SciPy's `PchipInterpolator` has them, the twin in the tests.
    """
    gap, rise = np.diff(x), np.diff(y) / np.diff(x)
    slope = np.empty(len(x))
    first, second = 2.0 * gap[1:] + gap[:-1], gap[1:] + 2.0 * gap[:-1]
    slope[1:-1] = (first + second) / (first / rise[:-1] + second / rise[1:])
    for end, (h, beside) in ((0, (gap[:2], rise[:2])), (-1, (gap[:-3:-1], rise[:-3:-1]))):
        outer = ((2.0 * h[0] + h[1]) * beside[0] - h[0] * beside[1]) / (h[0] + h[1])
        slope[end] = max(outer, 0.0)  # where all rise, the other limit, three times the piece's, is never reached
    third = (slope[:-1] + slope[1:] - 2.0 * rise) / gap
    return x, np.stack([third / gap, (rise - slope[:-1]) / gap - third, slope[:-1], y[:-1]])
