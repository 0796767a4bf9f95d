"""A camera's picture: linear RGB in shares of full scale, and where it was saturated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stimuli.errors import StimulusError

if TYPE_CHECKING:
    from devices.camera import Exposure

# Noise seldom lets so many photosites meet at the largest code.
_MANY = 20


@dataclass(frozen=True, eq=False, slots=True)
class CameraImage:
    """Linear camera RGB, where it is saturated, and every step that made it.

    ``rgb`` is float32, (height, width, 3): 0 is black and 1 full scale. Noise below black stays negative.
    ``saturated`` is bool of the same shape: the channel's value rests on a full photosite and is a lower bound only.
    ``exposure`` is None where it is not known. ``source`` names the file. ``steps`` are mappings
    that JSON can hold, in the order in which they were done, each with its name under ``step``.
    Raises StimulusError if the shapes disagree.
    """

    rgb: NDArray[np.float32]
    saturated: NDArray[np.bool_]
    exposure: Exposure | None
    source: str
    steps: tuple[Mapping[str, Any], ...] = ()

    def __post_init__(self) -> None:
        if self.rgb.ndim != 3 or self.rgb.shape[2] != 3 or 0 in self.rgb.shape:
            raise StimulusError(f"a camera picture has shape {self.rgb.shape}; expected (height, width, 3)")
        if self.saturated.shape != self.rgb.shape:
            raise StimulusError(f"the saturation map is {self.saturated.shape}, the picture {self.rgb.shape}")

    @property
    def saturated_share(self) -> tuple[float, float, float]:
        """Shares of saturated pixels in red, green and blue, 0 to 1."""
        red, green, blue = self.saturated.reshape(-1, 3).mean(axis=0)
        return float(red), float(green), float(blue)

    def full_early(self) -> tuple[str, ...]:
        """Return a note for each step in which many photosites share a code below that of a full one."""
        notes = []
        for step in self.steps:
            if step["step"] != "linearise":
                continue
            largest, many, full = step["largest_code"], step["photosites_at_largest_code"], min(step["saturated_from"])
            if largest < full and many >= _MANY:
                notes.append(
                    f"{many} photosites share the largest code, {largest}, below {full:g}: if it is full there, "
                    f"give --saturated {largest}"
                )
        return tuple(notes)
