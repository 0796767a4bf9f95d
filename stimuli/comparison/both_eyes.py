"""Both eyes of a rendering on the photograph's grid, and what two eyes see of both.

Which eye shows which view is found first: exchanged eyes are changed back, so that all else can be compared. An eye
that fits nowhere, because its depth is another, lies where the other eye does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from devices.eyes import AnyEye
from documents import in_threads
from documents.arrays import Floats
from stimuli.comparison.depth import DepthComparison, common_movement, compare_depth, exchanged, which_eyes
from stimuli.comparison.eye_identity import EyeIdentity
from stimuli.comparison.pictures import EyeView, Picture
from stimuli.comparison.regions import place_regions
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.registering import EyePair, Progress, register_eye
from stimuli.comparison.results import CompareOptions
from stimuli.errors import StimulusError


def register_eyes(
    photo: Picture, rendering: Picture, regions: RegionsFile, options: CompareOptions, step: Progress
) -> tuple[Picture, dict[AnyEye, EyePair], DepthComparison | None]:
    """Return the rendering, each eye's views on one grid, and the depth of both; none of a single picture.

    The rendering's eyes are changed back if they are exchanged.

    Raises
    ------
    StimulusError
        If an eye cannot be registered, and nothing in its depth explains it.
    """
    if "both" in photo.views:
        pairs, _ = _registered(photo, rendering, regions, options, step)
        return rendering, pairs, None
    step("Identifying eyes", 0, 1)
    identity = which_eyes(photo, rendering)
    if identity is not None and identity.way == "exchanged":
        rendering = exchanged(rendering)
    pairs, refused = _registered(photo, rendering, regions, options, step)
    if identity is None or identity.way is None:
        # A rendering that is turned is identified once it was brought onto the photograph, one way or the other.
        rendering, pairs, refused, identity = _identified(photo, rendering, pairs, refused, regions, options, step)
    step("Measuring disparity", 0, 2)
    movement = common_movement([pair.alignment for pair in pairs.values()], identity)
    placed = place_regions(regions, photo.views["left"].xyz.shape).regions
    depth = compare_depth(photo, rendering, movement, identity, placed, regions.limits)
    step("Measuring disparity", 2, 2)
    if refused:
        if not depth.fails(regions.limits):
            raise next(iter(refused.values()))
        pairs, _ = _registered(photo, rendering, regions, options, step, depth.matrix, pairs)
    return rendering, pairs, depth


def _identified(
    photo: Picture,
    rendering: Picture,
    pairs: dict[AnyEye, EyePair],
    refused: dict[AnyEye, StimulusError],
    regions: RegionsFile,
    options: CompareOptions,
    step: Progress,
) -> tuple[Picture, dict[AnyEye, EyePair], dict[AnyEye, StimulusError], EyeIdentity | None]:
    """Return the rendering with its eyes as they should be, and which they were, by the views as they were brought."""
    if refused and len(refused) < len(photo.views):
        return rendering, pairs, refused, None
    identity = None if refused else which_eyes(photo, _brought(rendering, pairs))
    if not refused and (identity is None or identity.way != "exchanged"):
        return rendering, pairs, refused, identity
    changed = exchanged(rendering)
    others, others_refused = _registered(photo, changed, regions, options, step)
    if others_refused:
        return rendering, pairs, refused, None
    identity = which_eyes(photo, exchanged(_brought(changed, others)))
    if identity is None or identity.way != "exchanged":
        return rendering, pairs, refused, None
    return changed, others, {}, identity


def _brought(rendering: Picture, pairs: Mapping[AnyEye, EyePair]) -> Picture:
    """Return the rendering as it was brought to the photograph's grid."""
    return replace(rendering, views={eye: EyeView(pair.moved, None) for eye, pair in pairs.items()})


def _registered(
    photo: Picture,
    rendering: Picture,
    regions: RegionsFile,
    options: CompareOptions,
    step: Progress,
    known: Floats | None = None,
    before: Mapping[AnyEye, EyePair] | None = None,
) -> tuple[dict[AnyEye, EyePair], dict[AnyEye, StimulusError]]:
    """Return both views of each eye on one grid, and why those of an eye of two could not be brought there.

    Both eyes are registered side by side. Those in ``before`` are taken from there; the others lie where ``known``
    (3, 3) takes them, if it is given.

    Raises
    ------
    StimulusError
        If a single picture cannot be registered, or an eye cannot although its place is known.
    """
    pairs, refused = dict(before or {}), dict[AnyEye, StimulusError]()
    file, safe = str(rendering.file), photo.safe_cd_m2

    def register(eye: AnyEye) -> EyePair | StimulusError:
        named = _named(step, "" if eye == "both" else f", {eye} eye")
        views = photo.views[eye], rendering.views[eye]
        try:
            return register_eye(*views, file, safe, regions, options, named, known)
        except StimulusError as error:
            if eye == "both" or known is not None:
                raise
            return error

    eyes = [eye for eye in photo.views if eye not in pairs]
    for eye, found in zip(eyes, in_threads(register, eyes), strict=True):
        if isinstance(found, StimulusError):
            refused[eye] = found
        else:
            pairs[eye] = found
    return {eye: pairs[eye] for eye in photo.views if eye in pairs}, refused


def _named(step: Progress, name: str) -> Progress:
    return lambda what, done, of: step(what + name, done, of)
