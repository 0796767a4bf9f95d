"""The numbers of a fitted model as plain JSON, each with its standard error where the fit gives one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from devices.display.model import DisplayModel
from devices.display.tone_curve import ToneCurve

_COLOURS = ("red", "green", "blue")


def model_numbers(model: DisplayModel, standard_errors: Mapping[str, float]) -> dict[str, Any]:
    """Return black, primaries, and the curves where they are of the GOGO family.

    ``standard_errors`` are those of the fit, by names such as ``red.gamma``. Light is a share of full drive, so that
    gain and offset add up to 1 and share one error.
    """
    black = {
        axis: {"value": float(value), "standard_error": standard_errors.get(f"black.{axis}")}
        for axis, value in zip("XYZ", model.black_XYZ_cd_m2, strict=True)
    }
    curves: dict[str, Any] = {}
    for colour, curve in zip(_COLOURS, model.curves, strict=True):
        if isinstance(curve, ToneCurve):
            shared = standard_errors.get(f"{colour}.offset")
            curves[colour] = {
                "gain": {"value": curve.gain, "standard_error": shared},
                "offset": {"value": curve.offset, "standard_error": shared},
                "gamma": {"value": curve.gamma, "standard_error": standard_errors.get(f"{colour}.gamma")},
            }
    primaries = dict(zip(_COLOURS, model.primaries_XYZ_cd_m2.T.tolist(), strict=True))
    return {"black_XYZ_cd_m2": black, "primaries_XYZ_cd_m2": primaries, "curves": curves or None}
