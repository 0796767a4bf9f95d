"""What is in a set of readings: what the names mean, the ramps, black and the primaries.

A name may say after its ``@`` where on the panel, from what angle, or beside what the patch was read:
``gray120@r1c3`` was read in row 1, column 3 of a grid over the panel; ``white@30deg`` and ``white@v-20deg`` from 30° to
the right and 20° below; ``gray120@on-white`` as a patch on a white screen; ``black@other=red`` while the other eye's
picture was red; ``gray120@warm-up`` while the display warmed up, ``gray120@warm-up-r2c1`` at a
place of the screen meanwhile; ``white@no-glasses`` without the glasses;
``black@screen-off`` with the display switched off;
``grey120@cable`` to show what codes pass on their way to the light. ``#2`` and so on behind a name counts its showings.
Every other name is a plain reading: full screen, at the centre, straight ahead, through the glasses, once the display
is warm. A reading whose patch did not fill the picture (`Measurements.area`) is plain only where all without a tag
filled the same part of it, on one surround.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.readings import Measurements
from documents.arrays import Floats

Kind = Literal["place", "angle", "surround", "other", "warm-up", "no-glasses", "cable", "screen-off"]
_PATTERNS: tuple[tuple[Kind, re.Pattern[str]], ...] = (
    ("place", re.compile(r"r([1-9]\d?)c([1-9]\d?)", re.IGNORECASE)),
    ("angle", re.compile(r"([hv]?)([+-]?\d+(?:\.\d+)?)(?:deg|°)", re.IGNORECASE)),
    ("surround", re.compile(r"on[- ](.+)", re.IGNORECASE)),
    ("other", re.compile(r"other=(.+)", re.IGNORECASE)),
    ("warm-up", re.compile(r"warm-?up(?:[- ]r([1-9]\d?)c([1-9]\d?))?", re.IGNORECASE)),
    ("cable", re.compile(r"cable[- ]?(.*)", re.IGNORECASE)),
    ("screen-off", re.compile(r"(?:screen|display)[- ]off", re.IGNORECASE)),
    ("no-glasses", re.compile(r"(?:no|without)[- ]glasses", re.IGNORECASE)),
)


@dataclass(frozen=True, slots=True)
class PatchTag:
    """The name before the ``@``, what kind of reading it is, and the words that belong to its kind, in lower case."""

    base: str
    kind: Kind
    parts: tuple[str, ...]


def patch_name(name: str) -> str:
    """Return a reading's name without the count of its showings."""
    return re.sub(r"#\d+$", "", name.strip())


@lru_cache(maxsize=4096)
def tag(name: str) -> PatchTag | None:
    """Return the tag in ``name``, None for a plain reading."""
    base, at, words = patch_name(name).rpartition("@")
    if at:
        for kind, pattern in _PATTERNS:
            if match := pattern.fullmatch(words.strip()):
                return PatchTag(base.strip().lower(), kind, tuple(part.strip().lower() for part in match.groups("")))
    return None


def plain(measurements: Measurements) -> Measurements:
    """Return the readings that fill the screen and were read at its centre, straight ahead.

    Parameters
    ----------
    measurements
        Readings, special ones among them (a name with a tag, such as ``white@30deg``).

    Returns
    -------
    Measurements
        The readings that `is_plain` names, in their order.

    Examples
    --------
    >>> table = Measurements([[1, 1, 1], [1, 1, 1]], [[95, 100, 108], [80, 85, 90]], ("white", "white@30deg"))
    >>> plain(table).name
    ('white',)
    """
    return measurements.select(is_plain(measurements))


def is_plain(measurements: Measurements) -> NDArray[np.bool_]:
    """Return which readings are plain, shape (n,): no tag in the name, and a patch that filled the picture.

    Where all patches without a tag filled one share of the picture, with one surround, these are the plain ones: the
    display was measured so throughout.
    """
    untagged_names = np.array([tag(name) is None for name in measurements.name], dtype=bool)
    if part_of_picture(measurements.select(untagged_names)) is not None:
        return untagged_names
    return np.asarray(untagged_names & (measurements.filled == 1.0))


def part_of_picture(measurements: Measurements) -> tuple[float, Floats] | None:
    """Return the share of the picture that all patches filled, below 1, and the codes around them, (3,), in 0..1.

    None where they filled it, or parts of it that differ.
    """
    if not len(measurements) or measurements.area is None or measurements.area.max() == 1.0:
        return None
    parts = np.column_stack([measurements.filled, measurements.around])
    return None if np.any(np.ptp(parts, axis=0) > 1e-9) else (float(measurements.filled[0]), measurements.around[0])


def tagged(measurements: Measurements, kind: Kind) -> list[tuple[int, PatchTag]]:
    """Return the numbers of the readings of ``kind`` and the tags of their names."""
    tags = [(row, tag(name)) for row, name in enumerate(measurements.name)]
    return [(row, own) for row, own in tags if own is not None and own.kind == kind]


def untagged(measurements: Measurements, kind: Kind) -> Measurements:
    """Return the readings of ``kind`` alone, by the names that stand before their tags."""
    rows = tagged(measurements, kind)
    return replace(measurements.select([row for row, _ in rows]), name=tuple(own.base for _, own in rows))


def cable_colours(measurements: Measurements) -> Measurements:
    """Return the colours of the set ``cable`` in the middle of a black screen, as plain readings of a display."""
    rows = [row for row, own in tagged(measurements, "cable") if not own.parts[0]]
    found = replace(measurements.select(rows), area=None, surround=None)
    return replace(found, name=tuple(own.base for own in map(tag, found.name) if own is not None))


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
    rows: dict[tuple[float, ...], list[int]] = {}
    counted = is_plain(measurements)
    for row, code in enumerate(np.round(measurements.codes, SAME_DIGITS)):
        if counted[row]:
            rows.setdefault(tuple(float(value) for value in code), []).append(row)
    return rows


def means(measurements: Measurements) -> tuple[Floats, Floats]:
    """Return each code once, shape (k, 3), and the mean XYZ of its plain readings, shape (k, 3)."""
    counted = np.flatnonzero(is_plain(measurements))
    codes, light = measurements.codes[counted], measurements.XYZ[counted]
    _, first, group = np.unique(np.round(codes, SAME_DIGITS), axis=0, return_index=True, return_inverse=True)
    # Codes stand in the order in which they were read first, and their light is added in that of the readings.
    order = np.argsort(first)
    group = np.argsort(order)[group.reshape(-1)]
    sums = np.zeros((len(first), 3))
    np.add.at(sums, group, light)
    return codes[first[order]], sums / np.bincount(group, minlength=len(first))[:, None]


def black(measurements: Measurements) -> Floats | None:
    """Return the mean XYZ (3,) at code 0, None if it was not read."""
    at_zero = np.all(plain(measurements).codes == 0, axis=1)
    return np.asarray(plain(measurements).XYZ[at_zero].mean(axis=0)) if at_zero.any() else None


def black_or_none(measurements: Measurements) -> tuple[Floats, str]:
    """Return black's XYZ (3,), zeros where it was not read, and then a sentence that says so."""
    level = black(measurements)
    return (np.zeros(3), " Black was not read and is taken for none.") if level is None else (level, "")


def ramp(measurements: Measurements, channels: Sequence[int]) -> Ramp:
    """Return the readings in which ``channels`` are equal and the others 0, without black."""
    return _ramp_of(*means(measurements), channels)


def _ramp_of(codes: Floats, light: Floats, channels: Sequence[int]) -> Ramp:
    """Return the ramp among codes, each once, and their light, both (k, 3)."""
    others = [channel for channel in range(3) if channel not in channels]
    level = codes[:, channels[0]]
    along = np.all(codes[:, list(channels)] == level[:, None], axis=1) & np.all(codes[:, others] == 0, axis=1)
    rows = np.flatnonzero(along & (level > 0))
    rows = rows[np.argsort(level[rows])]
    return Ramp(level[rows], light[rows])


def channel_ramps(measurements: Measurements) -> dict[str, Ramp]:
    """Return the ramps of red, green and blue, without black; those not read are empty."""
    codes, light = means(measurements)
    return {name: _ramp_of(codes, light, [channel]) for channel, name in enumerate(CHANNELS)}


def grey_ramp(measurements: Measurements) -> Ramp:
    """Return the greys, without black."""
    return ramp(measurements, [0, 1, 2])


def primaries(measurements: Measurements) -> tuple[Floats | None, str]:
    """Return the primaries' XYZ minus black as columns (3, 3), or None and why they are not known."""
    dark, _ = black_or_none(measurements)
    columns = []
    for name, own in channel_ramps(measurements).items():
        if not len(own) or own.levels[-1] < 1:
            return None, f"{name} at full drive was not read"
        columns.append(own.XYZ[-1] - dark)
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
