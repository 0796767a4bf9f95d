"""What a mode of a display file may hold beside its characterisation: crosstalk and a gain map."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, PositiveFloat

from devices.compensation.crosstalk import Crosstalk
from devices.compensation.gain_map import GainMap, Normalise, Positions
from devices.errors import DeviceError
from documents.yaml.load import Strict

Triple = tuple[float, float, float]
Matrix = tuple[Triple, Triple, Triple]


class CrosstalkSpec(Strict):
    """What leaks into each eye: seen = own + matrix · other, in XYZ above black; three rows of three numbers each."""

    left: Matrix
    right: Matrix
    source: str = ""

    def crosstalk(self) -> Crosstalk:
        """Return the crosstalk; DeviceError if it cannot be undone."""
        return Crosstalk(np.array(self.left), np.array(self.right))


class GainMapSpec(Strict):
    """Luminance readings over the panel, top row first, in one unit; see `devices.compensation.gain_map.GainMap`."""

    luminance: Annotated[list[Annotated[list[PositiveFloat], Field(min_length=1)]], Field(min_length=1)]
    positions: Positions
    normalise: Normalise
    source: str = ""

    def gain_map(self, resolution_px: tuple[int, int]) -> GainMap:
        """Return the gain map of a panel; DeviceError if the rows differ in length or are too few."""
        lengths = [len(row) for row in self.luminance]
        if len(set(lengths)) > 1:
            raise DeviceError(
                f"the rows of the gain map hold {', '.join(map(str, lengths))} readings; all need as many"
            )
        return GainMap(np.array(self.luminance), resolution_px, self.positions, self.normalise)
