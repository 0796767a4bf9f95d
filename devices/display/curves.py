"""The curve of a display's channel, from device code to linear light and back: what a display file writes of one.

The GOGO family is y = max(0, gain·x + offset)^gamma + lift, with x the device code in 0..1 and y the share of the
channel's full light (Day, Taplin & Berns 2004; thesis Section 3.2.2). GOG has lift 0, GGO offset 0, and the simple
gamma gain 1, offset 0, lift 0. sRGB (IEC 61966-2-1) has a straight start, then a power of 2.4 [IEC1999].

A table is light measured at chosen codes, joined by a monotone cubic: that of Fritsch & Carlson 1980 (SciPy's
PchipInterpolator) runs through the square roots of the light, which a display's curve makes nearly straight; its square
is the light. It rises everywhere where the table does, so that it can be undone.

The fragment shader undoes a table piece by piece. Between two entries, √light is a cubic of the code. Scaled to 0..1 on
either side, it is v = ((a·u + b)·u + c)·u, which Newton's method between brackets undoes in 32 bits. Which v it is, is
found in 64 bits (or two floats): a curve may be so flat that 32 bits of its light are a hundredth of a code. The one
table that serves the other curves errs there by whole codes, as below a CRT's cut-off or where a signal is clipped.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, ValidationError, model_validator

from devices.colour import srgb_decoded, srgb_encoded
from devices.errors import DeviceError
from documents.arrays import Floats, Floats32
from documents.yaml import FileModel, Number, Positive

ENTRIES = 1024
_BT1886_GAMMA = 2.4
_MOST_LIGHT = 100  # as a power of ten; beyond it squares of light overflow
# Newton's method kept between brackets ends far sooner; as many halvings alone come to less than a rounding error.
_MOST_STEPS = 60
# Of a piece: √light where it begins in two parts, its rise, the code where it begins; a, b, c, and the code's rise.
NUMBERS = 8
MOST_STEPS = 24
_BEYOND = 2.0


class Curve(FileModel):
    """One channel's curve, from device code to light, rising from code 0 to code 1."""

    kind_of_curve: ClassVar[str] = ""
    """The kind by which display files write curves like it; empty where none does."""

    @abstractmethod
    def linear(self, code: ArrayLike) -> Floats:
        """Return linear light (share of full) for device codes in 0..1, of any shape."""

    @abstractmethod
    def unclipped_code(self, light_above_lift: ArrayLike) -> Floats:
        """Return device codes for light above ``lift``, at or above 0, also where no code of 0..1 gives it."""

    if TYPE_CHECKING:

        @property
        def lift(self) -> float:
            """Light that is there whatever the code; a field of some curves."""

    def code(self, linear: ArrayLike) -> Floats:
        """Return device codes in 0..1 for linear light of any shape; what lies beyond is clipped."""
        light = np.maximum(np.asarray(linear, dtype=np.float64) - self.lift, 0.0)
        return np.clip(self.unclipped_code(light), 0.0, 1.0)

    def shader_codes(self, light: Floats, entries: int) -> Floats:
        """Return codes in 0..1 for linear light (n,) as the shader looks them up, in a table of so many ``entries``."""
        share = (light - self.lift) / (1.0 - self.lift)
        return looked_up_codes(share, curve_table(self, entries).astype(np.float32))

    @property
    def decides(self) -> Any:
        """What decides its light, as plain JSON: fields of ours; of others, their light."""
        if type(self).__module__ == __name__:
            return self.model_dump()
        return [float(f"{light:.10g}") for light in self.linear(np.linspace(0.0, 1.0, 257)).tolist()]

    def _fill(self, **values: object) -> None:
        """Take ``values`` as a file's would be; DeviceError if they make no curve."""
        try:
            super().__init__(**values)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            where = " ".join(map(str, first["loc"]))
            words = first["msg"].removeprefix("Value error, ")
            raise DeviceError(f"{where} of a curve: {words}" if where else words) from None

    def __eq__(self, other: object) -> bool:
        """Whether it is the same curve, whatever either has computed of it so far."""
        return type(self) is type(other) and all(
            getattr(self, name) == getattr(other, name) for name in type(self).model_fields
        )

    @property
    def tabled(self) -> bool:
        """Whether the shader undoes it piece by piece, by `knot_tables`."""
        return self.kind_of_curve == "table"

    @property
    def numbers(self) -> Mapping[str, float]:
        """The numbers that a fit estimates: gain, offset and gamma of the GOGO family, none of others."""
        return {}

    def normalised(self) -> Self:
        """Return the curve of the same shape that gives light 0 at code 0 and 1 at code 1."""
        return self

    def icc_function(self, lift: float, full: float) -> list[float] | None:
        """Return g, a, b, c, d, e, f of ICC's function 4, of the curve with ``lift`` above it as a share of ``full``.

        None where it is no such function.
        """
        return None

    def pieces(self) -> Floats:
        """Return what `knot_tables` holds of the curve, shape (pieces, 8): none but of a table."""
        return np.zeros((0, NUMBERS))


class ToneCurve(Curve):
    """One channel's curve: linear = max(0, gain · code + offset) ^ gamma + lift, code in 0..1.

    ``gain``, ``offset`` and ``lift`` are shares of full drive or full light. Raises DeviceError if the curve does not
    rise with the code (gain or gamma not above 0) or holds a number that is not finite.
    """

    kind_of_curve = "gogo"
    gain: Positive = 1.0
    """The gain a of (a · code + b) ^ gamma + c."""
    offset: Number = 0.0
    """The offset b of (a · code + b) ^ gamma + c."""
    gamma: Positive
    """The exponent of the curve."""
    lift: Number = 0.0
    """The lift c of (a · code + b) ^ gamma + c."""

    def __init__(self, gain: float = 1.0, offset: float = 0.0, gamma: float = 1.0, lift: float = 0.0) -> None:
        self._fill(gain=gain, offset=offset, gamma=gamma, lift=lift)

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # a file's faults keep their places

    @model_validator(mode="after")
    def _gives_light(self) -> Self:
        if self.gain + self.offset <= 0:
            raise ValueError(f"a tone curve must give light at full drive; gain + offset is not above 0 in {self!r}")
        if self.gamma * np.log10(self.gain + self.offset) > _MOST_LIGHT:
            raise ValueError(f"a tone curve must give finite light; (gain + offset) ^ gamma is not in {self!r}")
        return self

    @property
    def numbers(self) -> Mapping[str, float]:
        """Gain, offset and gamma."""
        return {"gain": self.gain, "offset": self.offset, "gamma": self.gamma}

    def linear(self, code: ArrayLike) -> Floats:
        """Return linear light (share of full) for device codes in 0..1, of any shape."""
        drive = self.gain * np.asarray(code, dtype=np.float64) + self.offset
        return np.asarray(np.maximum(drive, 0.0) ** self.gamma + self.lift)

    def unclipped_code(self, light_above_lift: ArrayLike) -> Floats:
        """Return device codes for light above ``lift``, at or above 0, also where no code of 0..1 gives it."""
        light = np.asarray(light_above_lift, dtype=np.float64)
        return np.asarray((light ** (1.0 / self.gamma) - self.offset) / self.gain)

    def normalised(self) -> Self:
        """Return the curve of the same shape that gives light 0 at code 0 and 1 at code 1: (y − y₀) / (y₁ − y₀)."""
        lowest, highest = (float(self.linear(code)) for code in (0.0, 1.0))
        span = highest - lowest
        scale = span ** (-1.0 / self.gamma)
        return type(self)(self.gain * scale, self.offset * scale, self.gamma, (self.lift - lowest) / span)

    def icc_function(self, lift: float, full: float) -> list[float]:
        """Return the function 4. Function 2 would do, but LittleCMS gives 0 in place of the lift where it begins."""
        root = full ** (-1.0 / self.gamma)
        least = max((self.lift + lift) / full, 0.0)
        begins = max(-self.offset / self.gain, 0.0)
        return [self.gamma, self.gain * root, self.offset * root, 0.0, begins, least, least]


class SrgbCurve(Curve):
    """One channel's curve as sRGB has it; the display's black is a term of its own."""

    kind_of_curve = "srgb"

    @property
    def lift(self) -> float:
        """Light at code 0: none, because a display's black is a term of its own."""
        return 0.0

    def linear(self, code: ArrayLike) -> Floats:
        """Return linear light (share of full) for device codes in 0..1, of any shape."""
        return srgb_decoded(code)

    def code(self, linear: ArrayLike) -> Floats:
        """Return device codes in 0..1 for linear light of any shape; light beyond 0..1 is clipped."""
        return srgb_encoded(np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0))

    def unclipped_code(self, light_above_lift: ArrayLike) -> Floats:
        """Return device codes for light of any shape, at or above 0."""
        return srgb_encoded(light_above_lift)

    def icc_function(self, lift: float, full: float) -> list[float]:
        """Return the function 4 of sRGB's curve with ``lift`` above it, as a share of ``full``."""
        root = full ** (-1.0 / 2.4)
        return [2.4, root / 1.055, 0.055 * root / 1.055, 1.0 / (12.92 * full), 0.04045, lift / full, lift / full]


class TableCurve(Curve):
    """One channel's curve as a table: the share of full light at each code; both rise from 0 to 1.

    Raises DeviceError unless both rise from 0 to 1 from entry to entry, and hold the same number of entries, 3 or more.
    """

    kind_of_curve = "table"
    codes: Annotated[tuple[Number, ...], Field(min_length=3)]
    """Device codes from 0 to 1, rising."""
    light: Annotated[tuple[Number, ...], Field(min_length=3)]
    """The share of full light at each code."""

    def __init__(self, codes: ArrayLike, light: ArrayLike) -> None:
        self._fill(codes=np.asarray(codes).tolist(), light=np.asarray(light).tolist())

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # a file's faults keep their places

    @model_validator(mode="after")
    def _rises(self) -> Self:
        codes, light = np.array(self.codes), np.array(self.light)
        if codes.shape != light.shape:
            raise ValueError(f"a table needs as much light as codes, 3 or more; it has {light.size} and {codes.size}")
        for what, values in (("codes", codes), ("light", light)):
            if values[0] != 0 or values[-1] != 1 or np.any(np.diff(values) <= 0):
                raise ValueError(f"a table's {what} must rise from 0 to 1 from entry to entry")
        if np.any(np.diff(np.sqrt(light)) < 1e-9) or np.any(np.diff(codes) < 1e-9):
            raise ValueError("two entries of a table are too nearly alike")
        return self

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

    def shader_codes(self, light: Floats, entries: int) -> Floats:
        """Return codes in 0..1 for linear light (n,) as the shader finds them: from the pieces of the table."""
        return np.clip(knot_codes(light, knot_tables([self])[0]).astype(np.float64), 0.0, 1.0)

    def pieces(self) -> Floats:
        """Return what `knot_tables` holds of the curve, shape (pieces, 8)."""
        cubic = np.asarray(self.cubics[1])
        codes, roots = np.asarray(self.codes), np.sqrt(self.light)
        width, rise = np.diff(codes), np.diff(roots)
        scaled = [cubic[power] * width ** (3 - power) / rise for power in range(3)]
        high = roots[:-1].astype(np.float32).astype(np.float64)
        return np.stack([high, roots[:-1] - high, rise, codes[:-1], *scaled, width], axis=1)


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


def curve_table(curve: Curve, entries: int = ENTRIES, root: int = 4) -> Floats:
    """Return unclipped codes (entries,) of ``curve`` over t in 0..1 with t the ``root``-th root of its light.

    Parameters
    ----------
    curve
        The tone curve of a channel.
    entries
        The number of entries, at least 2.
    root
        Which root of light the table is even in, at least 1; 1 is light itself.

    Returns
    -------
    ndarray
        Device codes, shape (entries,), not clipped to 0..1, for light above the lift from none to full.

    Examples
    --------
    >>> from devices.display import ToneCurve
    >>> curve_table(ToneCurve(1.0, 0.0, 2.0), 3, root=2).round(3).tolist()
    [0.0, 0.5, 1.0]
    """
    light = np.linspace(0.0, 1.0, entries) ** root * (1.0 - curve.lift)
    return curve.unclipped_code(light)


def looked_up_codes(light: Floats, codes: Floats32) -> Floats:
    """Return codes in 0..1 of one channel, any shape, for its light above the lift (share of full) by its table."""
    last = len(codes) - 1
    place = np.sqrt(np.sqrt(np.maximum(light, 0.0))) * last
    return np.asarray(np.clip(np.interp(place, np.arange(last + 1), codes.astype(np.float64)), 0.0, 1.0))


def knot_tables(curves: Sequence[Curve]) -> Floats32:
    """Return the pieces of ``curves``, shape (curves, pieces of the longest, 8); shorter ones end in pieces at 2.

    Parameters
    ----------
    curves
        Tone curves, at least one of them a table; another has no pieces.

    Returns
    -------
    ndarray
        Shape (curves, pieces, 8): of a piece √light and the code in 0..1 where it begins, its cubic, and its rises.

    Examples
    --------
    >>> curve = TableCurve((0.0, 0.5, 1.0), (0.0, 0.2, 1.0))
    >>> knot_tables([curve, curve]).shape[::2]
    (2, 8)
    """
    of_curves = [curve.pieces() for curve in curves]
    tables = np.zeros((len(of_curves), max(len(pieces) for pieces in of_curves), NUMBERS))
    tables[:, :, 0] = _BEYOND
    tables[:, :, 2] = 1.0
    for row, pieces in enumerate(of_curves):
        tables[row, : len(pieces)] = pieces
    return tables.astype(np.float32)


def knot_codes(light: Floats, table: Floats32) -> Floats32:
    """Return codes (n,) for light (n,) by ``table`` (pieces, 8): the NumPy twin of ``knots.glsl``."""
    root = np.sqrt(light)
    begins = table[:, :2].astype(np.float64).sum(axis=1)
    place = np.clip(np.searchsorted(begins, root, side="right") - 1, 0, len(table) - 1)
    piece = table[place]
    wanted = np.clip((root - begins[place]) / piece[:, 2], 0.0, 1.0).astype(np.float32)
    a, b, c = piece[:, 4], piece[:, 5], piece[:, 6]
    low, high, u = np.zeros_like(wanted), np.ones_like(wanted), wanted.copy()
    for _ in range(MOST_STEPS):
        value, slope = ((a * u + b) * u + c) * u, (3 * a * u + 2 * b) * u + c
        low, high = np.where(value > wanted, low, u), np.where(value > wanted, u, high)
        step = np.divide(value - wanted, slope, out=np.full_like(u, np.inf), where=slope > 0)
        new = u - step
        u = np.where((new >= low) & (new <= high), new, np.float32(0.5) * (low + high))
    return np.asarray(piece[:, 3] + piece[:, 7] * u)
