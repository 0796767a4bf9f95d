"""Compare a photograph with its rendering, eye by eye: in numbers, as the eye resolves them, and with a verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from documents import Finding
from stimuli.comparison.by_region import ComparedRegions
from stimuli.comparison.depth import DisparityPair, disparity_pair
from stimuli.comparison.evidence import Evidence
from stimuli.comparison.judging import judge
from stimuli.comparison.luminance import luminance_factor
from stimuli.comparison.one_eye import EyePair, Progress, judge_eye, register_eye
from stimuli.comparison.pictures import Eye, read_picture
from stimuli.comparison.regions_file import RegionsFile, read_regions
from stimuli.comparison.results import CompareOptions, Comparison, EyeComparison
from stimuli.comparison.verdict import Limits, Verdict, together
from stimuli.errors import StimulusError


def compare_pictures(
    photo: Path | str,
    rendering: Path | str,
    regions: RegionsFile | Path | str,
    options: CompareOptions | None = None,
    *,
    progress: Progress | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Comparison:
    """Compare a photograph with its rendering, and say whether the rendering is validated.

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
        Called with what is being done, how much of it is done, and of how much.
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
        grid closely enough, if a region lies outside, or a chart lies another way round.
    OSError
        If there is no room for temporary files: 12 bytes a pixel for each of three or four pictures.

    Examples
    --------
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from stimuli.comparison.compare import compare_pictures
    >>> from stimuli.pictures.exr.write import write_exr
    >>> from stimuli.pictures.stereo_image import StereoImage
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
    step = progress or _silent
    file = regions if isinstance(regions, RegionsFile) else read_regions(Path(regions))
    file = options.applied_to(file)
    reading = options.reading
    one = read_picture(Path(photo), reading, options.photo_holds, "photograph", partial(step, "Reading the photograph"))
    two = read_picture(
        Path(rendering), reading, options.rendering_holds, "rendering", partial(step, "Reading the rendering")
    )
    if set(one.views) != set(two.views):
        flat, stereo = ("photograph", "rendering") if "both" in one.views else ("rendering", "photograph")
        raise StimulusError(
            Finding(f"the {flat} is one picture and the {stereo} a pair for two eyes", remedy="give two of a kind")
        )
    pairs: dict[Eye, EyePair] = {}
    for eye, view in one.views.items():
        named = _named(step, "" if eye == "both" else f", {eye} eye")
        pairs[eye] = register_eye(view, two.views[eye], str(two.file), one.safe_cd_m2, file, options, named)
    tables = _tables(pairs, file, options)
    eyes = {eye: judge_eye(pair, tables[eye], file, options) for eye, pair in pairs.items()}
    disparity = None
    if "left" in one.views:
        step("Measuring disparity", 0, 2)
        disparity = disparity_pair(one, two)
        step("Measuring disparity", 2, 2)
    seen_at = options.viewing
    viewing = {} if seen_at is None else {"pixel_pitch_mm": seen_at.pixel_pitch_mm, "distance_mm": seen_at.distance_mm}
    record = {**viewing, **(settings or {})}
    return Comparison(one, two, eyes, disparity, _verdict(eyes, disparity, file.limits), file.file, options, record)


def _silent(what: str, done: int, of: int) -> None:
    """Report no progress."""


def _named(step: Progress, name: str) -> Progress:
    return lambda what, done, of: step(what + name, done, of)


def _tables(pairs: Mapping[Eye, EyePair], regions: RegionsFile, options: CompareOptions) -> dict[Eye, ComparedRegions]:
    """Return what regions differ by for each eye, with one white and one luminance factor for both."""
    tables: dict[Eye, ComparedRegions] = {}
    white = None
    for eye, pair in pairs.items():
        tables[eye] = pair.regions(regions, options, white)
        if white is not None:
            tables[eye] = replace(tables[eye], said=(*tables[eye].said, "white is that of the left eye"))
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
        eye: replace(tables[eye], table=pair.regions(regions, options, white, factor).table)
        for eye, pair in pairs.items()
    }


def _verdict(eyes: Mapping[Eye, EyeComparison], disparity: DisparityPair | None, limits: Limits) -> Verdict:
    if disparity is None:
        return next(iter(eyes.values())).verdict
    verdicts = {f"{eye} eye": result.verdict for eye, result in eyes.items()}
    return together({**verdicts, "both eyes": judge(Evidence(disparity=disparity.evidence), limits)})
