"""What one eye sees of both pictures: registered and measured by regions, then compared pixel by pixel and judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from documents import Finding
from stimuli.comparison.alignment import Alignment, resample, resample_flags
from stimuli.comparison.areas import inside, window
from stimuli.comparison.by_pixel import difference_map, overview, seen_regions, summarise
from stimuli.comparison.by_region import ComparedRegions, compare_regions
from stimuli.comparison.evidence import Evidence, RegistrationEvidence
from stimuli.comparison.judging import judge
from stimuli.comparison.pictures import View
from stimuli.comparison.regions import PlacedRegions, Region, place_regions
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.registering import register_views
from stimuli.comparison.results import CompareOptions, EyeComparison
from stimuli.comparison.rows import Floats, Mask, RowFile, ScaledRows
from stimuli.comparison.scielab import SeenPicture
from stimuli.comparison.sparkles import SparkleArea, sparkle_area
from stimuli.errors import StimulusError

# Called with what is being done, how much of it is done, and of how much.
Progress = Callable[[str, int, int], None]

# A region of which more lies beyond the rendering's edge is not compared.
_MOST_OUTSIDE = 0.05
_MOST_REASONS = 5


@dataclass(frozen=True, eq=False, slots=True)
class EyePair:
    """Both views of one eye on the photograph's grid; ``within`` and the flags are bool (height, width)."""

    photo: View
    rendering: View
    moved: RowFile
    within: Mask
    saturated: Mask | None
    alignment: Alignment
    placed: PlacedRegions
    safe_cd_m2: tuple[float, float] | None
    step: Progress

    def regions(
        self, regions: RegionsFile, options: CompareOptions, white: Floats | None = None, scaled_by: float | None = None
    ) -> ComparedRegions:
        """Return what the regions differ by."""
        display_white = options.display_white_XYZ
        return compare_regions(
            self.photo.xyz,
            self.moved,
            self.placed,
            regions,
            white_XYZ=white,
            display_white_cd_m2=None if display_white is None else float(display_white[1]),
            scaled_by=scaled_by,
            photo_saturated=self.photo.saturated,
            rendering_saturated=self.saturated,
            safe_luminance_cd_m2=self.safe_cd_m2,
            rows_done=partial(self.step, "Measuring regions"),
        )


def register_eye(
    photo: View,
    rendering: View,
    file: str,
    safe_cd_m2: tuple[float, float] | None,
    regions: RegionsFile,
    options: CompareOptions,
    step: Progress,
) -> EyePair:
    """Bring the rendering, of the file named, onto the photograph's grid.

    Raises
    ------
    StimulusError
        As `register_views` and `place_regions` do, or if a region lies beyond the rendering's edge.
    """
    step("Registering", 0, 1)
    alignment = register_views(photo, rendering, file, regions, options)
    step("Registering", 1, 1)
    height, width = photo.xyz.shape[:2]
    size = (width, height)
    moved, within = resample(rendering.xyz, alignment, size, partial(step, "Bringing to one grid"))
    full = None if rendering.saturated is None else resample_flags(rendering.saturated, alignment, size)
    placed = place_regions(regions, photo.xyz.shape)
    _refuse_outside(placed, within, regions.file)
    return EyePair(photo, rendering, moved, within, full, alignment, placed, safe_cd_m2, step)


def judge_eye(
    pair: EyePair, compared_regions: ComparedRegions, regions: RegionsFile, options: CompareOptions
) -> EyeComparison:
    """Compare what one eye sees pixel by pixel and by its sparkles, and judge all of it.

    Raises
    ------
    StimulusError
        If no region is left to compare.
    """
    table, said, limits, step = compared_regions.table, list(compared_regions.said), regions.limits, pair.step
    photo, rendering, placed = pair.photo.xyz, ScaledRows(pair.moved, table.scaled_by), pair.placed
    counts = [region for region, row in zip(placed.regions, table.rows, strict=True) if not row.excluded]
    compared = _compared(counts, pair.within, pair.photo.saturated, pair.saturated)
    if not compared.any():
        reasons = [
            Finding(f"the region '{row.name}' does not count: {'; '.join(row.excluded)}") for row in table.excluded
        ]
        raise StimulusError([Finding("no region is left to compare", regions.file), *reasons[:_MOST_REASONS]])
    sparkle = _sparkle(pair, options)
    elsewhere = {area.name for area in sparkle if area.other_flakes}
    other_flakes = False
    if elsewhere:
        same = compared & ~_compared([region for region in counts if region.name in elsewhere], pair.within)
        other_flakes = not same.any()
        if not other_flakes:
            compared = same
            names = ", ".join(f"'{name}'" for name in sorted(elsewhere))
            said.append(f"single pixels of {names} are left out: their flakes lie elsewhere in the rendering")
    delta_e = difference_map(photo, rendering, table.white_XYZ, partial(step, "Colour differences"))
    plain, plain_overview = summarise(delta_e, limits.delta_e, compared), overview(delta_e, pair.within, compared)
    del delta_e
    seen, seen_overview, by_region = None, None, {}
    if options.pixels_per_degree is None:
        said.append("no viewing distance was told, so that nothing is known of what the eye resolves")
    else:
        step("As the eye sees it", 0, photo.shape[0])
        first, second = (SeenPicture(rows, options.pixels_per_degree, table.white_XYZ) for rows in (photo, rendering))
        delta_e = difference_map(first, second, table.white_XYZ, partial(step, "As the eye sees it"))
        seen, seen_overview = summarise(delta_e, limits.delta_e, compared), overview(delta_e, pair.within, compared)
        by_region = seen_regions(delta_e, counts)
        del delta_e
    alignment = pair.alignment
    evidence = Evidence(
        table,
        plain,
        seen,
        tuple(numbers for area in sparkle for numbers in area.pairs),
        RegistrationEvidence(alignment.residual_px, alignment.shift_px, alignment.shift_se_px, alignment.rotation_deg),
        seen_regions=by_region,
        other_flakes=other_flakes,
    )
    said += alignment.remarks()
    return EyeComparison(
        photo,
        rendering,
        alignment,
        table,
        plain,
        plain_overview,
        seen,
        seen_overview,
        sparkle,
        judge(evidence, limits),
        tuple(said),
        placed,
    )


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


def _sparkle(pair: EyePair, options: CompareOptions) -> tuple[SparkleArea, ...]:
    asked = [region for region in pair.placed.regions if region.sparkle]
    areas = []
    for done, region in enumerate(asked):
        pair.step("Measuring sparkle", done, len(asked))
        area = sparkle_area(
            region, pair.photo.xyz, pair.rendering.xyz, pair.moved, pair.alignment, options.pixels_per_degree
        )
        if area is not None:
            areas.append(area)
    if asked:
        pair.step("Measuring sparkle", len(asked), len(asked))
    return tuple(areas)
