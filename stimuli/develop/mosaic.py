"""A sensor's photosites behind their colour filters, in float, before anything is interpolated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stimuli.errors import StimulusError

COLOURS = ("red", "green", "blue")


@dataclass(frozen=True, eq=False, slots=True)
class Mosaic:
    """One linear value per photosite behind a Bayer filter.

    ``values`` is float32, (height, width): 0 is black, 1 full scale. ``saturated`` is bool of the same shape.
    ``pattern`` is (2, 2) with 0, 1, 2 for red, green, blue: the filter of the photosites in rows 0, 1 and columns
    0, 1, repeated over the sensor. Raises StimulusError if the shapes disagree, the sensor is smaller than 2 × 2, or
    the pattern is not one red, two diagonal greens and one blue.
    """

    values: NDArray[np.float32]
    saturated: NDArray[np.bool_]
    pattern: NDArray[np.int64]

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or min(self.values.shape) < 2 or self.saturated.shape != self.values.shape:
            raise StimulusError(f"photosites of shape {self.values.shape}, saturation of {self.saturated.shape}")
        greens = np.argwhere(self.pattern == 1)
        if (
            self.pattern.shape != (2, 2)
            or sorted(self.pattern.ravel().tolist()) != [0, 1, 1, 2]
            or greens[0, 1] == greens[1, 1]
            or greens[0, 0] == greens[1, 0]
        ):
            raise StimulusError(f"the colour filter is {self.pattern.tolist()}; only Bayer patterns are developed")

    def places(self, colour: int) -> list[tuple[slice, slice]]:
        """Return where the photosites of ``colour`` (0, 1, 2) stand: one pair of slices, or two for green."""
        return [(slice(int(y), None, 2), slice(int(x), None, 2)) for y, x in np.argwhere(self.pattern == colour)]

    def saturated_photosites(self) -> dict[str, dict[str, float]]:
        """Return, per colour, how many photosites are saturated and the share of its photosites that is."""
        told = {}
        for colour, name in enumerate(COLOURS):
            full = sum(int(self.saturated[place].sum()) for place in self.places(colour))
            of = sum(self.saturated[place].size for place in self.places(colour))
            told[name] = {"photosites": full, "share": full / of}
        return told
