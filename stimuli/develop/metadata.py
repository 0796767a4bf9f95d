"""What a camera file says about how it was taken."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from devices.camera.exposure import Exposure
from devices.errors import DeviceError
from stimuli.develop.earlier_steps import kept_exposure

if TYPE_CHECKING:
    import OpenImageIO
    import rawpy

# OpenImageIO's names; the older Exif name of the ISO speed is the second.
_TIME, _F_NUMBER = "ExposureTime", "FNumber"
_ISO = ("Exif:PhotographicSensitivity", "Exif:ISOSpeedRatings")
EXPOSURE_ATTRIBUTE = "cyclopean:exposure"


def exif_exposure(path: Path, raw: rawpy.RawPy | None = None) -> Exposure | None:
    """Return the exposure that the file states, or None where it leaves out time, f-number or ISO.

    A lens without contacts leaves the f-number out. Metadata are kept in single precision: seven digits count.
    """
    stated: tuple[float, float, float] = (0.0, 0.0, 0.0)
    if raw is not None:
        # LibRaw's reader of these fields also reads the time of day, which may be none at all.
        with contextlib.suppress(ValueError, OverflowError, OSError):
            other = raw.other
            stated = (other.shutter_speed, other.aperture, other.iso_speed)
    if not all(stated):
        attributes = _attributes(path)
        time_s, f_number, iso = (a or b for a, b in zip(stated, spec_numbers(attributes), strict=True))
        stated = (time_s, f_number, iso)
    return _exposure(*(_seven_digits(value) for value in stated))


def spec_exposure(spec: OpenImageIO.ImageSpec) -> Exposure | None:
    """Return the exposure in a picture's attributes, or None."""
    kept = spec.getattribute(EXPOSURE_ATTRIBUTE)
    if isinstance(kept, str) and (exposure := kept_exposure(kept)):
        return exposure
    return _exposure(*(_seven_digits(value) for value in spec_numbers(spec)))


def spec_numbers(spec: OpenImageIO.ImageSpec | None) -> tuple[float, float, float]:
    """Return time in s, f-number and ISO from a picture's attributes, 0 for what is not there."""
    if spec is None:
        return 0.0, 0.0, 0.0
    iso = next((value for name in _ISO if (value := _number(spec, name)) > 0), 0.0)
    return _number(spec, _TIME), _number(spec, _F_NUMBER), iso


def exposure_step(exposure: Exposure, source: str) -> dict[str, Any]:
    """Return the step that says the exposure, and whether the file's metadata told it or a person."""
    numbers = {"time_s": exposure.time_s, "f_number": exposure.f_number, "iso": exposure.iso}
    return {"step": "exposure", **numbers, "source": source}


def sha256(path: Path) -> str:
    """Return the file's digest, so that a result can be traced to the very photograph."""
    import hashlib

    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _number(spec: OpenImageIO.ImageSpec, name: str) -> float:
    value = spec.getattribute(name)
    if isinstance(value, (tuple, list)) and value:
        value = value[0]
    return float(value) if isinstance(value, (int, float)) and np.isfinite(value) else 0.0


def _seven_digits(value: float) -> float:
    """Return ``value`` as it was before it was stored in single precision."""
    return float(f"{value:.7g}")


def _exposure(time_s: float, f_number: float, iso: float) -> Exposure | None:
    with contextlib.suppress(DeviceError):  # what no camera can have been set to is no exposure
        return Exposure(time_s, f_number, iso)
    return None


def _attributes(path: Path) -> OpenImageIO.ImageSpec | None:
    """Return the attributes of the file's first picture, where OpenImageIO reads it: many raw files are TIFF."""
    import OpenImageIO as oiio

    picture = oiio.ImageInput.open(str(path))
    if picture is None:
        oiio.geterror()  # nobody else should be told of it
        return None
    try:
        return picture.spec()
    finally:
        picture.close()
