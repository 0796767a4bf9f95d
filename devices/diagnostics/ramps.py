"""The ramps, black and primaries in a set of readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.diagnostics.tags import plain, tag
from devices.measurements import Measurements

Floats = NDArray[np.float64]

CHANNELS = ("red", "green", "blue")
# Codes nearer than this are one code: a step of 12 bits is forty times larger.
SAME_DIGITS = 6
# Light below this share of the channel's (or white's) full light has no chromaticity worth judging.
FLOOR_SHARE = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Ramp:
    """Readings along one direction from black: ``levels``, shape (k,), rising, in 0..1, and their XYZ, (k, 3)."""

    levels: Floats
    XYZ: Floats

    def __len__(self) -> int:
        return len(self.levels)


def by_code(measurements: Measurements) -> dict[tuple[float, ...], list[int]]:
    """Return the numbers of the plain readings of each code, in the order in which they were read."""
    found: dict[tuple[float, ...], list[int]] = {}
    for row, code in enumerate(np.round(measurements.codes, SAME_DIGITS)):
        if tag(measurements.name[row]) is None:
            found.setdefault(tuple(float(value) for value in code), []).append(row)
    return found


def means(measurements: Measurements) -> tuple[Floats, Floats]:
    """Return each code once, shape (k, 3), and the mean XYZ of its plain readings, shape (k, 3)."""
    groups = by_code(measurements)
    codes = measurements.codes[[rows[0] for rows in groups.values()]].reshape(-1, 3)
    light = np.array([measurements.XYZ[rows].mean(axis=0) for rows in groups.values()]).reshape(-1, 3)
    return codes, light


def black(measurements: Measurements) -> Floats | None:
    """Return the mean XYZ (3,) at code 0, None if it was not read."""
    at_zero = np.all(plain(measurements).codes == 0, axis=1)
    return np.asarray(plain(measurements).XYZ[at_zero].mean(axis=0)) if at_zero.any() else None


def black_or_none(measurements: Measurements) -> tuple[Floats, str]:
    """Return black's XYZ (3,), zeros where it was not read, and then a sentence that says so."""
    found = black(measurements)
    return (np.zeros(3), " Black was not read and is taken for none.") if found is None else (found, "")


def ramp(measurements: Measurements, channels: Sequence[int]) -> Ramp:
    """Return the readings in which ``channels`` are equal and the others 0, without black."""
    codes, light = means(measurements)
    others = [channel for channel in range(3) if channel not in channels]
    level = codes[:, channels[0]]
    along = np.all(codes[:, list(channels)] == level[:, None], axis=1) & np.all(codes[:, others] == 0, axis=1)
    rows = np.flatnonzero(along & (level > 0))
    rows = rows[np.argsort(level[rows])]
    return Ramp(level[rows], light[rows])


def channel_ramps(measurements: Measurements) -> dict[str, Ramp]:
    """Return the ramps of red, green and blue, without black; those not read are empty."""
    return {name: ramp(measurements, [channel]) for channel, name in enumerate(CHANNELS)}


def grey_ramp(measurements: Measurements) -> Ramp:
    """Return the greys, without black."""
    return ramp(measurements, [0, 1, 2])


def primaries(measurements: Measurements) -> tuple[Floats | None, str]:
    """Return the primaries' XYZ minus black as columns (3, 3), or None and why they are not known."""
    dark, _ = black_or_none(measurements)
    columns = []
    for name, found in channel_ramps(measurements).items():
        if not len(found) or found.levels[-1] < 1:
            return None, f"{name} at full drive was not read"
        columns.append(found.XYZ[-1] - dark)
    matrix = np.array(columns).T
    return matrix, ""


def uv(xyz: ArrayLike) -> Floats:
    """Return u′v′ of CIE 1976, shape (..., 2), for XYZ, shape (..., 3); NaN where there is no light."""
    x, y, z = np.moveaxis(np.asarray(xyz, dtype=np.float64), -1, 0)
    total = x + 15 * y + 3 * z
    safe = np.where(total > 0, total, np.nan)
    return np.stack([4 * x / safe, 9 * y / safe], axis=-1)


def xy(xyz: ArrayLike) -> Floats:
    """Return x, y of CIE 1931, shape (..., 2), for XYZ, shape (..., 3); NaN where there is no light."""
    light = np.asarray(xyz, dtype=np.float64)
    total = light.sum(axis=-1, keepdims=True)
    return np.asarray(light[..., :2] / np.where(total > 0, total, np.nan))


def brightest(measurements: Measurements) -> float:
    """Return the largest luminance of all plain readings, in cd/m²; 0 where there is none."""
    light = plain(measurements).XYZ[:, 1]
    return float(light.max()) if len(light) else 0.0
