"""What one eye sees of both pictures: registered and measured by regions, then compared pixel by pixel and judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents import Finding
from stimuli.comparison.bring import brought, flags_brought
from stimuli.comparison.compare_regions import ComparedRegions, compare_regions
from stimuli.comparison.difference_map import Floats32, difference_map, summarise
from stimuli.comparison.drawn import Drawn, draw_map, draw_pictures, draw_profiles
from stimuli.comparison.evidence import Evidence, RegistrationEvidence
from stimuli.comparison.pictures import View
from stimuli.comparison.place_regions import place_regions
from stimuli.comparison.placing import Placing
from stimuli.comparison.regions import Floats, PlacedRegions, Region, inside, window
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.registered import registered
from stimuli.comparison.results import EyeComparison, Wishes
from stimuli.comparison.row_file import RowFile
from stimuli.comparison.scaled import ScaledRows
from stimuli.comparison.scielab import SeenPicture
from stimuli.comparison.seen_regions import seen_regions
from stimuli.comparison.sparkles import SparkleArea, sparkle_area
from stimuli.comparison.verdict import judge
from stimuli.errors import StimulusError

Mask = NDArray[np.bool_]
# Called with what is being done, how much of it is done, and of how much.
Step = Callable[[str, int, int], None]

# A region of which more lies beyond the rendering's edge is not compared.
_MOST_OUTSIDE = 0.05
_MOST_TOLD = 5


@dataclass(frozen=True, eq=False, slots=True)
class Registered:
    """Both views of one eye on the photograph's grid; ``within`` and the flags are bool (height, width)."""

    photo: View
    rendering: View
    moved: RowFile
    within: Mask
    saturated: Mask | None
    placing: Placing
    placed: PlacedRegions
    safe_cd_m2: tuple[float, float] | None
    step: Step

    def regions(
        self, regions: RegionsFile, wishes: Wishes, white: Floats | None = None, scaled_by: float | None = None
    ) -> ComparedRegions:
        """Return what the regions differ by."""
        return compare_regions(
            self.photo.xyz,
            self.moved,
            self.placed,
            regions,
            white_XYZ=white,
            display_white_cd_m2=wishes.display_white_cd_m2,
            scaled_by=scaled_by,
            photo_saturated=self.photo.saturated,
            rendering_saturated=self.saturated,
            safe_luminance_cd_m2=self.safe_cd_m2,
            rows_done=lambda done, of: self.step("Measuring regions", done, of),
        )


def register_eye(
    photo: View,
    rendering: View,
    file: str,
    safe_cd_m2: tuple[float, float] | None,
    regions: RegionsFile,
    wishes: Wishes,
    step: Step,
) -> Registered:
    """Bring the rendering, of the file named, onto the photograph's grid.

    Raises
    ------
    StimulusError, PictureError
        As `registered` and `place_regions` do, or if a region lies beyond the rendering's edge.
    """
    step("Registering", 0, 1)
    placing = registered(photo, rendering, file, regions, wishes)
    step("Registering", 1, 1)
    height, width = photo.xyz.shape[:2]
    size = (width, height)
    moved, within = brought(rendering.xyz, placing, size, lambda done, of: step("Bringing to one grid", done, of))
    full = None if rendering.saturated is None else flags_brought(rendering.saturated, placing, size)
    placed = place_regions(regions, photo.xyz.shape)
    _refuse_outside(placed, within, regions.file)
    return Registered(photo, rendering, moved, within, full, placing, placed, safe_cd_m2, step)


def judge_eye(one: Registered, found: ComparedRegions, regions: RegionsFile, wishes: Wishes) -> EyeComparison:
    """Compare what one eye sees pixel by pixel and by its sparkles, and judge all of it.

    Raises
    ------
    StimulusError
        If no region is left to compare.
    """
    table, said, limits, step = found.table, list(found.said), regions.limits, one.step
    photo, scaled, placed = one.photo.xyz, ScaledRows(one.moved, found.table.scaled_by), one.placed
    counts = [region for region, row in zip(placed.regions, table.rows, strict=True) if not row.excluded]
    compared = _compared(counts, one.within, one.photo.saturated, one.saturated)
    if not compared.any():
        reasons = [
            Finding(f"the region '{row.name}' does not count: {'; '.join(row.excluded)}") for row in table.excluded
        ]
        raise StimulusError([Finding("no region is left to compare", regions.file), *reasons[:_MOST_TOLD]])
    sparkle = _sparkle(one, wishes)
    elsewhere = {area.name for area in sparkle if area.other_flakes}
    other_flakes = False
    if elsewhere:
        same = compared & ~_compared([region for region in counts if region.name in elsewhere], one.within)
        other_flakes = not same.any()
        if not other_flakes:
            compared = same
            names = ", ".join(f"'{name}'" for name in sorted(elsewhere))
            said.append(f"single pixels of {names} are left out: their flakes lie elsewhere in the rendering")
    drawn: dict[str, str] = {}

    def drawing(name: str, delta_e: Floats32) -> None:
        if wishes.draw:
            drawn.update(draw_map(name, delta_e, limits.delta_e, one.within, compared))

    delta_e = difference_map(photo, scaled, table.white_XYZ, lambda done, of: step("Colour differences", done, of))
    plain = summarise(delta_e, limits.delta_e, compared)
    drawing("plain", delta_e)
    del delta_e
    seen, by_region = None, {}
    if wishes.pixels_per_degree is None:
        said.append("no viewing distance was told, so that nothing is known of what the eye resolves")
    else:
        step("As the eye sees it", 0, photo.shape[0])
        first, second = (SeenPicture(each, wishes.pixels_per_degree, table.white_XYZ) for each in (photo, scaled))
        delta_e = difference_map(first, second, table.white_XYZ, lambda done, of: step("As the eye sees it", done, of))
        seen, by_region = summarise(delta_e, limits.delta_e, compared), seen_regions(delta_e, counts)
        drawing("seen", delta_e)
        del delta_e
    placing = one.placing
    evidence = Evidence(
        table,
        plain,
        seen,
        tuple(each for area in sparkle for each in area.pairs),
        RegistrationEvidence(placing.residual_px, placing.shift_px, placing.shift_se_px, placing.rotation_deg),
        seen_regions=by_region,
        other_flakes=other_flakes,
    )
    said += placing.remarks()
    figures = None
    if wishes.draw:
        profiles = draw_profiles(photo, scaled, placed.regions)
        seen_on = wishes.display_white_XYZ
        pictures = draw_pictures(photo, scaled, table.white_XYZ if seen_on is None else seen_on)
        figures = Drawn(drawn, *pictures, profiles, white_is_display=seen_on is not None)
    verdict = judge(evidence, limits)
    return EyeComparison(photo, scaled, placing, table, plain, seen, sparkle, verdict, tuple(said), placed, figures)


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


def _sparkle(one: Registered, wishes: Wishes) -> tuple[SparkleArea, ...]:
    asked = [region for region in one.placed.regions if region.sparkle]
    found = []
    for done, region in enumerate(asked):
        one.step("Measuring sparkle", done, len(asked))
        area = sparkle_area(region, one.photo.xyz, one.rendering.xyz, one.moved, one.placing, wishes.pixels_per_degree)
        if area is not None:
            found.append(area)
    if asked:
        one.step("Measuring sparkle", len(asked), len(asked))
    return tuple(found)
