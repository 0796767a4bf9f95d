"""The figures of a fitted camera: measured beside estimated, chromaticities, the safe zone, errors."""

from __future__ import annotations

import numpy as np

from devices.camera.fit import CameraFit
from devices.colour.spaces import xyY_from_XYZ
from devices.diagnostics.colours import locus_line
from devices.diagnostics.diagnosis import Colour, Line, Panel, numbers

_AXES: tuple[tuple[str, Colour], ...] = (("X", "red"), ("Y", "green"), ("Z", "blue"))


def panels(found: CameraFit) -> tuple[tuple[str, Panel], ...]:
    """Return each figure with its caption."""
    return (_agreement(found), _chromaticities(found), _zone(found), _errors(found))


def _used(found: CameraFit) -> np.ndarray:
    return np.array([not patch.left_out_reason for patch in found.patches])


def _agreement(found: CameraFit) -> tuple[str, Panel]:
    used = _used(found)
    measured = np.array([patch.XYZ for patch in found.patches])[used]
    estimated = np.array([patch.estimated_XYZ for patch in found.patches])[used]
    top = float(max(measured.max(), estimated.max()))
    lines = [Line("", (0.0, top), (0.0, top), "soft", "dashed")]
    for axis, (name, colour) in enumerate(_AXES):
        lines.append(Line(name, numbers(measured[:, axis]), numbers(estimated[:, axis]), colour))
    return (
        "Estimated from the photograph over measured; on the dashed line they agree.",
        Panel("Measured and estimated", "measured (cd/m²)", "estimated (cd/m²)", tuple(lines)),
    )


def _chromaticities(found: CameraFit) -> tuple[str, Panel]:
    used = _used(found)
    measured = xyY_from_XYZ(np.array([patch.XYZ for patch in found.patches])[used])
    estimated = xyY_from_XYZ(np.array([patch.estimated_XYZ for patch in found.patches])[used])
    apart = [
        Line("", (float(one[0]), float(other[0])), (float(one[1]), float(other[1])), "soft", "line")
        for one, other in zip(measured, estimated, strict=True)
    ]
    lines = (
        locus_line(),
        *apart,
        Line("measured", numbers(measured[:, 0]), numbers(measured[:, 1]), "ink"),
        Line("estimated", numbers(estimated[:, 0]), numbers(estimated[:, 1]), "red"),
    )
    return "CIE 1931 2°; a line joins what belongs together.", Panel("Chromaticities", "x", "y", lines, equal=True)


def _zone(found: CameraFit) -> tuple[str, Panel]:
    used = _used(found)
    place = np.arange(1, len(found.patches) + 1)
    luminance = np.array([patch.tested_luminance_cd_m2 for patch in found.patches])
    lines = [Line("fitted to", numbers(place[used]), numbers(luminance[used]), "ink")]
    if not used.all():
        lines.append(Line("left out", numbers(place[~used]), numbers(luminance[~used]), "red"))
    zone = found.model.safe_luminance_cd_m2 or ()
    return (
        "Luminance of each patch, at the model's exposure. Between the dashed lines an estimate can be trusted "
        "(thesis Figure 5.8).",
        Panel("Safe luminance zone", "patch", "luminance (cd/m²)", tuple(lines), levels=tuple(zone)),
    )


def _errors(found: CameraFit) -> tuple[str, Panel]:
    rows = [(i, patch) for i, patch in enumerate(found.patches, start=1) if not patch.left_out_reason]
    held = [(i, patch.held_out_delta_e) for i, patch in rows if patch.held_out_delta_e is not None]
    lines = [Line("fitted", tuple(float(i) for i, _ in rows), tuple(patch.delta_e for _, patch in rows), "soft")]
    if held:
        lines.append(Line("left out one by one", tuple(float(i) for i, _ in held), tuple(e for _, e in held), "accent"))
    return (
        "ΔE00 of each patch: as fitted, and as predicted by the fit to all others.",
        Panel("Errors", "patch", "ΔE00", tuple(lines)),
    )
