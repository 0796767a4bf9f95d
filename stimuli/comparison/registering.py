"""Bring a rendering onto its photograph: shifted, turned, larger, or between four corners.

A first guess comes from four corners, from one shift for the whole (phase correlation), or, where that fails, from
features that both have, at any angle [Lowe2004]. Then squares spread over the picture are registered each on its own
to a fraction of a pixel, and a shift, or a similarity if the squares ask for one, is fitted to their displacements.
The displacements that are left afterwards give the residual.

Of two eyes, which shows which view is found first: exchanged eyes are changed back, so that all else can be compared.
An eye that fits nowhere, because its depth is another, lies where the other eye does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from devices.eyes import AnyEye
from documents import Finding, in_threads
from documents.arrays import Floats
from documents.text import significant
from stimuli.align.homography import homography_from_points, mapped
from stimuli.comparison.alignment import STILL_PX, Alignment, resample, resample_flags
from stimuli.comparison.areas import inside, window
from stimuli.comparison.by_region import Side, check_charts
from stimuli.comparison.depth import DepthComparison, common_movement, compare_depth, exchanged, which_eyes
from stimuli.comparison.displacements import (
    LEAST_SQUARES,
    SquareShifts,
    blur_px,
    fit_similarity,
    guess_alignment,
    measure_squares,
    middle,
    sizes_differ,
)
from stimuli.comparison.eye_identity import EyeIdentity
from stimuli.comparison.options import CompareOptions, RegistrationMode
from stimuli.comparison.pictures import EyeXYZ, PictureFile
from stimuli.comparison.regions import PlacedRegions, corner_pairs, place_regions
from stimuli.comparison.regions_file import RegionsFile
from stimuli.errors import StimulusError
from stimuli.pictures.rows import Mask, RowFile

# Called with what is being done, how much of it is done, and of how much.
Progress = Callable[[str, int, int], None]

# A region of which more lies beyond the rendering's edge is not compared.
_MOST_OUTSIDE = 0.05
# A rendering that is turned further is refused: it was made another way round.
MOST_TURN_DEG = 45.0
_ROUNDS = 5


@dataclass(frozen=True, eq=False, slots=True)
class EyePair:
    """Both views of one eye on the photograph's grid; ``within`` and the flags are bool (height, width)."""

    photo: EyeXYZ
    rendering: EyeXYZ
    moved: RowFile
    within: Mask
    saturated: Mask | None
    alignment: Alignment
    placed: PlacedRegions
    safe_cd_m2: tuple[float, float] | None
    step: Progress


def register_eye(
    photo: EyeXYZ,
    rendering: EyeXYZ,
    file: str,
    safe_cd_m2: tuple[float, float] | None,
    regions: RegionsFile,
    options: CompareOptions,
    step: Progress,
    known: Floats | None = None,
) -> EyePair:
    """Bring the rendering, of the file named, onto the photograph's grid.

    ``known`` (3, 3) is where it lies, if that is known.

    Raises
    ------
    StimulusError
        If it is not known closely enough where the rendering lies, if a chart lies another way round, or if a region
        lies outside or beyond the rendering's edge.
    """
    step("Registering", 0, 1)
    if known is None:
        alignment = _aligned(photo, rendering, file, regions, options)
    else:
        shifts = measure_squares(photo.xyz, rendering.xyz, known, blur_px(photo.xyz, rendering.xyz))
        still = photo.xyz.shape == rendering.xyz.shape and np.array_equal(known, np.eye(3))
        alignment = _alignment(known, "the other eye", shifts, None, photo.xyz.shape, moved=not still)
    step("Registering", 1, 1)
    height, width = photo.xyz.shape[:2]
    size = (width, height)
    moved, within = resample(rendering.xyz, alignment, size, partial(step, "Bringing to one grid"))
    full = None if rendering.saturated is None else resample_flags(rendering.saturated, alignment, size)
    placed = place_regions(regions, photo.xyz.shape)
    _refuse_outside(placed, within, regions.file)
    return EyePair(photo, rendering, moved, within, full, alignment, placed, safe_cd_m2, step)


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


def _aligned(photo: EyeXYZ, rendering: EyeXYZ, file: str, regions: RegionsFile, options: CompareOptions) -> Alignment:
    """Return where the rendering, read from ``file``, lies.

    Raises
    ------
    StimulusError
        If that is not known closely enough, or a chart lies another way round.
    """
    try:
        alignment = align(photo.xyz, rendering.xyz, options.register, _corners(photo, rendering, regions, options))
        _refuse_bad_alignment(alignment, file, regions, options.register)
    except StimulusError:
        _refuse_turned_charts(photo, rendering, regions)
        raise
    return alignment


def _corners(
    photo: EyeXYZ, rendering: EyeXYZ, regions: RegionsFile, options: CompareOptions
) -> tuple[Floats, Floats] | None:
    """Return four places or more of both pictures, counted from the middle of a pixel; None where none are needed."""
    sides = options.photo_corners_px, options.rendering_corners_px
    corners = None if None in sides else (np.array(sides[0]), np.array(sides[1]))
    if options.register == "corners" and corners is None:
        corners = corner_pairs(regions, photo.xyz.shape, rendering.xyz.shape)
        if corners is None:
            raise StimulusError(
                Finding(
                    "no corners are given for both pictures",
                    regions.file,
                    remedy="give 'corners' and 'rendering_corners', or add --photo-corners and --rendering-corners",
                )
            )
    # Regions count from the corner of a pixel, alignment from its middle.
    return None if corners is None else (corners[0] - 0.5, corners[1] - 0.5)


def _refuse_bad_alignment(alignment: Alignment, file: str, regions: RegionsFile, register: RegistrationMode) -> None:
    if abs(alignment.rotation_deg) > MOST_TURN_DEG:
        raise StimulusError(
            Finding(
                f"the rendering is turned by {alignment.rotation_deg:.1f}° against the photograph",
                file,
                remedy="turn it upright, or give corners",
            )
        )
    most = regions.limits.registration_residual_px
    if alignment.residual_px is not None and alignment.residual_px > most:
        where = "; ".join(alignment.sentences())
        raise StimulusError(
            Finding(
                f"photograph and rendering lie {significant(alignment.residual_px, 2)} px apart, more than {most:g} px"
                + (f": {where}" if where else ""),
                file,
                remedy="let them be registered with --register auto"
                if register == "none"
                else "check that they show the same; or raise the limit 'registration_residual_px'",
            )
        )


def _refuse_turned_charts(photo: EyeXYZ, rendering: EyeXYZ, regions: RegionsFile) -> None:
    """Refuse two pictures of one size that do not fit because a chart lies another way round."""
    if photo.xyz.shape != rendering.xyz.shape:
        return
    charts = place_regions(regions, photo.xyz.shape).charts
    sides: tuple[tuple[EyeXYZ, Side], ...] = ((photo, "photograph"), (rendering, "rendering"))
    for view, side in sides:
        try:
            check_charts(view.xyz, charts, side, view.saturated, regions.file)
        except StimulusError as error:
            # Pictures that do not fit may well show other colours where the chart should be: no reason by itself.
            turned = [finding for finding in error.findings if finding.message.startswith("the chart ")]
            if turned:
                raise StimulusError(turned) from None


def align(
    photo: RowFile, rendering: RowFile, register: RegistrationMode, corners: tuple[Floats, Floats] | None = None
) -> Alignment:
    """Return where ``rendering`` lies; ``corners`` are four places (4, 2) of either, for ``register`` "corners".

    Raises
    ------
    StimulusError
        If the sizes differ and ``register`` is "none", or the two cannot be aligned.
    """
    if register == "none":
        if photo.shape != rendering.shape:
            raise sizes_differ(
                photo, rendering, "let them be registered (--register auto or corners), or crop them alike"
            )
        still = np.eye(3)
        return _alignment(
            still,
            "as they are",
            measure_squares(photo, rendering, still, blur_px(photo, rendering)),
            None,
            photo.shape,
            moved=False,
        )
    if register == "corners":
        if corners is None:
            raise StimulusError(Finding("no corners are given", remedy="give --photo-corners and --rendering-corners"))
        return _refined(photo, rendering, homography_from_points(*corners), "corners")
    return _refined(photo, rendering, *guess_alignment(photo, rendering))


def _refined(photo: RowFile, rendering: RowFile, matrix: Floats, start: str) -> Alignment:
    """Fit a shift, or a similarity, to the squares until they ask for no more."""
    errors: Floats | None = None
    turned = start != "shift"
    if photo.shape == rendering.shape and _reach(matrix, photo.shape) < STILL_PX:
        matrix = np.eye(3)
    blur = blur_px(photo, rendering)
    shifts = measure_squares(photo, rendering, matrix, blur)
    for _ in range(_ROUNDS):
        if len(shifts.middle_px) < LEAST_SQUARES:
            break
        fit = fit_similarity(shifts, photo.shape)
        turned = turned or fit.turns(photo.shape)
        step, errors = fit.matrix(turned, photo.shape), fit.errors(turned)
        if _reach(step, photo.shape) < STILL_PX / 4:
            break
        candidate = np.asarray(matrix @ step)
        measured = measure_squares(photo, rendering, candidate, blur)
        before, after = shifts.residual_px, measured.residual_px
        if before is not None and (after is None or after > before):
            break
        matrix, shifts = candidate / candidate[2, 2], measured
    still = photo.shape == rendering.shape and _reach(matrix, photo.shape) < STILL_PX
    if still:
        # As good as where it was: nothing is interpolated.
        if not np.array_equal(matrix, np.eye(3)):
            shifts = measure_squares(photo, rendering, np.eye(3), blur)
        matrix = np.eye(3)
    return replace(_alignment(matrix, start, shifts, errors, photo.shape, moved=not still), blur_px=blur)


def _alignment(
    matrix: Floats, start: str, shifts: SquareShifts, errors: Floats | None, shape: tuple[int, ...], *, moved: bool
) -> Alignment:
    centre = middle(shape)
    step = 0.5
    across = mapped(matrix, centre + [step, 0]) - mapped(matrix, centre - [step, 0])
    down = mapped(matrix, centre + [0, step]) - mapped(matrix, centre - [0, step])
    shift = mapped(matrix, centre) - centre
    if not moved and len(shifts.middle_px) >= LEAST_SQUARES:
        fit = fit_similarity(shifts, shape)
        shift = np.where(np.abs(fit.values[:2]) > 0, fit.values[:2], shift)
        errors = fit.errors(True)
        rotation = float(np.degrees(fit.values[3])) if fit.turns(shape) else 0.0
        scale = 1.0 + (float(fit.values[2]) if fit.turns(shape) else 0.0)
    else:
        rotation = float(np.degrees(np.arctan2(across[1] - down[0], across[0] + down[1])))
        scale = float(np.sqrt(abs(across[0] * down[1] - across[1] * down[0])))
    # The angle of a matrix is that of where things lie; an angle of rounding errors is none.
    rotation = 0.0 if abs(rotation) < 1e-9 else rotation
    return Alignment(
        matrix,
        start,
        (float(shift[0]), float(shift[1])),
        None if errors is None else (float(errors[0]), float(errors[1])),
        rotation,
        None if errors is None or not np.isfinite(errors[3]) else float(np.degrees(errors[3])),
        1.0 if abs(scale - 1.0) < 1e-9 else scale,
        shifts.residual_px,
        len(shifts.middle_px),
        shifts.of,
        moved,
    )


def _reach(matrix: Floats, shape: tuple[int, ...]) -> float:
    """Return how far ``matrix`` moves the corner that it moves farthest."""
    height, width = shape[:2]
    corners = np.array([[0.0, 0.0], [width - 1, 0.0], [0.0, height - 1], [width - 1, height - 1]])
    return float(np.abs(mapped(matrix, corners) - corners).max())


def register_eyes(
    photo: PictureFile, rendering: PictureFile, regions: RegionsFile, options: CompareOptions, step: Progress
) -> tuple[PictureFile, dict[AnyEye, EyePair], DepthComparison | None]:
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
    photo: PictureFile,
    rendering: PictureFile,
    pairs: dict[AnyEye, EyePair],
    refused: dict[AnyEye, StimulusError],
    regions: RegionsFile,
    options: CompareOptions,
    step: Progress,
) -> tuple[PictureFile, dict[AnyEye, EyePair], dict[AnyEye, StimulusError], EyeIdentity | None]:
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


def _brought(rendering: PictureFile, pairs: Mapping[AnyEye, EyePair]) -> PictureFile:
    """Return the rendering as it was brought to the photograph's grid."""
    return replace(rendering, views={eye: EyeXYZ(pair.moved, None) for eye, pair in pairs.items()})


def _registered(
    photo: PictureFile,
    rendering: PictureFile,
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
