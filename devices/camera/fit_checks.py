"""What a chart's colours must hold before a camera model is fitted to them, and what is to be said of those that do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.camera.camera_model import CameraModel, Form
from devices.camera.correspondences import Correspondences
from devices.camera.solve import condition_of
from devices.colour.spaces import xyz_to_lab
from devices.errors import DeviceError
from documents import Finding
from documents.text.words import counted

Floats = NDArray[np.float64]

# Twice the unknowns of a row of the matrix: with fewer, errors cannot be told from noise.
LEAST = {"linear": 6, "affine": 8}
MOST_CONDITION = 200.0
_GREY = 8.0
_MOST_BELOW = 0.02


def check_black(colours: Correspondences, black: Floats) -> None:
    """Raise DeviceError unless ``black`` (3,) are numbers below the values that it is subtracted from."""
    if black.shape != (3,) or not np.all(np.isfinite(black)):
        raise DeviceError(Finding(f"the black is {black.tolist()}", remedy="give three shares of full scale"))
    below = (colours.rgb - black < -_MOST_BELOW).any(axis=1)
    if below.any():
        raise DeviceError(
            Finding(
                f"the black {', '.join(f'{value:g}' for value in black)} is above the values of {colours.named(below)}",
                colours.file,
                remedy="give it in shares of full scale, and only if it was not subtracted before",
            )
        )


def check_enough(colours: Correspondences, used: NDArray[np.bool_], form: Form) -> None:
    """Raise DeviceError unless the ``used`` patches (n,) are enough for a fit of that form."""
    count, least = int(used.sum()), LEAST[form]
    if count >= least:
        return
    gone = len(colours) - count
    if gone:
        raise DeviceError(
            Finding(
                f"{gone} of {len(colours)} patches are saturated or do not fit, and "
                f"{counted(count, 'is', 'are')} too few for a fit "
                f"({colours.named(~used)})",
                colours.file,
                remedy=f"photograph the chart again with a shorter exposure; at least {least} patches must be left",
            )
        )
    raise DeviceError(
        Finding(
            f"there {'is 1 patch' if count == 1 else f'are {count} patches'}; the {form} form needs {least} at "
            "the very least",
            colours.file,
            remedy="photograph a chart of 24",
        )
    )


def check_determined(colours: Correspondences, C: Floats, form: Form) -> None:
    """Raise DeviceError unless the columns of ``C`` (n, 3 or 4) determine a matrix."""
    condition = condition_of(C)
    if condition <= MOST_CONDITION:
        return
    told = f"{condition:.0f}" if condition < 1e9 else "infinite"
    raise DeviceError(
        Finding(
            f"the camera's values do not determine a matrix: their condition number is {told}, at most "
            f"{MOST_CONDITION:.0f} is allowed",
            colours.file,
            remedy="the colours are too alike, two channels carry the same, or one is dead"
            + ("; the linear form asks less" if form == "affine" else ""),
        )
    )


def remarks(colours: Correspondences, used: NDArray[np.bool_], model: CameraModel, white: Floats) -> list[str]:
    """Return what is odd about a fit to the ``used`` colours that is no error, a sentence each."""
    said = []
    if white[1] <= 1.5 or abs(white[1] - 100.0) < 1e-9:
        said.append(f"the brightest patch has Y = {white[1]:.4g}; if XYZ are relative, so is what the model gives")
    if model.exposure is None:
        said.append("no exposure was given: the model cannot be carried to photographs of another exposure")
    power = None
    if len(set(colours.exposures or ())) < 2:
        power = _power(colours.rgb[used] - model.black_rgb, colours.XYZ[used], white)
    if power is not None and not 0.8 <= power <= 1.25:
        said.append(
            f"the camera's values of grey go as luminance to the power {power:.2f}; if the picture is bent by a "
            "gamma, or its black is not subtracted, the model is wrong"
        )
    return said


def _power(rgb: Floats, XYZ: Floats, white: Floats) -> float | None:
    """Return the slope of log signal over log luminance of the greys, 1 for a linear camera; None without greys."""
    signal, luminance = rgb.mean(axis=1), XYZ[:, 1]
    grey = np.linalg.norm(xyz_to_lab(XYZ, white)[:, 1:], axis=1) < _GREY
    grey &= (signal > 0) & (luminance > 0)
    if grey.sum() < 4 or np.ptp(np.log(luminance[grey])) < 1.0:
        return None
    return float(np.polyfit(np.log(luminance[grey]), np.log(signal[grey]), 1)[0])
