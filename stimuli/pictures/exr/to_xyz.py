"""From a view as stored to absolute XYZ, refusing what must not reach an eye."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from devices.colour.spaces import rgb_to_xyz_matrix
from devices.errors import DeviceError
from documents import Finding
from documents.text.counting import counted
from stimuli.errors import StimulusError
from stimuli.pictures.exr.views import View
from stimuli.pictures.stereo_image import XYZImage

ColourSpace = Literal["declared", "xyz", "rec709"]
Negative = Literal["refuse", "clip"]

REC709 = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]])
XYZ = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]])
# Chromaticities are stored as float32, often from a table of three or four digits.
_SAME = 1e-4


def view_to_xyz(
    view: View,
    file: str,
    colour_space: ColourSpace | None = None,
    *,
    white_luminance_cd_m2: float | None = None,
    negative: Negative = "refuse",
) -> tuple[XYZImage, int]:
    """Return the view's XYZ in cd/m², float32 (height, width, 3), and how many pixels were clipped at 0.

    ``colour_space`` says what the numbers are where the file does not: ``xyz`` or ``rec709`` (linear, D65); None and
    ``declared`` rely on the file. ``white_luminance_cd_m2`` is the luminance of the value 1 and takes the place of
    the file's ``whiteLuminance``; without both it is 1. ``negative="clip"`` sets XYZ below 0 to 0 and counts it.

    Raises
    ------
    StimulusError
        If the colour space is neither declared nor told, or told otherwise than declared; if a value is NaN,
        infinite, or beyond single precision; if XYZ is negative and not to be clipped.
    """
    matrix = _matrix(view, file, colour_space)
    told = (white_luminance_cd_m2, view.white_luminance_cd_m2)
    luminance = next((value for value in told if value is not None), 1.0)
    if not (np.isfinite(luminance) and luminance > 0):
        raise _wrong(view, file, f"its whiteLuminance is {luminance}", "declare a luminance above 0")
    _refuse_not_finite(view.pixels, view, file)
    if np.array_equal(matrix, np.eye(3)) and luminance == 1.0:
        xyz = view.pixels
    else:
        with np.errstate(over="ignore"):
            xyz = (view.pixels.astype(np.float64) @ (luminance * matrix.T)).astype(np.float32)
        _refuse_not_finite(xyz, view, file, "beyond single precision after conversion to XYZ")
    below = xyz < 0
    if not below.any():
        return xyz, 0
    pixels = int(below.any(axis=-1).sum())
    if negative == "refuse":
        raise _wrong(
            view,
            file,
            f"{counted(pixels, 'pixel has', 'pixels have')} negative XYZ ({_per_channel(below, 'XYZ')}), down "
            f"to {xyz.min():.3g} cd/m²",
            "mend the picture, or ask for 'negative: clip'",
        )
    return np.maximum(xyz, np.float32(0)), pixels


def _matrix(view: View, file: str, colour_space: ColourSpace | None) -> NDArray[np.float64]:
    told = {"xyz": XYZ, "rec709": REC709}.get(colour_space or "")
    declared = XYZ if view.is_xyz else view.chromaticities
    chromaticities = told if declared is None else declared
    if chromaticities is None:
        raise _wrong(
            view, file, "it does not declare its chromaticities", "say 'colour_space: rec709' or 'colour_space: xyz'"
        )
    if declared is not None and told is not None and not np.allclose(declared, told, rtol=0, atol=_SAME):
        raise _wrong(
            view,
            file,
            f"it declares the chromaticities {np.round(declared, 4).tolist()}, not those of '{colour_space}'",
            "leave colour_space out, or mend the picture's header",
        )
    if np.allclose(chromaticities, XYZ, rtol=0, atol=1e-6):
        return np.eye(3)
    try:
        return rgb_to_xyz_matrix(*chromaticities)
    except DeviceError as error:
        raise _wrong(view, file, str(error), "mend the picture's header") from error


def _refuse_not_finite(values: XYZImage, view: View, file: str, what: str = "not finite") -> None:
    if np.isfinite(values).all():
        return
    nan, infinite = np.isnan(values), np.isinf(values)
    names = "XYZ" if view.is_xyz or what != "not finite" else "RGB"
    kinds = [
        f"{kind} in {int(bad.any(axis=-1).sum())} pixels ({_per_channel(bad, names)})"
        for kind, bad in (("NaN", nan), ("infinity", infinite))
        if bad.any()
    ]
    pixels = int((nan | infinite).any(axis=-1).sum())
    raise _wrong(
        view, file, f"{counted(pixels, 'pixel is', 'pixels are')} {what}: {', '.join(kinds)}", "mend the picture"
    )


def _per_channel(bad: NDArray[np.bool_], names: str) -> str:
    counts = bad.reshape(-1, 3).sum(axis=0)
    return ", ".join(f"{name} {int(count)}" for name, count in zip(names, counts, strict=True) if count)


def _wrong(view: View, file: str, message: str, remedy: str) -> StimulusError:
    place = f"in the view '{view.name}' " if view.name else ""
    return StimulusError(Finding(f"{place}{message}", file, remedy=remedy))
