"""What an OpenEXR header declares: chromaticities, observer, and whether the picture is a view at all."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching import DEFAULT_OBSERVER, colorimetric_observer
from devices.errors import DeviceError
from documents.text import visible
from stimuli.errors import StimulusError
from stimuli.pictures.picture_input import refuse_pixels_not_square

if TYPE_CHECKING:
    import OpenImageIO

# The header's name of the colorimetric observer of XYZ.
OBSERVER_ATTRIBUTE = "colorimetricObserver"
# Says that a picture of floats is to be kept in single precision, where no step changes it.
EXACT_ATTRIBUTE = "cyclopean:exact"
REC709 = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]])
XYZ = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]])
# Chromaticities are stored as float32, often from a table of three or four digits.
SAME = 1e-4
_D65, _ACES = [0.3127, 0.3290], [0.32168, 0.33767]
# Of the attribute colorInteropID [CIF]: linear light of these primaries; all else but these are codes, or no colours.
_INTEROP = {
    "lin_rec709_scene": REC709,
    "lin_p3d65_scene": np.array([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], _D65]),
    "lin_rec2020_scene": np.array([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], _D65]),
    "lin_adobergb_scene": np.array([[0.64, 0.33], [0.21, 0.71], [0.15, 0.06], _D65]),
    "lin_ap1_scene": np.array([[0.713, 0.293], [0.165, 0.830], [0.128, 0.044], _ACES]),
    "lin_ap0_scene": np.array([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770], _ACES]),
    "lin_ciexyzd65_scene": XYZ,
}
_ENVIRONMENTS = {
    "CubeFace Environment": "the six faces of a cube",
    "LatLong Environment": "a panorama of latitude and longitude",
}


def refuse_other_than_a_view(spec: OpenImageIO.ImageSpec, path: Path) -> None:
    """Raise StimulusError if the picture is an environment map, or if its pixels are not square."""
    layout = _ENVIRONMENTS.get(str(spec.getattribute("textureformat")))
    if layout is not None:
        message = f"the picture is an environment map, {layout}: light from all around, and not what an eye sees"
        raise StimulusError.at(path, message, "render the view of it that is to be shown")
    refuse_pixels_not_square(float(spec.getattribute("PixelAspectRatio") or 1.0), path, "its pixelAspectRatio")


def declared_chromaticities(spec: OpenImageIO.ImageSpec, path: Path) -> NDArray[np.float64] | None:
    """Return x, y of red, green, blue and white, shape (4, 2), as the header declares them; None if it does not.

    By the attribute ``chromaticities``, or by ``colorInteropID``.

    Raises
    ------
    StimulusError
        If the two differ, or the values are declared to be codes and no linear light.
    """
    stated = numbers(spec, "chromaticities", 8, path)
    chromaticities = None if stated is None else stated.reshape(4, 2)
    name = spec.getattribute("colorInteropID")
    if not isinstance(name, str) or name in ("", "unknown"):
        return chromaticities
    named = _INTEROP.get(name)
    what = f"its attribute colorInteropID is {visible(name)[:60]}"
    if named is None:
        message = (
            f"{what}, and that is no linear light" if not name.startswith("lin_") else f"{what}, which is not known"
        )
        raise StimulusError.at(
            path, message, "write it as linear light, such as lin_rec709_scene; or correct its header"
        )
    if chromaticities is not None and not np.allclose(chromaticities, named, rtol=0, atol=SAME):
        message = f"{what}, and its chromaticities are {np.round(chromaticities, 4).tolist()}"
        raise StimulusError.at(path, message, "correct the picture's header: keep one of the two")
    return named if chromaticities is None else chromaticities


def declared_observer(spec: OpenImageIO.ImageSpec, path: Path) -> str:
    """Return the colorimetric observer that a header declares; StimulusError if there is none of that name."""
    value = spec.getattribute(OBSERVER_ATTRIBUTE)
    if value is None:
        return DEFAULT_OBSERVER
    try:
        return colorimetric_observer(str(value)).name
    except DeviceError as error:
        finding = error.findings[0]
        remedy = f"correct its attribute {OBSERVER_ATTRIBUTE}: {finding.remedy}"
        raise StimulusError.at(path, f"it declares the observer {visible(str(value))[:60]}", remedy) from error


def numbers(spec: OpenImageIO.ImageSpec, attribute: str, count: int, path: Path) -> NDArray[np.float64] | None:
    """Return the numbers of an attribute, None if there is none; StimulusError if they are not ``count``."""
    value = spec.getattribute(attribute)
    if value is None:
        return None
    try:
        found = np.atleast_1d(np.array(value, dtype=np.float64))
    except (ValueError, TypeError):
        found = np.empty(0)
    if found.shape != (count,):
        raise StimulusError.at(
            path, f"its attribute '{attribute}' does not hold {count} numbers", "correct the picture's header"
        )
    return found
