"""The codes of a sensor that are black, full scale and saturated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stimuli.errors import StimulusError

_FILTERS = 4  # red, green, blue, and the second green, as LibRaw counts


@dataclass(frozen=True, slots=True)
class Levels:
    """Codes that take the place of the file's: None leaves the file's.

    ``black`` is subtracted, ``white`` is full scale, and from ``saturated`` on a photosite counts as full (white, if
    None). Sensors often fill up a little below the white level that their file declares: give ``saturated`` then.
    Raises StimulusError unless they are finite, black ≥ 0, and white and saturated above black.
    """

    black: float | None = None
    white: float | None = None
    saturated: float | None = None

    def __post_init__(self) -> None:
        black = 0.0 if self.black is None else self.black
        for name, level in (("black", self.black), ("white", self.white), ("saturated", self.saturated)):
            if level is None:
                continue
            if not np.isfinite(level) or level < 0 or (name != "black" and level <= black):
                raise StimulusError.of(
                    f"the level '{name}' is {level:g}", "levels are codes: white above black, from 0 up"
                )

    def black_codes(self, declared: Sequence[float]) -> list[float]:
        """Return the black level of each of LibRaw's four filters."""
        return [float(level) if self.black is None else self.black for level in declared]

    def white_codes(self, declared: float) -> list[float]:
        """Return the white level of each filter."""
        return [float(declared) if self.white is None else self.white] * _FILTERS

    def saturation_codes(self, whites: Sequence[float], declared: Sequence[float] | None) -> list[float]:
        """Return the code from which each filter's photosites are full: no later than white."""
        if self.saturated is not None:
            return [self.saturated] * _FILTERS
        stated = whites if declared is None or self.white is not None else declared
        return [min(white, float(level)) for white, level in zip(whites, stated, strict=True)]
