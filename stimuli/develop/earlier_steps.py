"""What a picture's own file says was done to it before: believed only as far as it is what this program writes."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Mapping
from typing import Any

from devices.camera.exposure import Exposure
from devices.errors import DeviceError

Steps = tuple[Mapping[str, Any], ...]

MOST_CHARACTERS, MOST_STEPS, _MOST_DEEP = 1_000_000, 100, 8
# The steps that a picture of camera RGB has behind it when it is written.
NAMES = frozenset({"read", "linearise", "demosaic", "rotate", "scale", "exposure", "spectra_to_camera"})


def earlier_steps(kept: object) -> Steps:
    """Return the steps in ``kept``, the text of a picture's attribute; none at all if any of it is not as written.

    Anybody can write such an attribute, and what it says goes into manifests and reports: it may hold no NaN, no
    infinity, no names but `NAMES`, and no more than a few steps can.
    """
    steps = _parsed(kept)
    if not isinstance(steps, list) or len(steps) > MOST_STEPS or not all(_is_step(step) for step in steps):
        return ()
    return tuple(steps)


def kept_exposure(kept: object) -> Exposure | None:
    """Return the exposure in ``kept``, the text of a picture's attribute, or None if it holds none."""
    numbers = _parsed(kept)
    return _exposure(*numbers) if isinstance(numbers, list) and len(numbers) == 3 else None


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
            _is_plain(one, deep - 1) for one in (value.values() if isinstance(value, dict) else value)
        )
    return True


def _is_step(step: Any) -> bool:
    if not isinstance(step, dict) or str(step.get("step")) not in NAMES or "luminance_scale" in step:
        return False
    said = step.get("said", [])
    if not (isinstance(said, list) and all(isinstance(one, str) for one in said)):
        return False
    if step["step"] == "exposure":
        return _exposure(*(step.get(key) for key in ("time_s", "f_number", "iso"))) is not None
    if step["step"] == "linearise":
        full = step.get("saturated_from")
        counts = (step.get("largest_code"), step.get("photosites_at_largest_code"))
        return isinstance(full, list) and len(full) > 0 and all(_is_number(one) for one in (*full, *counts))
    return isinstance(step.get("kind", ""), str)


def _exposure(time_s: Any, f_number: Any, iso: Any) -> Exposure | None:
    if all(_is_number(value) for value in (time_s, f_number, iso)):
        with contextlib.suppress(DeviceError, OverflowError):
            return Exposure(float(time_s), float(f_number), float(iso))
    return None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
