"""A camera model fitted to a chart: the matrix, what it gets wrong, and what was left out and why."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.camera.camera_model import CameraModel, Form
from devices.camera.correspondences import (
    Correspondences,
    PooledColours,
    check_black,
    check_determined,
    check_enough,
    pool,
    remarks,
    uneven,
)
from devices.camera.exposure import Exposure
from devices.camera.solve import Loss, design, find_outliers, left_out_xyz, solve, why
from devices.characterise.fit_numbers import Errors, errors_of
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.colour_matching import DEFAULT_OBSERVER, colorimetric_observer
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult

_COLOURS = ("red", "green", "blue")
_MOST_LEFT_OUT = 0.25
_MOST_MEDIAN = 10.0
_UNFIT = "the patches may be in another order than the reference, the picture not linear, or the light uneven"


@dataclass(frozen=True, slots=True, eq=False)
class FittedPatch(JsonResult):
    """One patch: what was seen, measured and estimated (3,), and its ΔE00 with all patches and left out itself.

    ``left_out_reason`` is empty for patches that the matrix was fitted to; the others have no ``held_out_delta_e``,
    since the fit never saw them. It is None too where the other patches do not determine the matrix.
    ``tested_luminance_cd_m2`` is the luminance that the patch's signal stands for at the model's exposure.
    """

    name: str
    rgb: Floats
    XYZ: Floats
    estimated_XYZ: Floats
    delta_e: float
    held_out_delta_e: float | None
    left_out_reason: str
    tested_luminance_cd_m2: float
    json_keys: ClassVar = {
        "XYZ": "XYZ_cd_m2",
        "estimated_XYZ": "estimated_XYZ_cd_m2",
        "delta_e": "delta_e_2000",
        "held_out_delta_e": "held_out_delta_e_2000",
        "left_out_reason": None,
        "tested_luminance_cd_m2": None,
    }
    json_also: ClassVar = ("left_out",)

    @property
    def left_out(self) -> str | None:
        """Why it was left out; None of a patch that was not."""
        return self.left_out_reason or None


@dataclass(frozen=True, slots=True, eq=False)
class CameraFit(JsonResult):
    """A fitted camera, its patches in the order given, and how well they determine it.

    ``standard_errors`` has the shape of M, (3, 3) or (3, 4); ``condition`` is that of C with columns of unit length;
    ``fitted`` and ``held_out`` are figures of ΔE00 over the patches fitted to, ``held_out`` None where none could be
    held out; ``notes`` are remarks, a sentence each.
    """

    model: CameraModel
    loss: Loss
    patches: tuple[FittedPatch, ...]
    standard_errors: Floats
    condition: float
    fitted: Errors
    held_out: Errors | None
    white_XYZ: Floats
    notes: tuple[str, ...]
    json_keys: ClassVar = {
        "model.matrix": "matrix_XYZ_cd_m2",
        "model.offset_XYZ": "offset_XYZ_cd_m2",
        "known_errors": "standard_errors",
        "fitted": "fitted_delta_e_2000",
        "held_out": "held_out_delta_e_2000",
        "reasons": "left_out",
        "notes": "said",
    }
    json_names: ClassVar = (
        "model.observer model.form loss model.matrix model.offset_XYZ model.black_rgb known_errors condition "
        "model.exposure model.exposure_sets model.safe_luminance_cd_m2 fitted held_out reasons patches notes"
    )

    @property
    def left_out(self) -> tuple[FittedPatch, ...]:
        """The patches that the matrix was not fitted to."""
        return tuple(patch for patch in self.patches if patch.left_out_reason)

    @property
    def sentence(self) -> str:
        """The outcome in a sentence or two."""
        count, gone = len(self.patches), len(self.left_out)
        if self.held_out is None:
            words = "No patch could be held out, so it is not known how well others are predicted."
        else:
            words = (
                f"A patch that the fit has not seen is off by {self.held_out.mean:.2f} ΔE00 on average, "
                f"{self.held_out.max:.2f} at most."
            )
        return words + (f" {gone} of {count} patches {'was' if gone == 1 else 'were'} left out." if gone else "")

    @property
    def known_errors(self) -> Floats | None:
        """The standard errors; None where they are not known."""
        return None if np.isnan(self.standard_errors).any() else self.standard_errors

    @property
    def reasons(self) -> dict[str, str]:
        """Why patches were left out, by their names."""
        return {patch.name: patch.left_out_reason for patch in self.left_out}


def fit_camera(
    colours: Correspondences,
    form: Form = "linear",
    loss: Loss = "xyz",
    *,
    black_rgb: ArrayLike = (0.0, 0.0, 0.0),
    exposure: Exposure | None = None,
    name: str = "",
    source: str = "",
    observer: str | None = None,
) -> CameraFit:
    """Fit a camera model (thesis Expressions 4.1 to 4.8) to colours that camera and instrument both saw.

    Saturated patches are left out, and those that do not belong to the rest. ``black_rgb`` (3,) is subtracted before
    anything else. Colours of several exposures are brought to ``exposure``, or to the least of theirs. ΔE00 is against
    the brightest colour measured. The safe luminance zone is the range of luminances fitted to (thesis Figure 5.8), or
    that stand, at the model's exposure, for the signals fitted to. Where colours have a noise, squares in XYZ are
    weighed by what noise and model leave unknown together.

    Parameters
    ----------
    colours
        The camera's RGB and the instrument's XYZ of the same patches.
    form
        ``linear``, or ``affine`` with an offset.
    loss
        What is least: squared errors of ``xyz``, or ΔE00.
    black_rgb
        The camera's signal without light, shape (3,); subtracted first.
    exposure
        The exposure of the model; None takes the least of the colours'.
    name, source
        The camera's name, and where the numbers come from, for its file.
    observer
        The colorimetric observer of the colours' XYZ, such as ``CIE 2015 10``. None takes the one that their file
        names, else CIE 1931 2°.

    Returns
    -------
    CameraFit
        The model, its errors by patch, and the patches left out.

    Raises
    ------
    DeviceError
        If there is no such observer or the colours are of another, the black is none, too few patches remain, their
        colours do not determine the matrix, or too many do not fit.

    Examples
    --------
    >>> rgb = np.random.default_rng(1).uniform(0.05, 0.9, (12, 3))
    >>> matrix = np.array([[41.0, 36.0, 18.0], [21.0, 72.0, 7.0], [2.0, 12.0, 95.0]])
    >>> names = tuple(f"patch {number}" for number in range(1, 13))
    >>> fit = fit_camera(Correspondences(rgb, rgb @ matrix.T, names, rgb > 0.995))
    >>> fit.model.matrix.round(3).tolist()
    [[41.0, 36.0, 18.0], [21.0, 72.0, 7.0], [2.0, 12.0, 95.0]]
    """
    observer = colorimetric_observer(observer or colours.observer or DEFAULT_OBSERVER).name
    if colours.observer not in (None, observer):
        what = f"its XYZ are for the observer {colours.observer}; {observer} is wanted"
        raise DeviceError(Finding(what, colours.file, remedy="leave the observer out, or give XYZ for it"))
    black = np.asarray(black_rgb, dtype=np.float64)
    check_black(colours, black)
    pooled = pool(colours, form, exposure)
    level = pooled.light[:, None]
    C = design((colours.rgb - black) * (pooled.light / pooled.signal)[:, None], form)
    XYZ = colours.XYZ * level
    white = np.maximum(XYZ[np.argmax(XYZ[:, 1])], 1e-9 * XYZ.max())
    reasons = [_saturated(row) for row in colours.saturated]
    usable = np.array([not reason for reason in reasons])
    check_enough(colours, usable, form)
    check_determined(colours, C[usable], form)
    off, expected = find_outliers(C[usable], XYZ[usable], white)
    rows = np.flatnonzero(usable)
    if off.sum() > _MOST_LEFT_OUT * len(rows):
        raise DeviceError(
            Finding(
                f"{off.sum()} of {len(rows)} patches do not fit any one matrix ({colours.named(rows[off])})",
                colours.file,
                remedy=_UNFIT,
            )
        )
    for row, predicted in zip(rows[off], expected[off], strict=True):
        reasons[row] = why(predicted, XYZ[row], white)
    used = np.array([not reason for reason in reasons])
    check_enough(colours, used, form)
    check_determined(colours, C[used], form)

    root = np.sqrt(_weights(colours, pooled, C, XYZ, used))[:, None] if loss == "xyz" else np.ones((len(C), 1))
    solution = solve((root * C)[used], (root * XYZ)[used], loss, white)
    lab = xyz_to_lab(XYZ, white)
    estimated = C @ solution.M.T
    apart = delta_e_2000(xyz_to_lab(estimated, white), lab)
    if np.median(apart[used]) > _MOST_MEDIAN:
        raise DeviceError(
            Finding(
                f"the patches do not fit any one matrix: the median ΔE00 is {np.median(apart[used]):.1f}",
                colours.file,
                remedy=_UNFIT,
            )
        )
    alone = np.full(len(colours), np.nan)
    # A colour seen at several exposures is not held out while one of them is kept.
    several = len(set(colours.exposures or ())) > 1 or colours.noise_rgb is not None
    names = [colours.names[i] for i in np.flatnonzero(used)] if several else ()
    left_out = left_out_xyz((root * C)[used], (root * XYZ)[used], loss, white, solution, names) / root[used]
    alone[used] = delta_e_2000(xyz_to_lab(left_out, white), lab[used])
    luminance = XYZ[:, 1]
    # At the reference exposure, a set's signals stand for its luminances times its exposure's share.
    tested = (colours.XYZ[:, 1] * pooled.signal)[used]
    zone = (float(tested.min()), float(tested.max()))
    model = CameraModel(
        solution.M[:, :3],
        solution.M[:, 3] if form == "affine" else np.zeros(3),
        black,
        pooled.reference,
        zone,
        form,
        name,
        source,
        pooled.sets,
        observer,
    )
    known = used & np.isfinite(alone)
    return CameraFit(
        model,
        loss,
        tuple(
            FittedPatch(
                colours.names[i],
                colours.rgb[i],
                colours.XYZ[i],
                estimated[i] / pooled.light[i],
                float(apart[i]),
                float(alone[i]) if math.isfinite(alone[i]) else None,
                reasons[i],
                float(colours.XYZ[i, 1] * pooled.signal[i]),
            )
            for i in range(len(colours))
        ),
        solution.standard_errors,
        solution.condition,
        errors_of(apart[used], luminance[used]),
        errors_of(alone[known], luminance[known]) if known.any() else None,
        white,
        (*remarks(colours, used, model, white), *uneven(colours, used, estimated / level)),
    )


def _weights(
    colours: Correspondences, pooled: PooledColours, C: Floats, XYZ: Floats, used: NDArray[np.bool_]
) -> Floats:
    """Return the weight of each row, (n,), at most 1: one over the variance of model and noise together.

    What no matrix explains, the model's variance, is what the residuals of the plain fit have beyond noise
    [DerSimonian1986]. Where noise is small beside it, as with a chart well exposed, all rows count alike.
    """
    if colours.noise_rgb is None:
        return np.ones(len(C))
    plain = solve(C[used], XYZ[used], "xyz", XYZ.max(axis=0))
    scale = (pooled.light / pooled.signal)[:, None]
    noise = ((colours.noise_rgb * scale) ** 2 @ plain.M[:, :3].T ** 2).mean(axis=1)
    n, k = int(used.sum()), C.shape[1]
    left = ((XYZ - C @ plain.M.T)[used] ** 2).mean(axis=1).sum() / max(n - k, 1)
    model = max(float(left) - float(noise[used].mean()), 0.0)
    variance = model + noise
    if not variance[used].max() > 0:
        return np.ones(len(C))
    variance = np.maximum(variance, 1e-3 * variance[used].max())
    return np.asarray(variance[used].min() / variance)


def _saturated(row: NDArray[np.bool_]) -> str:
    if not row.any():
        return ""
    return "saturated: " + " and ".join(colour for colour, is_full in zip(_COLOURS, row, strict=True) if is_full)
