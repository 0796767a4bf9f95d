"""How two pictures are compared, and the result of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal

from devices.eyes import AnyEye
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult
from stimuli.comparison.alignment import Alignment
from stimuli.comparison.by_pixel import DifferenceOverview, DifferenceSummary
from stimuli.comparison.camera_rgb import CameraRGBTable
from stimuli.comparison.depth import DepthComparison
from stimuli.comparison.luminance import LuminanceMode
from stimuli.comparison.pictures import Holds, Picture, ReadOptions
from stimuli.comparison.regions import PlacedRegions
from stimuli.comparison.regions_file import RegionsFile, WhiteName
from stimuli.comparison.sparkles import SparkleArea
from stimuli.comparison.table import RegionTable
from stimuli.comparison.verdict import (
    Outcome,
    Verdict,
    decision_sentence,
    outcome_lines,
    passing_heading,
    passing_lines,
)
from stimuli.errors import StimulusError
from stimuli.measures import MeasureTable, ViewingConditions
from stimuli.pictures.rows import Mask, RowFile, ScaledRows

RegistrationMode = Literal["auto", "none", "corners"]


@dataclass(frozen=True, eq=False, slots=True)
class CompareOptions:
    """How two pictures are compared.

    Parameters
    ----------
    reading
        How both files are read.
    photo_holds, rendering_holds
        The kind of values in a file that does not declare it.
    viewing
        Where the pictures are seen; without it they are not compared as the eye resolves them.
    register
        ``auto`` finds shift and turn, ``none`` takes the pixels as they are, ``corners`` brings four corners together.
    corners_px
        Four places (4, 2) in the photograph and in the rendering, in pixels from the top left corner.
    white, white_luminance_cd_m2, luminance, delta_e_limit
        Take the place of the regions file's white, its luminance mode and its limit of ΔE00.
    measures
        Names of measures to report beside the verdict, which they do not change; they need ``viewing``.
    """

    reading: ReadOptions = field(default_factory=ReadOptions)
    photo_holds: Holds | None = None
    rendering_holds: Holds | None = None
    viewing: ViewingConditions | None = None
    register: RegistrationMode = "auto"
    corners_px: tuple[Floats, Floats] | None = None
    white: WhiteName | None = None
    white_luminance_cd_m2: float | None = None
    luminance: LuminanceMode | None = None
    delta_e_limit: float | None = None
    measures: tuple[str, ...] = ()

    @property
    def pixels_per_degree(self) -> float | None:
        """How finely the pictures are seen, None where it is not known."""
        return None if self.viewing is None else self.viewing.pixels_per_degree

    @property
    def display_white_XYZ(self) -> Floats | None:
        """The white of the display, XYZ (3,), None where it is not known."""
        return None if self.viewing is None else self.viewing.display_white_XYZ

    def applied_to(self, regions: RegionsFile) -> RegionsFile:
        """Return a regions file with these options in place of its own values."""
        names = ("white", "white_luminance_cd_m2", "luminance")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        limit = self.delta_e_limit
        if limit is not None:
            if not 0 < limit < math.inf:
                raise StimulusError(Finding(f"the limit 'delta_e' is {limit}", remedy="a finite number above 0"))
            given["limits"] = regions.limits.model_copy(update={"delta_e": limit})
        return replace(regions, spec=regions.spec.model_copy(update=given))


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

    photo: Picture
    rendering: Picture
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

    def lines(self) -> list[str]:
        """Return the verdict in lines: its sentence, its reasons with a mark each, what passes, and notes."""
        verdict = self.verdict
        lines = [decision_sentence(verdict)]
        marks: tuple[tuple[Outcome, str], ...] = (("fails", "✗"), ("cannot say", "?"), ("noted", "·"))
        lines += [f"  {mark} {line}" for outcome, mark in marks for line in outcome_lines(verdict, outcome)]
        passing = passing_lines(verdict)
        if passing:
            lines += [passing_heading(verdict), *(f"  ✓ {line}" for line in passing)]
        if self.measures is not None:
            lines += ["Measures:", *(f"  {line}" for line in self.measures.lines())]
        for eye, result in self.eyes.items():
            if result.camera_rgb is not None:
                first, *rest = result.camera_rgb.lines()
                lines += [first if eye == "both" else f"{eye.capitalize()} eye. {first}", *rest]
        lines += [f"Note: {note}." for note in self.notes]
        for picture in (self.photo, self.rendering):
            lines += [f"Note: {picture.file}: {note}." for note in picture.notes]
        if self.measures is not None:
            lines += [f"Note: {remark}." for remark in self.measures.remarks()]
        return lines

    @property
    def measures_left_out(self) -> tuple[str, ...]:
        """Which measures could not be made, and why."""
        return () if self.measures is None else self.measures.left_out
