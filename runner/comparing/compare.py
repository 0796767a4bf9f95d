"""One photograph and one rendering, eye by eye: registered, compared in numbers and as the eye resolves, and judged."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.validation.chart_way import Side, check_charts
from analysis.validation.compare_regions import compare_regions
from analysis.validation.difference_map import DifferenceSummary, difference_map, summarise
from analysis.validation.errors import PictureError
from analysis.validation.evidence import Evidence, RegistrationEvidence
from analysis.validation.limits import Limits
from analysis.validation.place_regions import corner_pairs, place_regions
from analysis.validation.region_table import RegionTable
from analysis.validation.regions import Floats, PlacedRegions, Region, inside, window
from analysis.validation.regions_file import RegionsFile
from analysis.validation.scielab import SeenPicture
from analysis.validation.verdict import Verdict, judge, together
from documents import Finding
from runner.comparing.bring import brought, flags_brought
from runner.comparing.depth import DisparityPair, disparity_pair
from runner.comparing.drawn import Drawn, draw_map, draw_pictures
from runner.comparing.pictures import Eye, Picture, View
from runner.comparing.placing import Placing, Registering, place
from runner.comparing.row_file import RowFile
from runner.comparing.scaled import ScaledRows
from runner.comparing.sparkles import SparkleArea, sparkle_area
from stimuli.errors import StimulusError

Mask = NDArray[np.bool_]
# Called with what is being done, how much of it is done, and of how much.
Step = Callable[[str, int, int], None]

# A rendering that is turned further was made another way round, and is not turned back for anyone.
MOST_TURN_DEG = 45.0
# A region of which more lies beyond the rendering's edge is not compared.
_MOST_OUTSIDE = 0.05
_MOST_TOLD = 5


@dataclass(frozen=True, eq=False, slots=True)
class Wishes:
    """How to compare: ``corners_px`` are four places in the photograph and in the rendering, as `Region` has them.

    ``pixels_per_degree`` is None where it is not known from where the pictures are seen. ``draw`` asks for figures.
    """

    registering: Registering = "auto"
    corners_px: tuple[Floats, Floats] | None = None
    pixels_per_degree: float | None = None
    draw: bool = False


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


def compare(
    photo: Picture,
    rendering: Picture,
    regions: RegionsFile,
    wishes: Wishes,
    step: Step,
    settings: Mapping[str, Any] | None = None,
) -> Comparison:
    """Return what the two differ by, and whether the rendering is validated.

    Raises
    ------
    StimulusError, PictureError
        If one is for two eyes and the other is not, if they cannot be brought to one grid closely enough, if a region
        lies outside, or a chart lies another way round.
    """
    if set(photo.views) != set(rendering.views):
        flat, stereo = ("photograph", "rendering") if "both" in photo.views else ("rendering", "photograph")
        raise StimulusError(
            Finding(f"the {flat} is one picture and the {stereo} a pair for two eyes", remedy="give two of a kind")
        )
    eyes: dict[Eye, EyeComparison] = {}
    white: Floats | None = None
    for eye, view in photo.views.items():
        told = _named(step, "" if eye == "both" else f", {eye} eye")
        eyes[eye] = _eye(view, rendering.views[eye], (photo, rendering), regions, wishes, white, told)
        white = np.array(eyes[eye].table.white_XYZ)
    pair = None
    if "left" in photo.views:
        step("Measuring disparity", 0, 2)
        pair = disparity_pair(photo, rendering)
        step("Measuring disparity", 2, 2)
    verdict = _all(eyes, pair, regions.limits)
    return Comparison(photo, rendering, eyes, pair, verdict, regions.file, wishes, settings or {})


def _named(step: Step, name: str) -> Step:
    return lambda what, done, of: step(what + name, done, of)


def _all(eyes: Mapping[Eye, EyeComparison], pair: DisparityPair | None, limits: Limits) -> Verdict:
    if pair is None:
        return next(iter(eyes.values())).verdict
    verdicts = {f"{eye} eye": one.verdict for eye, one in eyes.items()}
    return together({**verdicts, "both eyes": judge(Evidence(disparity=pair.evidence), limits)})


def _eye(
    photo: View,
    rendering: View,
    pictures: tuple[Picture, Picture],
    regions: RegionsFile,
    wishes: Wishes,
    white: Floats | None,
    step: Step,
) -> EyeComparison:
    limits = regions.limits
    step("Registering", 0, 1)
    try:
        placing = _placed(photo.xyz, rendering.xyz, pictures, regions, wishes)
    except StimulusError:
        _refuse_turned_charts(photo, rendering, regions)
        raise
    step("Registering", 1, 1)
    height, width = photo.xyz.shape[:2]
    size = (width, height)
    moved, within = brought(rendering.xyz, placing, size, lambda done, of: step("Bringing to one grid", done, of))
    full = None if rendering.saturated is None else flags_brought(rendering.saturated, placing, size)
    placed = place_regions(regions, photo.xyz.shape)
    _refuse_outside(placed, within, regions.file)
    found = compare_regions(
        photo.xyz,
        moved,
        placed,
        regions,
        white_XYZ=white,
        photo_saturated=photo.saturated,
        rendering_saturated=full,
        safe_luminance_cd_m2=pictures[0].safe_cd_m2,
        rows_done=lambda done, of: step("Measuring regions", done, of),
    )
    table, said = found.table, list(found.said)
    scaled = ScaledRows(moved, table.scaled_by)
    counts = [region for region, row in zip(placed.regions, table.rows, strict=True) if not row.excluded]
    compared = _compared(counts, within, photo.saturated, full)
    if not compared.any():
        reasons = [
            Finding(f"the region '{row.name}' does not count: {'; '.join(row.excluded)}") for row in table.excluded
        ]
        raise StimulusError([Finding("no region is left to compare", regions.file), *reasons[:_MOST_TOLD]])
    drawn: dict[str, str] = {}
    delta_e = difference_map(photo.xyz, scaled, table.white_XYZ, lambda done, of: step("Colour differences", done, of))
    plain = summarise(delta_e, limits.delta_e, compared)
    if wishes.draw:
        drawn |= draw_map("plain", delta_e, limits.delta_e, within, compared)
    del delta_e
    seen = None
    if wishes.pixels_per_degree is None:
        said.append("no viewing distance was told, so that nothing is known of what the eye resolves")
    else:
        step("As the eye sees it", 0, height)
        one, two = (SeenPicture(each, wishes.pixels_per_degree, table.white_XYZ) for each in (photo.xyz, scaled))
        delta_e = difference_map(one, two, table.white_XYZ, lambda done, of: step("As the eye sees it", done, of))
        seen = summarise(delta_e, limits.delta_e, compared)
        if wishes.draw:
            drawn |= draw_map("seen", delta_e, limits.delta_e, within, compared)
        del delta_e
    sparkle = _sparkle(placed, photo.xyz, rendering.xyz, moved, placing, wishes, step)
    evidence = Evidence(
        table,
        plain,
        seen,
        tuple(pair for area in sparkle for pair in area.pairs),
        RegistrationEvidence(placing.residual_px, placing.shift_px, placing.shift_se_px, placing.rotation_deg),
    )
    said += placing.remarks()
    figures = Drawn(drawn, *draw_pictures(photo.xyz, scaled, table.white_XYZ)) if wishes.draw else None
    return EyeComparison(
        photo.xyz, scaled, placing, table, plain, seen, sparkle, judge(evidence, limits), tuple(said), placed, figures
    )


def _placed(
    photo: RowFile, rendering: RowFile, pictures: tuple[Picture, Picture], regions: RegionsFile, wishes: Wishes
) -> Placing:
    """Return where the rendering lies, refusing it if that is not known closely enough."""
    corners = wishes.corners_px
    if wishes.registering == "corners" and corners is None:
        corners = corner_pairs(regions, photo.shape, rendering.shape)
        if corners is None:
            raise StimulusError(
                Finding(
                    "no corners are given for both pictures",
                    regions.file,
                    remedy="give 'corners' and 'rendering_corners', or say --photo-corners and --rendering-corners",
                )
            )
    # Regions count from the corner of a pixel, alignment from its middle.
    halved = None if corners is None else (corners[0] - 0.5, corners[1] - 0.5)
    placing = place(photo, rendering, wishes.registering, halved)
    file = str(pictures[1].file)
    if abs(placing.rotation_deg) > MOST_TURN_DEG:
        raise StimulusError(
            Finding(
                f"the rendering is turned by {placing.rotation_deg:.1f}° against the photograph",
                file,
                remedy="turn it upright, or give corners that say so",
            )
        )
    most = regions.limits.registration_residual_px
    if placing.residual_px is not None and placing.residual_px > most:
        told = "; ".join(placing.sentences())
        raise StimulusError(
            Finding(
                f"photograph and rendering lie {placing.residual_px:.2g} px apart, more than {most:g} px"
                + (f": {told}" if told else ""),
                file,
                remedy="let them be registered with --register auto"
                if wishes.registering == "none"
                else "check that they show the same; or raise the limit 'registration_residual_px'",
            )
        )
    return placing


def _refuse_turned_charts(photo: View, rendering: View, regions: RegionsFile) -> None:
    """Where two pictures of one size do not fit, say so if that is because a chart lies another way round."""
    if photo.xyz.shape != rendering.xyz.shape:
        return
    charts = place_regions(regions, photo.xyz.shape).charts
    sides: tuple[tuple[View, Side], ...] = ((photo, "photograph"), (rendering, "rendering"))
    for view, side in sides:
        try:
            check_charts(view.xyz, charts, side, view.saturated, regions.file)
        except PictureError as error:
            # That the colours are in no way the chart's is no news of pictures that do not fit.
            turned = [one for one in error.findings if one.message.startswith("the chart ")]
            if turned:
                raise PictureError(turned) from None


def _refuse_outside(placed: PlacedRegions, within: Mask, file: str) -> None:
    findings = []
    for region in placed.regions:
        rows, columns = window(region.photo_px, within.shape)
        mask = inside(region.photo_px, rows, columns)
        beyond = float(np.count_nonzero(mask & ~within[rows, columns])) / max(1, int(np.count_nonzero(mask)))
        if beyond > _MOST_OUTSIDE:
            findings.append(
                Finding(
                    f"{100 * beyond:.0f} % of the region '{region.name}' lie beyond the rendering's edge",
                    file,
                    remedy="make it smaller, or render more",
                )
            )
    if findings:
        raise StimulusError(findings)


def _compared(regions: Sequence[Region], within: Mask, *flags: Mask | None) -> Mask:
    """Return the pixels that lie in a region, within the rendering, and are not saturated."""
    found = np.zeros(within.shape, dtype=np.bool_)
    for region in regions:
        rows, columns = window(region.photo_px, within.shape)
        found[rows, columns] |= inside(region.photo_px, rows, columns)
    found &= within
    for full in flags:
        if full is not None:
            found &= ~full
    return found


def _sparkle(
    placed: PlacedRegions,
    photo: RowFile,
    rendering: RowFile,
    moved: RowFile,
    placing: Placing,
    wishes: Wishes,
    step: Step,
) -> tuple[SparkleArea, ...]:
    asked: list[Region] = [region for region in placed.regions if region.sparkle]
    found = []
    for done, region in enumerate(asked):
        step("Measuring sparkle", done, len(asked))
        area = sparkle_area(region, photo, rendering, moved, placing, wishes.pixels_per_degree)
        if area is not None:
            found.append(area)
    if asked:
        step("Measuring sparkle", len(asked), len(asked))
    return tuple(found)
