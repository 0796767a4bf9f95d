"""Colour differences as measures: CIEDE2000 as the pictures are, and as the eye resolves them."""

from __future__ import annotations

from documents.arrays import Floats32
from stimuli.measures.difference_map import difference_map
from stimuli.measures.measure import MapMeasure
from stimuli.measures.scielab import SeenPicture
from stimuli.measures.viewing import ViewingConditions
from stimuli.pictures.rows import Rows


class DeltaE2000(MapMeasure):
    """The mean of CIEDE2000 over the pixels."""

    name = "delta-e-2000"
    title = "ΔE00"
    unit = "ΔE"
    better = "lower"
    identical = 0.0
    source = "Sharma2005"
    map_title = "ΔE00"
    map_highest = 10.0

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return ΔE00 of each pixel, float32 (height, width)."""
        return difference_map(reference_XYZ, test_XYZ, viewing.cielab_white_XYZ)


class SCielab(MapMeasure):
    """The mean of CIEDE2000 over the pixels of both pictures as the eye resolves them."""

    name = "s-cielab"
    title = "S-CIELAB"
    unit = "ΔE"
    better = "lower"
    identical = 0.0
    source = "Johnson2003"
    map_title = "ΔE00 of what the eye resolves"
    map_highest = 10.0

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return ΔE00 of each pixel, float32 (height, width)."""
        white, density = viewing.cielab_white_XYZ, viewing.pixels_per_degree
        seen = [SeenPicture(picture, density, white) for picture in (reference_XYZ, test_XYZ)]
        return difference_map(seen[0], seen[1], white, filtered=True)
