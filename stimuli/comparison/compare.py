"""Compare a photograph with its rendering, eye by eye: in numbers, as the eye resolves them, and with a verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from devices.colour_matching import mixed_observers
from devices.eyes import AnyEye
from documents import Finding, in_threads
from documents.arrays import Floats
from documents.compiled import compiler
from stimuli.comparison.areas import inside, window
from stimuli.comparison.by_pixel import overview, seen_regions, summarise
from stimuli.comparison.by_region import ComparedRegions, compare_regions
from stimuli.comparison.depth import DepthComparison
from stimuli.comparison.luminance import luminance_factor
from stimuli.comparison.options import CompareOptions
from stimuli.comparison.pictures import read_picture
from stimuli.comparison.regions import PairedArea
from stimuli.comparison.regions_file import RegionsFile, read_regions
from stimuli.comparison.registering import EyePair, Progress, register_eyes
from stimuli.comparison.results import Comparison, EyeComparison
from stimuli.comparison.sparkles import SparkleArea, sparkle_area
from stimuli.comparison.validation import Evidence, judge
from stimuli.comparison.verdict import Limits, Verdict, together
from stimuli.errors import StimulusError
from stimuli.measures import (
    LONGEST_PX,
    MeasureTable,
    PicturePair,
    SeenPicture,
    difference_map,
    measure_pairs,
    measures_for,
)
from stimuli.measures.scielab import remarks_on_observer
from stimuli.pictures.rows import Mask, ScaledRows

_MOST_REASONS = 5


def compare_pictures(
    photo: Path | str,
    rendering: Path | str,
    regions: RegionsFile | Path | str,
    options: CompareOptions | None = None,
    *,
    progress: Progress | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Comparison:
    """Compare a photograph with its rendering, and decide whether the rendering is validated.

    The rendering is brought to the photograph's pixels. Both are compared by the mean colours of regions, pixel by
    pixel, as the eye resolves them if the viewing distance is known, and by their sparkles. Pairs for two eyes are
    compared eye by eye, and by their disparities.

    Parameters
    ----------
    photo, rendering
        OpenEXR or TIFF of XYZ or of camera RGB, raw photographs, or spectral pictures.
    regions
        A regions file, or its path: what is compared, and the limits.
    options
        How the files are read, where the pictures are seen, how they are brought to one grid.
    progress
        Called with a description of the work, how much of it is done, and of how much.
    settings
        How the comparison was asked for, by name: kept in the result's record.

    Returns
    -------
    Comparison
        The verdict with its reasons, and all numbers: ``verdict.decision``, ``eyes``, ``to_json()``.

    Raises
    ------
    InputError
        If a file cannot be read, if one picture is for two eyes and the other is not, if they cannot be brought to one
        grid closely enough, if a region lies outside, the pictures or the display are for
        different colorimetric observers, a chart lies another way round, or a measure that is asked for is not there.
    OSError
        If there is no room for temporary files: 12 bytes a pixel for each of three or four pictures.

    Examples
    --------
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from stimuli.comparison import compare_pictures
    >>> from stimuli.pictures import StereoImage, write_exr
    >>> light = np.random.default_rng(1).uniform(10, 40, (180, 240, 3)).astype(np.float32)
    >>> with TemporaryDirectory() as folder:
    ...     picture = Path(folder, "plate.exr")
    ...     write_exr(picture, StereoImage.flat(light))
    ...     result = compare_pictures(picture, picture, "configs/regions/plate.yaml")
    >>> result
    <Comparison of plate.exr and plate.exr: validated>
    >>> result.eyes["both"].per_pixel.largest
    0.0
    """
    options = options or CompareOptions()
    if options.refused:
        raise StimulusError(Finding(options.refused))
    step = _one_at_a_time(progress or _silent)
    if options.measures:
        measures_for(options.measures, options.viewing)
    file = regions if isinstance(regions, RegionsFile) else read_regions(Path(regions))
    file = _with_options(file, options)
    reading = options.reading
    photo_picture = read_picture(
        Path(photo), reading, reading.photo_holds, "photograph", partial(step, "Reading the photograph")
    )
    rendering_picture = read_picture(
        Path(rendering), reading, reading.rendering_holds, "rendering", partial(step, "Reading the rendering")
    )
    observers = [("the photograph", photo_picture.observer), ("the rendering", rendering_picture.observer)]
    if options.viewing is not None and options.viewing.observer is not None:
        observers.append(("the display", options.viewing.observer))
    if mixed := mixed_observers(observers):
        raise StimulusError(mixed)
    exposure = photo_picture.exposure or reading.exposure
    options = replace(options, reading=replace(reading, observer=photo_picture.observer, exposure=exposure))
    if set(photo_picture.views) != set(rendering_picture.views):
        flat, stereo = ("photograph", "rendering") if "both" in photo_picture.views else ("rendering", "photograph")
        raise StimulusError(
            Finding(f"the {flat} is one picture and the {stereo} a pair for two eyes", remedy="give two of a kind")
        )
    rendering_picture, pairs, depth = register_eyes(photo_picture, rendering_picture, file, options, step)
    tables = _tables(pairs, file, options)
    eyes = _judge_eyes(pairs, tables, file, options)
    measures = measure_eyes(eyes, options, step)
    eyes = {eye: replace(result, masks=None) for eye, result in eyes.items()}
    seen_at = options.viewing
    viewing = {} if seen_at is None else {"pixel_pitch_mm": seen_at.pixel_pitch_mm, "distance_mm": seen_at.distance_mm}
    height, width = next(iter(photo_picture.views.values())).xyz.shape[:2]
    how = {"compiled_loops": by} if (by := compiler(height * width)) else {}
    record = {**viewing, **how, **(settings or {})}
    return Comparison(
        photo_picture,
        rendering_picture,
        eyes,
        depth,
        _verdict(eyes, depth, file.limits),
        file.file,
        options,
        record,
        measures,
    )


def _with_options(file: RegionsFile, options: CompareOptions) -> RegionsFile:
    """Return a regions file with what the options say in place of its own values."""
    names = ("white", "white_luminance_cd_m2", "luminance")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    limit = options.delta_e_limit
    if limit is not None:
        if not 0 < limit < math.inf:
            raise StimulusError.of(f"the limit 'delta_e' is {limit}", "a finite number above 0")
        given["limits"] = file.limits.model_copy(update={"delta_e": limit})
    return replace(file, spec=file.spec.model_copy(update=given))


def _one_at_a_time(step: Progress) -> Progress:
    """Return the same for eyes that are worked on side by side."""
    lock = Lock()

    def locked(what: str, done: int, of: int) -> None:
        with lock:
            step(what, done, of)

    return locked


def _silent(what: str, done: int, of: int) -> None:
    """Report no progress."""


def _tables(
    pairs: Mapping[AnyEye, EyePair], regions: RegionsFile, options: CompareOptions
) -> dict[AnyEye, ComparedRegions]:
    """Return the differences of the regions for each eye, with one white and one luminance factor for both."""
    tables: dict[AnyEye, ComparedRegions] = {}
    white = None
    for eye, pair in pairs.items():
        tables[eye] = _table(pair, regions, options, white)
        if white is not None:
            tables[eye] = replace(tables[eye], notes=(*tables[eye].notes, "white is that of the left eye"))
        white = np.array(tables[eye].table.white_XYZ)
    mode = regions.spec.luminance
    if mode == "absolute" or len(pairs) == 1:
        return tables
    rows = [row for compared in tables.values() for row in compared.table.compared]
    if not rows:
        return tables
    factor = luminance_factor(
        [row.photo.luminance_cd_m2 for row in rows], [row.rendering.luminance_cd_m2 for row in rows]
    ).of(mode)
    return {
        eye: replace(_table(pair, regions, options, white, factor), notes=tables[eye].notes)
        for eye, pair in pairs.items()
    }


def _table(
    pair: EyePair,
    regions: RegionsFile,
    options: CompareOptions,
    white: Floats | None = None,
    scaled_by: float | None = None,
) -> ComparedRegions:
    display_white = options.display_white_XYZ
    return compare_regions(
        pair.photo.xyz,
        pair.moved,
        pair.placed,
        regions,
        white_XYZ=white,
        display_white_cd_m2=None if display_white is None else float(display_white[1]),
        scaled_by=scaled_by,
        photo_saturated=pair.photo.saturated,
        rendering_saturated=pair.saturated,
        safe_luminance_cd_m2=pair.safe_cd_m2,
        rows_done=partial(pair.step, "Measuring regions"),
        observer=options.reading.seen_by,
        camera=options.reading.camera,
        exposure=options.reading.exposure,
    )


def _judge_eyes(
    pairs: Mapping[AnyEye, EyePair],
    tables: Mapping[AnyEye, ComparedRegions],
    regions: RegionsFile,
    options: CompareOptions,
) -> dict[AnyEye, EyeComparison]:
    """Judge the eyes side by side, where there are two: each reads files of its own, and filters release the lock."""
    judged = in_threads(lambda eye: _judge_eye(pairs[eye], tables[eye], regions, options), pairs)
    return dict(zip(pairs, judged, strict=True))


def _judge_eye(
    pair: EyePair, compared_regions: ComparedRegions, regions: RegionsFile, options: CompareOptions
) -> EyeComparison:
    """Compare the pictures of one eye pixel by pixel and by their sparkles, and judge all of it.

    Raises
    ------
    StimulusError
        If no region is left to compare.
    """
    table, notes, limits, step = compared_regions.table, list(compared_regions.notes), regions.limits, pair.step
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
            notes.append(f"single pixels of {names} are left out: their flakes lie elsewhere in the rendering")
    delta_e = difference_map(photo, rendering, table.white_XYZ, partial(step, "Colour differences"))
    plain, plain_overview = summarise(delta_e, limits.delta_e, compared), overview(delta_e, pair.within, compared)
    del delta_e
    seen, seen_overview, by_region = None, None, {}
    if options.pixels_per_degree is None:
        notes.append("no viewing distance was given, so that it is not known what the eye resolves")
    else:
        step("As the eye sees it", 0, photo.shape[0])
        first, second = (SeenPicture(rows, options.pixels_per_degree, table.white_XYZ) for rows in (photo, rendering))
        delta_e = difference_map(first, second, table.white_XYZ, partial(step, "As the eye sees it"), filtered=True)
        seen, seen_overview = summarise(delta_e, limits.delta_e, compared), overview(delta_e, pair.within, compared)
        by_region = seen_regions(delta_e, counts)
        del delta_e
        notes += remarks_on_observer(options.reading.seen_by)
    alignment = pair.alignment
    evidence = Evidence(
        regions=table,
        per_pixel=plain,
        seen=seen,
        sparkle=tuple(pair for area in sparkle for pair in area.pairs),
        registration=alignment,
        seen_regions=by_region,
        other_flakes=other_flakes,
    )
    notes += alignment.remarks()
    return EyeComparison(
        photo=photo,
        rendering=rendering,
        alignment=alignment,
        table=table,
        per_pixel=plain,
        per_pixel_overview=plain_overview,
        seen=seen,
        seen_overview=seen_overview,
        sparkle=sparkle,
        verdict=judge(evidence, limits),
        notes=tuple(notes),
        regions=placed,
        camera_rgb=compared_regions.camera_rgb,
        masks=(usable_pixels(pair), compared) if options.measures else None,
    )


def _compared(regions: Sequence[PairedArea], within: Mask, *flags: Mask | None) -> Mask:
    """Return the pixels that lie in a region, within the rendering, and are not saturated."""
    compared = np.zeros(within.shape, dtype=np.bool_)
    for region in regions:
        rows, columns = window(region.photo_px, within.shape)
        compared[rows, columns] |= inside(region.photo_px, rows, columns)
    compared &= within
    for full in flags:
        if full is not None:
            compared &= ~full
    return compared


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


def _verdict(eyes: Mapping[AnyEye, EyeComparison], depth: DepthComparison | None, limits: Limits) -> Verdict:
    if depth is None:
        return next(iter(eyes.values())).verdict
    verdicts = {f"{eye} eye": result.verdict for eye, result in eyes.items()}
    return together({**verdicts, "both eyes": judge(Evidence(eyes=depth.evidence), limits)})


def measure_eyes(eyes: Mapping[AnyEye, EyeComparison], options: CompareOptions, step: Progress) -> MeasureTable | None:
    """Return the measures that were asked for, None for none: of the pixels that count, with one white for both eyes.

    Raises
    ------
    StimulusError
        If a measure cannot take these pictures.
    """
    if not options.measures or options.viewing is None:
        return None
    white = np.array(next(iter(eyes.values())).table.white_XYZ)
    viewing = replace(options.viewing, lab_white_XYZ=white, observer=options.reading.seen_by)
    pairs = {eye: PicturePair(one.photo, one.rendering, *(one.masks or ())) for eye, one in eyes.items()}
    return measure_pairs(pairs, options.measures, viewing, map_longest_px=LONGEST_PX, progress=step)


def usable_pixels(pair: EyePair) -> Mask:
    """Return where both pictures of a pair can be used, (height, width): within the rendering, and not saturated."""
    usable = pair.within.copy()
    for full in (pair.photo.saturated, pair.saturated):
        if full is not None:
            usable &= ~full
    return usable
