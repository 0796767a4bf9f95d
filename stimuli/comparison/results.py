"""How to compare, and what was found."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from stimuli.comparison.depth import DisparityPair
from stimuli.comparison.difference_map import DifferenceSummary
from stimuli.comparison.drawn import Drawn
from stimuli.comparison.pictures import Eye, Picture
from stimuli.comparison.placing import Placing, Registering
from stimuli.comparison.region_table import RegionTable
from stimuli.comparison.regions import Floats, PlacedRegions
from stimuli.comparison.row_file import RowFile
from stimuli.comparison.scaled import ScaledRows
from stimuli.comparison.sparkles import SparkleArea
from stimuli.comparison.verdict import Verdict


@dataclass(frozen=True, eq=False, slots=True)
class Wishes:
    """How to compare: ``corners_px`` are four places in the photograph and in the rendering, as `Region` has them.

    ``pixels_per_degree`` is None where it is not known from where the pictures are seen, ``display_white_XYZ`` (3,)
    where it is not known on what. ``draw`` asks for figures.
    """

    registering: Registering = "auto"
    corners_px: tuple[Floats, Floats] | None = None
    pixels_per_degree: float | None = None
    display_white_XYZ: Floats | None = None
    draw: bool = False

    @property
    def display_white_cd_m2(self) -> float | None:
        """The luminance of the display's white, None where it is not known."""
        return None if self.display_white_XYZ is None else float(self.display_white_XYZ[1])


@dataclass(frozen=True, eq=False, slots=True)
class EyeComparison:
    """What was found for one eye; ``rendering`` is it on the photograph's pixels, times the table's ``scaled_by``.

    Summaries are of the pixels within regions that count, without those that are saturated or beyond the rendering's
    edge. ``seen`` is None where the viewing distance is not known.
    """

    photo: RowFile
    rendering: ScaledRows
    placing: Placing
    table: RegionTable
    per_pixel: DifferenceSummary
    seen: DifferenceSummary | None
    sparkle: tuple[SparkleArea, ...]
    verdict: Verdict
    said: tuple[str, ...]
    regions: PlacedRegions
    drawn: Drawn | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the numbers."""
        return {
            "verdict": self.verdict.to_json(),
            "registration": self.placing.to_json(),
            "regions": self.table.to_json(),
            "per_pixel": self.per_pixel.to_json(),
            "as_seen": None if self.seen is None else self.seen.to_json(),
            "sparkle": [
                {
                    "region": area.name,
                    "pixels": area.pixels,
                    "rendering_as_rendered": area.own_pixels,
                    "in_both": area.matched,
                    "photograph": area.photo.to_json(),
                    "rendering": area.rendering.to_json(),
                    "pairs": [pair.to_json() for pair in area.pairs],
                }
                for area in self.sparkle
            ],
            "said": list(self.said),
        }


@dataclass(frozen=True, eq=False, slots=True)
class Comparison:
    """What was found for all eyes, and the verdict on all of it."""

    photo: Picture
    rendering: Picture
    eyes: Mapping[Eye, EyeComparison]
    disparity: DisparityPair | None
    verdict: Verdict
    regions_file: str
    wishes: Wishes
    settings: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return everything as JSON values; None for what is no finite number."""
        found: dict[str, Any] = _finite(self._everything())
        return found

    def _everything(self) -> dict[str, Any]:
        return {
            "decision": self.verdict.decision,
            "verdict": self.verdict.to_json(),
            "photograph": self.photo.to_json(),
            "rendering": self.rendering.to_json(),
            "regions_file": self.regions_file,
            "pixels_per_degree": self.wishes.pixels_per_degree,
            "settings": dict(self.settings),
            "eyes": {eye: one.to_json() for eye, one in self.eyes.items()},
            "disparity": None if self.disparity is None else self.disparity.to_json(),
        }


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
