"""The error budget of a rig or an experiment: what each step from a picture's file to the eye costs in ΔE00.

A rig's is of a smooth scene of which the light of every pixel is known. An experiment's is of its own pictures: every
n-th pixel across and down, so many that there are at most `MOST_COLOURS` of each. What happened before these were
built, half floats and resampling, cannot be seen in them any more; it is that of the scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import count

import numpy as np

from devices.budget import (
    BudgetPath,
    Encoding,
    ErrorBudget,
    Mixed,
    OwnPixels,
    Pair,
    PathStep,
    SmoothScene,
    StepCost,
    joined_differences,
)
from devices.compensation import Compensation, Correction
from devices.display import EYES, Eye, Rig, entries_for
from documents.arrays import Floats
from runner.presenter.depth import highest_code
from runner.presenter.modes.mode import Mode
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from stimuli.pictures import StereoImage, resample_picture

SCENE_PX = (192, 128)
# Pixels of a picture for each pixel of the display, before it is resampled.
RESOLUTION = 2.5
MOST_COLOURS = 20_000
_OF_THE_SCENE = (PathStep.HALF_FLOATS, PathStep.RESAMPLING)


def rig_budget(rig: Rig, encoding: Encoding | None = None) -> ErrorBudget:
    """Return the error budget of ``rig`` for a smooth scene over the whole panel.

    Parameters
    ----------
    rig
        The rig, as `devices.display.read_rig` gives it.
    encoding
        How light becomes codes; None as the presenter does it on this rig.

    Returns
    -------
    ErrorBudget
        Mean, 95th percentile and largest ΔE00 of each step for each eye.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_rig
    >>> budget = rig_budget(read_rig(Path("configs/rigs/asus_vg248qe_3dvision.yaml")))
    >>> bool(budget.row(PathStep.CODES).eyes["left"].mean < 0.2), budget.row(PathStep.CROSSTALK).words
    (True, 'not measured')
    """
    mode = find_mode(rig.mode, ModeOptions.parse(rig.spec.mode_options))
    compensation = _compensation(rig, mode)
    scene = _scene(rig)
    asked = _flattened(scene)
    if rig.spec.lift_black:
        compensation = compensation.lifted_for([(scene["left"].astype(np.float32), scene["right"].astype(np.float32))])
    path = _path(rig, compensation, encoding, _gains_over_the_panel(rig))
    differences = path.differences(asked, _flattened(_resampled(rig)))
    return _budget(rig, mode, f"{len(asked['left'])} colours of a smooth scene, in the display's gamut", differences)


def picture_budget(
    rig: Rig,
    compensation: Compensation,
    pictures: Iterator[StereoImage],
    places_px: Sequence[tuple[int, int]] = (),
    encoding: Encoding | None = None,
) -> ErrorBudget:
    """Return the error budget of ``rig`` for ``pictures`` as they were built, at least one.

    ``compensation`` is what is done to the pictures, lift included; where a gain map makes it depend on the place, each
    picture is taken at each of ``places_px``.
    """
    parts, number = [], 0
    for image in pictures:
        number += 1
        every = next(n for n in count(1) if -(-image.height_px // n) * -(-image.width_px // n) <= MOST_COLOURS)
        asked = {eye: image.eye(eye)[::every, ::every].astype(np.float64).reshape(-1, 3) for eye in EYES}
        for place in (places_px or ((0, 0),)) if rig.gain_map else ((0, 0),):
            gains = _gains_at(rig, compensation, (image.width_px, image.height_px), place, every)
            parts.append(_path(rig, compensation, encoding, gains).differences(asked))
    scene = _path(rig, compensation, encoding, None).differences(_flattened(_scene(rig)), _flattened(_resampled(rig)))
    differences = {**joined_differences(parts), **{step: scene[step] for step in _OF_THE_SCENE}}
    colours = f"{len(differences[PathStep.CODES]['left'])} colours of {number} pictures"
    mode = find_mode(rig.mode, ModeOptions.parse(rig.spec.mode_options))
    return _budget(rig, mode, colours, differences, ", of a smooth scene: the pictures hold it already")


def _compensation(rig: Rig, mode: Mode) -> Compensation:
    correction = Correction(rig.crosstalk, rig.gain_map)
    return mode.compensation(rig.models, rig.display.panel.resolution_px, correction)


def _path(rig: Rig, compensation: Compensation, encoding: Encoding | None, gains: Floats | None) -> BudgetPath:
    levels, dithered = highest_code(rig.output_bits), rig.spec.dither != "none"
    encoding = encoding or Encoding(levels, entries_for(levels, dithered=dithered), dithered)
    if compensation.mixture is not None:
        return Mixed(rig.models, compensation.mixture, encoding)
    return OwnPixels(rig.models, encoding, compensation.correction, gains)


def _scene(rig: Rig) -> dict[Eye, Floats]:
    return {eye: SmoothScene(rig.models, SCENE_PX).view(eye, SCENE_PX) for eye in EYES}


def _resampled(rig: Rig) -> dict[Eye, Floats]:
    """Return the scene as it comes out of a picture of `RESOLUTION` times its pixels."""
    pixels = int(RESOLUTION * SCENE_PX[0]), int(RESOLUTION * SCENE_PX[1])
    left, right = (SmoothScene(rig.models, SCENE_PX).view(eye, pixels).astype(np.float32) for eye in EYES)
    image = resample_picture(StereoImage(left, right), (float(SCENE_PX[0]), float(SCENE_PX[1])), 1.0)
    return {eye: image.eye(eye).astype(np.float64) for eye in EYES}


def _flattened(views: Mapping[Eye, Floats]) -> Pair:
    return {eye: view.reshape(-1, 3) for eye, view in views.items()}


def _gains_over_the_panel(rig: Rig) -> Floats | None:
    """Return the gains where the scene's pixels stand when it covers the whole panel."""
    if rig.gain_map is None:
        return None
    axes = zip(SCENE_PX, rig.display.panel.resolution_px, strict=True)
    x_px, y_px = ((np.arange(pixels) + 0.5) * (length / pixels) for pixels, length in axes)
    return rig.gain_map.over(x_px, y_px).ravel()


def _gains_at(
    rig: Rig, compensation: Compensation, size_px: tuple[int, int], place_px: tuple[int, int], every: int
) -> Floats | None:
    if rig.gain_map is None:
        return None
    x_px, y_px = compensation.views["left"].pixel_grid(size_px, place_px).axes(size_px)
    return rig.gain_map.over(x_px[::every], y_px[::every]).ravel()


def _budget(
    rig: Rig, mode: Mode, colours: str, differences: Mapping[PathStep, Mapping[Eye, Floats]], before: str = ""
) -> ErrorBudget:
    stated = {eye: StepCost(errors.mean, errors.p95, errors.max) for eye, errors in rig.held_out.items()}
    return ErrorBudget.of(
        colours,
        differences,
        dict(_words(rig, mode, before)),
        {PathStep.CHARACTERISATION: stated} if len(stated) == len(EYES) else {},
    )


def _words(rig: Rig, mode: Mode, before: str) -> Iterator[tuple[PathStep, str]]:
    """Give each step that there is on this rig, and what is to be said of it."""
    mixed = mode.mixture(rig.models) is not None
    bits = rig.output_bits
    yield PathStep.HALF_FLOATS, f"OpenEXR keeps 11 bits of X, Y and Z{before}"
    yield PathStep.RESAMPLING, f"from {RESOLUTION:g} pixels of a picture to one of the display{before}"
    yield PathStep.GAMUT_CLIP, "to what the display can show in the dark" if not mixed else "of the mixed light"
    lit = any(rig.models.eye(eye).ambient_XYZ_cd_m2.any() for eye in EYES)
    if not (lit and mixed):
        yield PathStep.AMBIENT_LIGHT, "nothing is darker than the room's light" if lit else "not measured"
    if mixed:
        yield PathStep.FILTERS, "three channels for two eyes, if nothing were clipped"
    elif rig.mode != "flat":
        lift = ", black lifted" if rig.spec.lift_black else ""
        yield PathStep.CROSSTALK, f"what cannot be cancelled{lift}" if rig.crosstalk else "not measured"
    if not mixed:
        gain_map = rig.gain_map
        words = (
            f"evened out, {100 * gain_map.luminance_lost:.1f} % of the luminance apart" if gain_map else "not measured"
        )
        yield PathStep.GAIN_MAP, words
    yield PathStep.LOOK_UP_TABLE, "the colour pass's tables in 32 bits"
    dithered = f"dithered to codes of {bits} bits, mean over 64 x 64 pixels"
    yield PathStep.CODES, f"rounded to codes of {bits} bits" if rig.spec.dither == "none" else dithered
    if rig.nominal:
        yield PathStep.CHARACTERISATION, f"not measured: nominal {rig.nominal.name}"
    else:
        known = len(rig.held_out) == len(EYES)
        borrowed = "" if rig.is_characterised else f", of the mode '{rig.characterised_as}'"
        yield (
            PathStep.CHARACTERISATION,
            f"held-out readings{borrowed}" if known else "the display file does not state it",
        )
    halved = "" if mode.areas((2, 2))[0].squeeze == (1, 1) else " and without the detail that half a signal loses"
    yield PathStep.TOGETHER, f"without the characterisation{halved}"
