"""What a reading's name says after its ``@``: where on the panel, from what angle, or beside what it was read.

``gray120@r1c3`` was read in row 1, column 3 of a grid over the panel; ``white@30deg`` and ``white@v-20deg`` from 30° to
the right and 20° below; ``gray120@on-white`` as a patch on a white screen; ``black@other=red`` while the other eye's
picture was red; ``gray120@warm-up`` while the display warmed up; ``white@no-glasses`` without the glasses. ``#2`` and
so on behind a name counts its showings. Every other name is a plain reading: full screen, at the centre, straight
ahead, through the glasses, once the display is warm.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from devices.measurements import Measurements

Kind = Literal["place", "angle", "surround", "other", "warm-up", "no-glasses"]
_PATTERNS: tuple[tuple[Kind, re.Pattern[str]], ...] = (
    ("place", re.compile(r"r([1-9]\d?)c([1-9]\d?)", re.IGNORECASE)),
    ("angle", re.compile(r"([hv]?)([+-]?\d+(?:\.\d+)?)(?:deg|°)", re.IGNORECASE)),
    ("surround", re.compile(r"on[- ](.+)", re.IGNORECASE)),
    ("other", re.compile(r"other=(.+)", re.IGNORECASE)),
    ("warm-up", re.compile(r"warm-?up", re.IGNORECASE)),
    ("no-glasses", re.compile(r"(?:no|without)[- ]glasses", re.IGNORECASE)),
)


@dataclass(frozen=True, slots=True)
class Tag:
    """The name before the ``@``, what kind of reading it is, and the words that its kind tells, in lower case."""

    base: str
    kind: Kind
    parts: tuple[str, ...]


def patch_name(name: str) -> str:
    """Return a reading's name without the count of its showings."""
    return re.sub(r"#\d+$", "", name.strip())


def tag(name: str) -> Tag | None:
    """Return what ``name`` tells, None for a plain reading."""
    base, at, said = patch_name(name).rpartition("@")
    if at:
        for kind, pattern in _PATTERNS:
            if found := pattern.fullmatch(said.strip()):
                return Tag(base.strip().lower(), kind, tuple(part.strip().lower() for part in found.groups()))
    return None


def plain(measurements: Measurements) -> Measurements:
    """Return the readings that fill the screen and were read at its centre, straight ahead."""
    return measurements.select(np.array([tag(name) is None for name in measurements.name], dtype=bool))


def tagged(measurements: Measurements, kind: Kind) -> list[tuple[int, Tag]]:
    """Return the numbers of the readings of ``kind`` and what their names tell."""
    found = [(row, tag(name)) for row, name in enumerate(measurements.name)]
    return [(row, said) for row, said in found if said is not None and said.kind == kind]


def untagged(measurements: Measurements, kind: Kind) -> Measurements:
    """Return the readings of ``kind`` alone, by the names that stand before their tags."""
    rows = tagged(measurements, kind)
    return replace(measurements.select([row for row, _ in rows]), name=tuple(said.base for _, said in rows))
