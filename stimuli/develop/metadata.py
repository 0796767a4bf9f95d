"""Metadata of a picture's file: how it was taken, which way up it stands, and what was done to it before.

The earlier steps are accepted only if they have the form that this program writes.
"""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from devices.camera import Exposure
from devices.errors import DeviceError
from documents import InputError
from documents.text import visible
from stimuli.pictures.picture_input import opened

if TYPE_CHECKING:
    import OpenImageIO


# OpenImageIO's names; the older Exif name of the ISO speed is the second.
_TIME, _F_NUMBER = "ExposureTime", "FNumber"
_ISO = ("Exif:PhotographicSensitivity", "Exif:ISOSpeedRatings")
EXPOSURE_ATTRIBUTE = "cyclopean:exposure"

Steps = tuple[Mapping[str, Any], ...]

MOST_CHARACTERS, MOST_STEPS, _MOST_DEEP = 1_000_000, 100, 8
# The steps that a picture of camera RGB has behind it when it is written.
NAMES = frozenset(
    {"read", "linearise", "demosaic", "rotate", "scale", "dark", "flat", "merge", "exposure", "spectra_to_camera"}
)


def exif_exposure(path: Path, libraw: Sequence[float] = (0.0, 0.0, 0.0)) -> Exposure | None:
    """Return the exposure that the file states, or None where it leaves out time, f-number or ISO.

    A lens without contacts leaves the f-number out. Metadata are kept in single precision: seven digits count.
    """
    stated = tuple(libraw)
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
    """Return the step with the exposure, and whether it is from the file's metadata or was given."""
    numbers = {"time_s": exposure.time_s, "f_number": exposure.f_number, "iso": exposure.iso}
    return {"step": "exposure", **numbers, "source": source}


def _number(spec: OpenImageIO.ImageSpec, name: str) -> float:
    value = _attribute(spec, name)
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


def camera_name(path: Path) -> str:
    """Return the camera's make and model by the file's metadata, empty where OpenImageIO does not find them."""
    attributes = _attributes(path)
    return "" if attributes is None else spec_camera(attributes)


def spec_camera(spec: OpenImageIO.ImageSpec) -> str:
    """Return the camera's make and model in a picture's attributes, or an empty text."""
    words = [_attribute(spec, name) for name in ("Make", "Model")]
    return " ".join(visible(word).strip() for word in words if isinstance(word, str) and word.strip())


def _attribute(spec: OpenImageIO.ImageSpec, name: str) -> Any:
    """Return an attribute, None if there is none or its text is not UTF-8."""
    with contextlib.suppress(UnicodeDecodeError):
        return spec.getattribute(name)
    return None


def _attributes(path: Path) -> OpenImageIO.ImageSpec | None:
    """Return the attributes of the file's first picture, where OpenImageIO reads it: many raw files are TIFF."""
    with contextlib.suppress(InputError), opened(path) as picture:
        return picture.spec()
    return None


def earlier_steps(kept: object) -> Steps:
    """Return the steps in ``kept``, the text of a picture's attribute; none at all if any of it is not as written.

    Any program can write such an attribute, and its text goes into manifests and reports: it may hold no NaN, no
    infinity, no names but `NAMES`, and no more than a few steps can.
    """
    steps = _parsed(kept)
    if not isinstance(steps, list) or len(steps) > MOST_STEPS or not all(_is_step(step) for step in steps):
        return ()
    return tuple(steps)


def kept_exposure(kept: object) -> Exposure | None:
    """Return the exposure in ``kept``, the text of a picture's attribute, or None if it holds none."""
    numbers = _parsed(kept)
    return _checked_exposure(*numbers) if isinstance(numbers, list) and len(numbers) == 3 else None


def _parsed(kept: object) -> Any:
    """Return what a JSON text holds; None if it is no JSON of finite numbers, or longer or deeper than any written."""
    if isinstance(kept, str) and len(kept) <= MOST_CHARACTERS:
        with contextlib.suppress(ValueError, RecursionError):
            value = json.loads(kept)
            if _is_plain(value, _MOST_DEEP):
                return value
    return None


def _is_plain(value: Any, deep: int) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, dict | list):
        return deep > 0 and all(
            _is_plain(item, deep - 1) for item in (value.values() if isinstance(value, dict) else value)
        )
    return True


def _is_step(step: Any) -> bool:
    if not isinstance(step, dict) or str(step.get("step")) not in NAMES or "luminance_scale" in step:
        return False
    notes = step.get("said", [])
    if not (isinstance(notes, list) and all(isinstance(note, str) for note in notes)):
        return False
    if step["step"] == "exposure":
        return _checked_exposure(*(step.get(key) for key in ("time_s", "f_number", "iso"))) is not None
    if step["step"] == "linearise":
        full = step.get("saturated_from")
        counts = (step.get("largest_code"), step.get("photosites_at_largest_code"))
        return isinstance(full, list) and len(full) > 0 and all(_is_number(note) for note in (*full, *counts))
    return isinstance(step.get("kind", ""), str)


def _checked_exposure(time_s: Any, f_number: Any, iso: Any) -> Exposure | None:
    if all(_is_number(value) for value in (time_s, f_number, iso)):
        with contextlib.suppress(DeviceError, OverflowError):
            return Exposure(float(time_s), float(f_number), float(iso))
    return None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
