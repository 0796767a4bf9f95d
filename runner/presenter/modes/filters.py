"""The filters before the eyes of an anaglyph, as a rig states them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

Row: TypeAlias = tuple[float, float, float]
Filter: TypeAlias = Row | tuple[Row, Row, Row]


@dataclass(frozen=True, slots=True)
class Filters:
    """What each filter does to light: the share that it passes of each channel, or a matrix (3, 3) on XYZ.

    None is the mode's own default. ``split_channels`` mixes nothing: each channel is one eye's alone.
    """

    left: Filter | None = None
    right: Filter | None = None
    split_channels: bool = False


def read_filter(value: Any) -> Filter:
    """Return three shares in 0..1, or a 3 × 3 matrix; raise ValueError with what was expected."""
    if isinstance(value, list | tuple) and len(value) == 3:
        if all(isinstance(row, list | tuple) and len(row) == 3 and all(map(_number, row)) for row in value):
            first, second, third = ((float(row[0]), float(row[1]), float(row[2])) for row in value)
            return first, second, third
        if all(_number(share) and 0.0 <= share <= 1.0 for share in value):
            return float(value[0]), float(value[1]), float(value[2])
    raise ValueError("expected the shares of red, green and blue that it passes, such as [0.9, 0.05, 0.02], or 3 × 3")


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
