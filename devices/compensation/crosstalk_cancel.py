"""Cancel crosstalk within what a display can show, and report what was left.

Light is counted from that of code 0, as readings of crosstalk are: black on black is what is taken off them. A channel
cannot give less than that, so that a dark place opposite a bright one keeps a ghost. Per pixel:

1. each eye's picture becomes light in units of its own display's primaries, clipped to what the channels can give;
2. the six equations of `devices.display.crosstalk`, written in that light, give what to send to both eyes;
3. what is sent is clipped to what the channels can give;
4. each eye's light is computed once more against the *clipped* light of the other eye, and clipped. Without this step
   an eye would be given light to make up for a negative ghost that never comes. What remains beside the ghost itself
   is smaller by the square of the leak.

Lifting adds the same share of each eye's white to every pixel of both eyes, so that there is light to subtract from.
Nothing is scaled down for it: what lay close to white may then be clipped there. Where channels do not add up (see
`devices.display.plvc`) light is clipped by way of each channel's own, and black cannot be lifted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.display.crosstalk import Crosstalk
from devices.display.display_file import EyeModels
from devices.display.model import DisplayModel, refuse_lift
from devices.errors import DeviceError
from documents.arrays import Floats


@dataclass(frozen=True, slots=True)
class CancelCost:
    """What one eye's picture keeps of the other's.

    ``negative``: pixels that would have needed a channel to give less light than it can. ``above_full``: pixels that
    would have needed more, beyond what the gamut clip took, for the lift or otherwise. ``worst_residual_cd_m2``: the
    largest difference in X, Y or Z from what the eye would see of the same picture, lifted as asked, without crosstalk.
    ``delta_e_00_*``: what the eye sees against what was asked, gamut clip and lift included; Lab is relative to the
    eye's white.
    """

    pixels: int
    negative: int
    above_full: int
    worst_residual_cd_m2: float
    delta_e_00_mean: float
    delta_e_00_max: float

    @property
    def percent_negative(self) -> float:
        """``negative`` as a percentage of all pixels."""
        return 100.0 * self.negative / self.pixels if self.pixels else 0.0

    def to_json(self) -> dict[str, float]:
        """Return percentages and costs under plain names."""
        return {
            "percent_negative": round(self.percent_negative, 4),
            "percent_above_full": round(100.0 * self.above_full / self.pixels if self.pixels else 0.0, 4),
            "worst_residual_cd_m2": round(self.worst_residual_cd_m2, 5),
            "delta_e_00_mean": round(self.delta_e_00_mean, 5),
            "delta_e_00_max": round(self.delta_e_00_max, 4),
        }


@dataclass(frozen=True, eq=False, slots=True)
class CancelledLight:
    """What to send to each eye, light in units of its model's primaries, shape (..., 3), and what it cost.

    Where channels add up, that is the linear light of each, as a share of full.
    """

    left_linear: Floats
    right_linear: Floats
    lift_share: float
    left: CancelCost
    right: CancelCost


def channel_crosstalk(models: EyeModels, crosstalk: Crosstalk) -> Crosstalk:
    """Return ``crosstalk`` between the channels' linear light instead of XYZ: what a shader needs.

    The left matrix takes the right eye's linear RGB to the linear RGB that it adds to the left eye's, and so on.

    Parameters
    ----------
    models
        What each eye sees of the display.
    crosstalk
        What leaks into each eye, in XYZ.

    Returns
    -------
    Crosstalk
        Matrices, shape (3, 3), from one eye's linear RGB to the other's, without unit.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> mix = channel_crosstalk(models, Crosstalk(0.02 * np.eye(3), 0.01 * np.eye(3)))
    >>> np.allclose(mix.left, 0.02 * np.eye(3)), np.allclose(mix.right, 0.01 * np.eye(3))
    (True, True)
    """
    left, right = models.left, models.right
    return Crosstalk(
        left.linear_from_XYZ @ crosstalk.left @ right.primaries_XYZ_cd_m2,
        right.linear_from_XYZ @ crosstalk.right @ left.primaries_XYZ_cd_m2,
    )


def cancel_crosstalk(
    models: EyeModels,
    crosstalk: Crosstalk,
    left_XYZ: ArrayLike,
    right_XYZ: ArrayLike,
    lift_share: float = 0.0,
    *,
    half: bool = False,
) -> CancelledLight:
    """Return what to send so that the eyes see ``left_XYZ`` and ``right_XYZ``, cd/m², same shape (..., 3).

    ``lift_share`` is the share of each eye's white (code 1, above code 0) that is added to every pixel; see
    `needed_lift`.

    Parameters
    ----------
    models
        What each eye sees of the display.
    crosstalk
        What leaks into each eye, in XYZ.
    left_XYZ, right_XYZ
        What each eye should see, XYZ in cd/m², the same shape (..., 3).
    lift_share
        Share of each eye's white that is added to every pixel, in 0..1.
    half
        Whether half floats held them, whose rounding is not counted as light below or above what channels give.

    Returns
    -------
    CancelledLight
        Linear light to send to each eye, shape (..., 3), and what each eye's picture keeps of the other's.

    Raises
    ------
    DeviceError
        If the shapes differ, a value is not finite, the lift is not in 0..1, or there is one for channels that do not
        add up.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> white = models.left.white_XYZ_cd_m2
    >>> leaks = Crosstalk(0.02 * np.eye(3), 0.02 * np.eye(3))
    >>> done = cancel_crosstalk(models, leaks, [0.5 * white, 0.5 * white], [0.4 * white, 0.0 * white])
    >>> done.left.percent_negative, done.right.percent_negative
    (0.0, 50.0)
    """
    if lift_share > 0.0:
        refuse_lift(models)
    if not 0.0 <= lift_share <= 1.0:
        raise DeviceError(f"the lift is {lift_share}; it must be a share of white in 0..1")
    shown = models.normalised
    lifted_left = _in_gamut(shown.left, left_XYZ) + lift_share
    lifted_right = _in_gamut(shown.right, right_XYZ) + lift_share
    wanted_left, wanted_right = _clip(shown.left, lifted_left), _clip(shown.right, lifted_right)
    mix = channel_crosstalk(shown, crosstalk)
    left, right = mix.solve(wanted_left, wanted_right)
    needed_left = wanted_left - _clip(shown.right, right) @ mix.left.T
    needed_right = wanted_right - _clip(shown.left, left) @ mix.right.T
    left, right = _clip(shown.left, needed_left), _clip(shown.right, needed_right)
    seen_left, seen_right = mix.seen(left, right)
    off_left, off_right = (
        model.tolerance(xyz, half=half) for model, xyz in ((shown.left, left_XYZ), (shown.right, right_XYZ))
    )
    if half:  # what leaks from the other eye's picture is rounded with it
        off_left, off_right = off_left + off_right @ np.abs(mix.left.T), off_right + off_left @ np.abs(mix.right.T)
    return CancelledLight(
        _in_units_of(models.left, left),
        _in_units_of(models.right, right),
        lift_share,
        _cost(shown.left, left_XYZ, lifted_left, needed_left, seen_left, off_left),
        _cost(shown.right, right_XYZ, lifted_right, needed_right, seen_right, off_right),
    )


def needed_lift(models: EyeModels, crosstalk: Crosstalk, left_XYZ: ArrayLike, right_XYZ: ArrayLike) -> float:
    """Return the smallest share of white which, added to both pictures, leaves nothing of crosstalk to clip.

    Pictures as in `cancel_crosstalk`, with the same errors. Take the largest over all pictures of an experiment, so
    that all are lifted alike.

    Parameters
    ----------
    models
        What each eye sees of the display.
    crosstalk
        What leaks into each eye, in XYZ.
    left_XYZ, right_XYZ
        What each eye should see, XYZ in cd/m², the same shape (..., 3).

    Returns
    -------
    float
        The share of each eye's white, at least 0; 0 where no lift is needed.

    Raises
    ------
    DeviceError
        If a channel leaks more than it gives, so that adding light does not help, or channels do not add up.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> white = models.left.white_XYZ_cd_m2
    >>> leaks = Crosstalk(0.02 * np.eye(3), 0.02 * np.eye(3))
    >>> round(needed_lift(models, leaks, 0.5 * white, 0.0 * white), 2)
    0.01
    """
    refuse_lift(models)
    models = models.normalised
    mix = channel_crosstalk(models, crosstalk)
    wanted = _in_gamut(models.left, left_XYZ), _in_gamut(models.right, right_XYZ)
    lift = 0.0
    for model, light, gain in zip(
        (models.left, models.right), mix.solve(*wanted), mix.solve(np.ones(3), np.ones(3)), strict=True
    ):
        if np.any(gain <= 0):
            raise DeviceError("the eyes' white leaks so strongly that lifting the black level takes light away")
        if light.size:
            lift = max(lift, float(((model.limits[0] - light) / gain).max()))
    return lift


def seen_XYZ(
    models: EyeModels, crosstalk: Crosstalk | None, left_code: ArrayLike, right_code: ArrayLike
) -> tuple[Floats, Floats]:
    """Return what each eye sees, XYZ in cd/m² (..., 3), of device codes 0..1 in both eyes' pictures: the forward model.

    Raises
    ------
    DeviceError
        If the shapes differ or a code is not finite.
    """
    black = models.left.shown_black_XYZ_cd_m2, models.right.shown_black_XYZ_cd_m2
    sent = models.left.xyz(left_code) - black[0], models.right.xyz(right_code) - black[1]
    seen = crosstalk.seen(*sent) if crosstalk else sent
    return seen[0] + black[0], seen[1] + black[1]


def _in_units_of(model: DisplayModel, light: Floats) -> Floats:
    """Return light in units of the normalised model as light in units of ``model``."""
    if model.normalised is model:
        return light
    lowest, highest = model.limits
    return lowest + (highest - lowest) * light


def _clip(model: DisplayModel, linear: Floats) -> Floats:
    """Return light in units of the primaries, clipped to what the channels can give."""
    return model.light_of(np.clip(model.channels(linear), *model.limits))


def _in_gamut(model: DisplayModel, xyz_cd_m2: ArrayLike) -> Floats:
    """Return the light that the eye would be shown without crosstalk."""
    xyz = np.asarray(xyz_cd_m2, dtype=np.float64)
    if not np.all(np.isfinite(xyz)):
        raise DeviceError(f"{np.count_nonzero(~np.isfinite(xyz))} values of the picture are not finite numbers")
    return _clip(model, model.in_primaries(xyz))


def _cost(
    model: DisplayModel, asked_XYZ: ArrayLike, lifted: Floats, needed: Floats, seen: Floats, tolerance: Floats
) -> CancelCost:
    lowest, highest = model.limits
    asked = np.asarray(asked_XYZ, dtype=np.float64).reshape(-1, 3)
    channels = model.channels(needed)
    negative = (channels < lowest - tolerance).any(axis=-1)
    above = (np.maximum(channels, model.channels(lifted)) > highest + tolerance).any(axis=-1)
    residual = (seen - _clip(model, lifted)) @ model.primaries_XYZ_cd_m2.T
    white = model.white_XYZ_cd_m2
    shown = (model.dark_XYZ_cd_m2 + seen @ model.primaries_XYZ_cd_m2.T).reshape(-1, 3)
    changed = np.abs(shown - asked).max(axis=1, initial=0.0) > 1e-9 * white[1]
    # Lab is defined for light only: what lies below no light at all is as black as black.
    difference = delta_e_2000(
        xyz_to_lab(np.maximum(asked[changed], 0.0), white), xyz_to_lab(np.maximum(shown[changed], 0.0), white)
    )
    pixels = len(asked)
    return CancelCost(
        pixels=pixels,
        negative=int(negative.sum()),
        above_full=int(above.sum()),
        worst_residual_cd_m2=float(np.abs(residual).max(initial=0.0)),
        delta_e_00_mean=float(difference.sum() / pixels) if pixels else 0.0,
        delta_e_00_max=float(difference.max(initial=0.0)),
    )
