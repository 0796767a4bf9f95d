"""What the comparison of two pictures comes to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from devices.eyes import AnyEye
from documents.text import JsonResult
from stimuli.comparison.alignment import Alignment
from stimuli.comparison.by_pixel import DifferenceOverview, DifferenceSummary
from stimuli.comparison.camera_rgb import CameraRGBTable
from stimuli.comparison.depth import DepthComparison
from stimuli.comparison.options import CompareOptions
from stimuli.comparison.pictures import PictureFile
from stimuli.comparison.regions import PlacedRegions
from stimuli.comparison.sparkles import SparkleArea
from stimuli.comparison.table import RegionTable
from stimuli.comparison.verdict import Verdict
from stimuli.measures import MeasureTable
from stimuli.pictures.rows import Mask, RowFile, ScaledRows


@dataclass(frozen=True, eq=False, slots=True)
class EyeComparison(JsonResult):
    """The result for one eye; ``rendering`` is on the photograph's pixels and multiplied by the table's ``scaled_by``.

    Summaries are of the pixels within regions that count, without those that are saturated or beyond the rendering's
    edge. ``seen`` is None where the viewing distance is not known. The overviews are for drawing. ``masks``, while
    measures are made, are the pixels that can be used and those that count, (height, width) each.
    """

    photo: RowFile
    rendering: ScaledRows
    alignment: Alignment
    table: RegionTable
    per_pixel: DifferenceSummary
    per_pixel_overview: DifferenceOverview
    seen: DifferenceSummary | None
    seen_overview: DifferenceOverview | None
    sparkle: tuple[SparkleArea, ...]
    verdict: Verdict
    notes: tuple[str, ...]
    regions: PlacedRegions
    camera_rgb: CameraRGBTable | None = None
    masks: tuple[Mask, Mask] | None = None
    json_keys: ClassVar = {"alignment": "registration", "table": "regions", "seen": "as_seen", "notes": "said"}
    json_names: ClassVar = "verdict alignment table camera_rgb per_pixel seen sparkle notes"


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Comparison(JsonResult):
    """The result for all eyes, and the verdict on all of it.

    ``settings`` are how the comparison was asked for, by name, for its record. ``measures`` are those that were asked
    for beside the verdict.
    """

    photo: PictureFile
    rendering: PictureFile
    eyes: Mapping[AnyEye, EyeComparison]
    disparity: DepthComparison | None
    verdict: Verdict
    regions_file: str
    options: CompareOptions
    settings: Mapping[str, Any]
    measures: MeasureTable | None = None
    json_keys: ClassVar = {"photo": "photograph", "measures.rows": "measures"}
    json_names: ClassVar = (
        "verdict.decision verdict photo rendering regions_file options.pixels_per_degree settings eyes measures.rows "
        "measures_left_out disparity"
    )

    def __repr__(self) -> str:
        return f"<Comparison of {self.photo.file.name} and {self.rendering.file.name}: {self.verdict.decision}>"

    @property
    def notes(self) -> tuple[str, ...]:
        """What is to be known of the eyes; what holds for one alone names it."""
        notes: dict[str, list[str]] = {}
        for eye, result in self.eyes.items():
            for note in result.notes:
                notes.setdefault(note, []).append("" if eye == "both" else f"{eye} eye: ")
        return tuple(f"{eyes[0] if len(eyes) == 1 else ''}{note}" for note, eyes in notes.items())

    @property
    def measures_left_out(self) -> tuple[str, ...]:
        """Which measures could not be made, and why."""
        return () if self.measures is None else self.measures.left_out
