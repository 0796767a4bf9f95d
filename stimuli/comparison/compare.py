"""One photograph and one rendering, eye by eye: registered, compared in numbers and as the eye resolves, and judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from documents import Finding
from stimuli.comparison.compare_regions import ComparedRegions
from stimuli.comparison.depth import DisparityPair, disparity_pair
from stimuli.comparison.evidence import Evidence
from stimuli.comparison.limits import Limits
from stimuli.comparison.luminance_factor import luminance_factor
from stimuli.comparison.one_eye import Registered, Step, judge_eye, register_eye
from stimuli.comparison.pictures import Eye, Picture
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.results import Comparison, EyeComparison, Wishes
from stimuli.comparison.verdict import Verdict, judge, together
from stimuli.errors import StimulusError


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
    both: dict[Eye, Registered] = {}
    for eye, view in photo.views.items():
        told = _named(step, "" if eye == "both" else f", {eye} eye")
        both[eye] = register_eye(
            view, rendering.views[eye], str(rendering.file), photo.safe_cd_m2, regions, wishes, told
        )
    tables = _tables(both, regions, wishes)
    eyes = {eye: judge_eye(one, tables[eye], regions, wishes) for eye, one in both.items()}
    pair = None
    if "left" in photo.views:
        step("Measuring disparity", 0, 2)
        pair = disparity_pair(photo, rendering)
        step("Measuring disparity", 2, 2)
    verdict = _all(eyes, pair, regions.limits)
    return Comparison(photo, rendering, eyes, pair, verdict, regions.file, wishes, settings or {})


def _tables(both: Mapping[Eye, Registered], regions: RegionsFile, wishes: Wishes) -> dict[Eye, ComparedRegions]:
    """Return what regions differ by for each eye, with one white and one luminance factor for both."""
    tables: dict[Eye, ComparedRegions] = {}
    white = None
    for eye, one in both.items():
        tables[eye] = one.regions(regions, wishes, white)
        if white is not None:
            tables[eye] = replace(tables[eye], said=(*tables[eye].said, "white is that of the left eye"))
        white = np.array(tables[eye].table.white_XYZ)
    mode = regions.spec.luminance
    if mode == "absolute" or len(both) == 1:
        return tables
    rows = [row for found in tables.values() for row in found.table.compared]
    if not rows:
        return tables
    factor = luminance_factor(
        [row.photo.luminance_cd_m2 for row in rows], [row.rendering.luminance_cd_m2 for row in rows]
    ).of(mode)
    return {
        eye: replace(tables[eye], table=one.regions(regions, wishes, white, factor).table) for eye, one in both.items()
    }


def _named(step: Step, name: str) -> Step:
    return lambda what, done, of: step(what + name, done, of)


def _all(eyes: Mapping[Eye, EyeComparison], pair: DisparityPair | None, limits: Limits) -> Verdict:
    if pair is None:
        return next(iter(eyes.values())).verdict
    verdicts = {f"{eye} eye": one.verdict for eye, one in eyes.items()}
    return together({**verdicts, "both eyes": judge(Evidence(disparity=pair.evidence), limits)})
