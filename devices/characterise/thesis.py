"""The thesis's two methods, channel by channel, with tables in the shape of its Tables 3.3 to 3.6.

Method 1 fits each of X, Y and Z of a channel shown alone straight to its code, and the code to each. Method 2 first
turns every reading into linear light through the inverse of the primary matrix (Expressions 3.9 to 3.11), and then fits
each channel's light to its code and back (Expressions 3.4 to 3.7 and 3.14), over "each channel's data": the ramp of
that channel alone, black included. Mixtures stay out. A channel with an offset gives light at code 0 too, which the
columns of the other primaries carry; in the others' ramps and in greys it is subtracted in part, so that a fit to all
readings misses the curve. The captions of Tables 3.5 and 3.6 are swapped in print; here code to light is the forward
curve, with Table 3.6's numbers.

Light is in parts of the primaries: with the matrix of the readings themselves it is 1 at the channel's highest code,
and the curve (gain·code + offset)^gamma of a display whose light is there L comes back as gain/L^(1/gamma),
offset/L^(1/gamma) and gamma, with primaries L times as bright: the same light.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.characterise.channel_fit import COEFFICIENTS, KINDS, ChannelFit, Kind, fit_channels
from devices.characterise.patches import primaries_at_full
from devices.display import DisplayModel, ToneCurve
from devices.errors import DeviceError
from documents.arrays import Floats

COLOURS = ("red", "green", "blue")
# Table 3.6, gains for codes in 0..1.
THESIS_CURVES = ((0.9690, 0.0218, 1.8132), (1.0455, 0.0, 1.7649), (0.9945, 0.0, 1.7156))


@dataclass(frozen=True, slots=True)
class DirectRow:
    """One row of Tables 3.3 or 3.4: a channel's fits of X, Y and Z, each as a share of ``largest_XYZ_cd_m2``.

    A coordinate in which the channel gives no light has no fit, and NaN for its coefficient of determination.
    """

    kind: Kind
    channel: str
    fits: tuple[ChannelFit | None, ChannelFit | None, ChannelFit | None]
    largest_XYZ_cd_m2: tuple[float, float, float]

    @property
    def r2_XYZ(self) -> tuple[float, float, float]:
        """R² of X, Y and Z."""
        x, y, z = (float("nan") if fit is None else fit.r2 for fit in self.fits)
        return x, y, z

    @property
    def average(self) -> float:
        """The mean over X, Y and Z."""
        return float(np.mean(self.r2_XYZ))


@dataclass(frozen=True, slots=True)
class ThesisFits:
    """Both methods. ``forward`` and ``inverse``: the fits of method 2, by model, for red, green and blue."""

    XYZ_from_code: tuple[DirectRow, ...]
    code_from_XYZ: tuple[DirectRow, ...]
    primaries_XYZ_cd_m2: Floats
    forward: dict[Kind, tuple[ChannelFit, ChannelFit, ChannelFit]]
    inverse: dict[Kind, tuple[ChannelFit, ChannelFit, ChannelFit]]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "method_1_XYZ_from_code_r2": [_row(row) for row in self.XYZ_from_code],
            "method_1_code_from_XYZ_r2": [_row(row) for row in self.code_from_XYZ],
            "method_2_primaries_XYZ_cd_m2": self.primaries_XYZ_cd_m2.tolist(),
            "method_2_light_from_code": {kind: _fits(fits) for kind, fits in self.forward.items()},
            "method_2_code_from_light": {kind: _fits(fits) for kind, fits in self.inverse.items()},
        }


def thesis_fits(codes: Floats, XYZ: Floats, primaries_XYZ_cd_m2: Floats | None = None) -> ThesisFits:
    """Fit both methods to ``codes`` (n, 3) in 0..1 and ``XYZ`` (n, 3).

    ``primaries_XYZ_cd_m2`` (3, 3) is the matrix of method 2; None takes each channel alone at its highest code
    (Expression 3.10). No black is subtracted, as in the thesis.

    Raises
    ------
    DeviceError
        If a channel was not measured alone at enough codes, or the matrix cannot be inverted.
    """
    M = primaries_at_full(codes, XYZ, np.zeros(3)) if primaries_XYZ_cd_m2 is None else primaries_XYZ_cd_m2
    if not M.any(axis=0).all() or np.linalg.cond(M) > 1e6:
        raise DeviceError("the thesis's methods need each channel measured alone, and primaries that differ")
    light = XYZ @ np.linalg.inv(M).T
    ramps = [(codes[rows, channel], light[rows, channel]) for channel, rows in enumerate(_alone(codes))]
    forward = {kind: _three(ramps, kind, inverse=False) for kind in KINDS}
    inverse = {kind: _three(ramps, kind, inverse=True) for kind in KINDS}
    rows = {way: _direct(codes, XYZ, way) for way in (False, True)}
    return ThesisFits(rows[False], rows[True], M, forward, inverse)


def _alone(codes: Floats) -> list[NDArray[np.bool_]]:
    """Return, for each channel, which readings (n,) are of it alone or of black.

    Raises
    ------
    DeviceError
        If a channel was measured alone at too few codes for the curve with the most coefficients.
    """
    out = []
    for channel, colour in enumerate(COLOURS):
        rows = np.all(np.delete(codes, channel, axis=1) == 0, axis=1)
        different = len(np.unique(codes[rows, channel]))
        if different <= len(COEFFICIENTS):
            raise DeviceError(
                f"the thesis's methods need {colour} alone at {len(COEFFICIENTS) + 1} codes or more, black among them; "
                f"there are {different}"
            )
        out.append(rows)
    return out


def _three(
    ramps: list[tuple[Floats, Floats]], kind: Kind, *, inverse: bool
) -> tuple[ChannelFit, ChannelFit, ChannelFit]:
    red, green, blue = fit_channels(ramps, kind, inverse=inverse)
    return red, green, blue


def _direct(codes: Floats, XYZ: Floats, inverse: bool) -> tuple[DirectRow, ...]:
    """Return the rows of Table 3.3 or, ``inverse``, 3.4: each channel's X, Y and Z, as shares of their largest."""
    pairs: dict[tuple[int, int], tuple[Floats, Floats]] = {}
    largest = []
    for channel, alone in enumerate(_alone(codes)):
        most = XYZ[alone].max(axis=0)
        largest.append(most)
        for axis in range(3):
            if most[axis] > 0:
                pairs[channel, axis] = codes[alone, channel], XYZ[alone, axis] / most[axis]
    out = []
    for kind in KINDS:
        fits = dict(zip(pairs, fit_channels(list(pairs.values()), kind, inverse=inverse), strict=True))
        for channel, colour in enumerate(COLOURS):
            x, y, z = largest[channel].tolist()
            three = (fits.get((channel, 0)), fits.get((channel, 1)), fits.get((channel, 2)))
            out.append(DirectRow(kind, colour, three, (x, y, z)))
    return tuple(out)


def _row(row: DirectRow) -> dict[str, Any]:
    r2 = {axis: None if np.isnan(value) else value for axis, value in zip("XYZ", row.r2_XYZ, strict=True)}
    average = row.average
    return {
        "model": row.kind,
        "channel": row.channel,
        **r2,
        "average": None if np.isnan(average) else average,
        "largest_XYZ_cd_m2": list(row.largest_XYZ_cd_m2),
        "fits": {axis: fit and _fit(fit) for axis, fit in zip("XYZ", row.fits, strict=True)},
    }


def _fits(fits: tuple[ChannelFit, ChannelFit, ChannelFit]) -> dict[str, Any]:
    return {colour: _fit(fit) for colour, fit in zip(COLOURS, fits, strict=True)}


def _fit(fit: ChannelFit) -> dict[str, Any]:
    return {
        **dict(zip(COEFFICIENTS, fit.coefficients.tolist(), strict=True)),
        "standard_errors": dict(zip(COEFFICIENTS, fit.standard_errors.tolist(), strict=True)),
        "r2": fit.r2,
        "condition": fit.condition if np.isfinite(fit.condition) else None,
        "at_bound": fit.at_bound,
    }


def thesis_display() -> DisplayModel:
    """Return the display of thesis Expression 3.12 and Table 3.6.

    Returns
    -------
    DisplayModel
        The model: GOG curves, primaries in cd/m², and no black.

    Examples
    --------
    >>> thesis_display().primaries_XYZ_cd_m2[1].tolist()
    [5.62, 18.65, 2.2]
    """
    red, green, blue = (ToneCurve(*curve) for curve in THESIS_CURVES)
    matrix = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
    return DisplayModel(np.zeros(3), matrix, (red, green, blue))


def table_c1_codes() -> Floats:
    """Return the codes (120, 3), in 0..1, of the thesis's Table C.1, in its order.

    Returns
    -------
    ndarray
        Device codes of red, green and blue, shape (120, 3), in 0..1: black, ramps of each channel, pairs of channels,
        and greys.

    Examples
    --------
    >>> (255.0 * table_c1_codes()).round().tolist()[:3]
    [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [20.0, 0.0, 0.0]]
    """
    levels = [*range(10, 251, 10), 255]
    rows = [[0, 0, 0]]
    for channel in range(3):
        rows += [[level if c == channel else 0 for c in range(3)] for level in levels]
    for pair in ((0, 1), (1, 2), (0, 2)):
        rows += [[level if c in pair else 0 for c in range(3)] for level in (50, 100, 150, 200, 255)]
    rows += [[level] * 3 for level in levels]
    return np.array(rows, dtype=np.float64) / 255.0
