"""What can stand between the codes of a program and the light of a panel, for the simulated instrument.

Some change the codes on their way: a compositor that converts colours, a cable with codes 16 to 235, a panel of six
bits. Others change the light with what else is in the picture: a backlight that follows it, a supply that limits it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.colour.adaptation import bradford_matrix
from devices.colour.spaces import rgb_to_xyz_matrix
from devices.colour.srgb_encoding import D65_XY, SRGB_PRIMARIES_XY, srgb_decoded
from devices.display.model import DisplayModel
from devices.patches.patch import Patch

Floats = NDArray[np.float64]
_LOW, _HIGH, _FULL = 16.0, 235.0, 255.0
_ASSUMED_GAMMA = 2.2
# The backlight has gone so far of its way back when a patch is read after another one.
_BEFORE_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class SignalFaults:
    """The faults between codes and light; see `devices.instruments.simulated.Faults` for each."""

    compositor: float = 0.0
    stretched_range: float = 0.0
    squeezed_range: float = 0.0
    panel_bits: float = 0.0
    frame_rate_control: float = 0.0
    white_segment: float = 0.0
    dynamic_contrast: float = 0.0
    picture_level_limit: float = 0.0
    stray_light: float = 0.0


def codes_at_panel(codes: Floats, faults: SignalFaults, model: DisplayModel) -> Floats:
    """Return the codes that drive the panel, shape (..., 3), for those that a program sends."""
    arrived = codes if not faults.compositor else composited(codes, model)
    if faults.stretched_range:
        arrived = np.clip((_FULL * arrived - _LOW) / (_HIGH - _LOW), 0.0, 1.0)
    if faults.squeezed_range:
        arrived = np.round(_LOW + (_HIGH - _LOW) * arrived) / _FULL
    if faults.stretched_range:
        arrived = np.round(_FULL * arrived) / _FULL
    if faults.panel_bits:
        step = 2.0 ** (8.0 - faults.panel_bits)
        whole = np.round(_FULL * arrived)
        # Frames in turn give the mean between two levels, and nothing above the last level.
        shown = np.minimum(whole, 256.0 - step) if faults.frame_rate_control else step * np.floor(whole / step)
        arrived = shown / (256.0 - step)
    return np.asarray(arrived)


def composited(codes: Floats, model: DisplayModel) -> Floats:
    """Return codes of sRGB as a compositor converts them to ``model``'s primaries, taking its curve for gamma 2.2."""
    matrix = srgb_to_display(model)
    linear = srgb_decoded(codes)
    return np.asarray(np.clip(linear @ matrix.T, 0.0, 1.0) ** (1.0 / _ASSUMED_GAMMA))


def srgb_to_display(model: DisplayModel) -> Floats:
    """Return what brings linear sRGB to the linear light of ``model``'s channels, white to white, shape (3, 3)."""
    primaries = model.primaries_XYZ_cd_m2
    white = primaries.sum(axis=1)
    of_srgb = rgb_to_xyz_matrix(*SRGB_PRIMARIES_XY, D65_XY)
    adapted = bradford_matrix(of_srgb.sum(axis=1), white / white[1]) @ of_srgb
    return np.asarray(np.linalg.solve(primaries / white[1], adapted))


def between_levels(codes: Floats, faults: SignalFaults) -> bool:
    """Return whether some channel's code lies between two levels of the panel, so that frames alternate."""
    step = 2.0 ** (8.0 - faults.panel_bits)
    return bool(np.any(np.round(_FULL * codes) % step))


def share_with_picture(
    codes: Floats, patch: Patch | None, faults: SignalFaults, model: DisplayModel
) -> tuple[float, Floats]:
    """Return the share of its light that a patch keeps in its picture, and the stray light beside it, XYZ, (3,)."""
    area = 1.0 if patch is None else patch.filled
    around = codes if patch is None or area == 1.0 else np.array(patch.surround)
    brightest = max(float(codes.max()), float(around.max()))
    if patch is not None and patch.before is not None:
        brightest = max(brightest, _BEFORE_SHARE * max(patch.before))
    share = 1.0 - faults.dynamic_contrast * (1.0 - brightest)
    beside = model.xyz(around) if area < 1.0 and (faults.picture_level_limit or faults.stray_light) else np.zeros(3)
    if faults.picture_level_limit:
        white = float(model.xyz(np.ones(3))[1])
        level = (area * float(model.xyz(codes)[1]) + (1.0 - area) * float(beside[1])) / white
        share *= min(1.0, (1.0 - faults.picture_level_limit) / max(level, 1e-12))
    return share, np.asarray(faults.stray_light * (1.0 - area) * share * beside)
