"""The report on a fitted camera: one HTML page that needs nothing but itself, with its figures."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.camera import CameraFit
from devices.colour import srgb, xyY_from_XYZ
from devices.diagnostics import Colour, Line, Panel, locus_line, numbers
from documents.files import write_whole
from documents.pages import page_environment

_MOST_DECIMALS = 6
_SWATCH_SHARE = 0.9  # of the page's white, for the brightest patch
_AXES: tuple[tuple[str, Colour], ...] = (("X", "red"), ("Y", "green"), ("Z", "blue"))


def write_page(fit: CameraFit, title: str, output: Path, notes: tuple[str, ...] = ()) -> None:
    """Write the page to ``output``, whole or not at all; its folder is made if need be. Raises OSError if it cannot."""
    page = render(fit, title, notes)
    write_whole(output, page)


def render(fit: CameraFit, title: str, notes: tuple[str, ...] = ()) -> str:
    """Return the page's HTML; text from people is escaped. ``notes`` stand above what the fit itself says."""
    from markupsafe import Markup

    from runner.reports.display.figure import panel_svg
    from runner.reports.display.page import short

    # The style is that of the report on a display.
    environment = page_environment("runner.reports.camera", "runner.reports.display")
    environment.filters["short"] = short
    drawn = [
        # matplotlib escapes the text that it writes.
        (caption, Markup(panel_svg(panel, f"f{number}", f"{panel.y_label} over {panel.x_label}")))
        for number, (caption, panel) in enumerate(panels(fit), start=1)
    ]
    model, errors = fit.model, fit.standard_errors
    columns = [model.matrix, *([model.offset_XYZ[:, None]] if model.form == "affine" else [])]
    matrix = np.hstack(columns)
    cells = [[_with_error(float(matrix[i, j]), float(errors[i, j])) for j in range(matrix.shape[1])] for i in range(3)]
    patches = [
        (number, patch, _swatch(patch.XYZ, fit.white_XYZ), _swatch(patch.estimated_XYZ, fit.white_XYZ))
        for number, patch in enumerate(fit.patches, start=1)
    ]
    return environment.get_template("camera.html.j2").render(
        title=title,
        fit=fit,
        model=model,
        sentence=sentence(fit),
        notes=(*notes, *fit.notes),
        cells=cells,
        patches=patches,
        drawn=drawn,
    )


def _with_error(value: float, error: float) -> tuple[str, str | None]:
    """Return a number to the second digit of its standard error, and the error; None where it is not known."""
    if not math.isfinite(error):
        return f"{value:.5g}".replace("-", "−"), None
    decimals = min(max(1 - math.floor(math.log10(error)), 0), _MOST_DECIMALS) if error > 0 else _MOST_DECIMALS
    return f"{value:.{decimals}f}".replace("-", "−"), f"{error:.{decimals}f}"


def sentence(fit: CameraFit) -> str:
    """Return the outcome in a sentence or two."""
    count, gone = len(fit.patches), len(fit.left_out)
    if fit.held_out is None:
        words = "No patch could be held out, so it is not known how well others are predicted."
    else:
        words = (
            f"A patch that the fit has not seen is off by {fit.held_out.mean:.2f} ΔE00 on average, "
            f"{fit.held_out.max:.2f} at most."
        )
    return words + (f" {gone} of {count} patches {'was' if gone == 1 else 'were'} left out." if gone else "")


def _swatch(XYZ: NDArray[np.float64], white: NDArray[np.float64]) -> str:
    """Return roughly how a patch looks, as #rrggbb."""
    codes = srgb(_SWATCH_SHARE * XYZ, white)
    return "#" + "".join(f"{round(255 * value):02x}" for value in codes.tolist())


def panels(fit: CameraFit) -> tuple[tuple[str, Panel], ...]:
    """Return each figure with its caption."""
    return (_agreement(fit), _chromaticities(fit), _zone(fit), _errors(fit))


def _used(fit: CameraFit) -> np.ndarray:
    return np.array([not patch.left_out_reason for patch in fit.patches])


def _agreement(fit: CameraFit) -> tuple[str, Panel]:
    used = _used(fit)
    measured = np.array([patch.XYZ for patch in fit.patches])[used]
    estimated = np.array([patch.estimated_XYZ for patch in fit.patches])[used]
    top = float(max(measured.max(), estimated.max()))
    lines = [Line("", (0.0, top), (0.0, top), "soft", "dashed")]
    for axis, (name, colour) in enumerate(_AXES):
        lines.append(Line(name, numbers(measured[:, axis]), numbers(estimated[:, axis]), colour))
    return (
        "Estimated from the photograph over measured; on the dashed line they agree.",
        Panel("Measured and estimated", "measured (cd/m²)", "estimated (cd/m²)", tuple(lines)),
    )


def _chromaticities(fit: CameraFit) -> tuple[str, Panel]:
    used = _used(fit)
    measured = xyY_from_XYZ(np.array([patch.XYZ for patch in fit.patches])[used])
    estimated = xyY_from_XYZ(np.array([patch.estimated_XYZ for patch in fit.patches])[used])
    apart = [
        Line("", (float(first[0]), float(second[0])), (float(first[1]), float(second[1])), "soft", "line")
        for first, second in zip(measured, estimated, strict=True)
    ]
    lines = (
        locus_line(),
        *apart,
        Line("measured", numbers(measured[:, 0]), numbers(measured[:, 1]), "ink"),
        Line("estimated", numbers(estimated[:, 0]), numbers(estimated[:, 1]), "red"),
    )
    return "CIE 1931 2°; a line joins what belongs together.", Panel("Chromaticities", "x", "y", lines, equal=True)


def _zone(fit: CameraFit) -> tuple[str, Panel]:
    used = _used(fit)
    place = np.arange(1, len(fit.patches) + 1)
    luminance = np.array([patch.tested_luminance_cd_m2 for patch in fit.patches])
    lines = [Line("fitted to", numbers(place[used]), numbers(luminance[used]), "ink")]
    if not used.all():
        lines.append(Line("left out", numbers(place[~used]), numbers(luminance[~used]), "red"))
    zone = fit.model.safe_luminance_cd_m2 or ()
    return (
        "Luminance of each patch, at the model's exposure. Between the dashed lines an estimate can be trusted "
        "(thesis Figure 5.8).",
        Panel("Safe luminance zone", "patch", "luminance (cd/m²)", tuple(lines), levels=tuple(zone)),
    )


def _errors(fit: CameraFit) -> tuple[str, Panel]:
    rows = [(i, patch) for i, patch in enumerate(fit.patches, start=1) if not patch.left_out_reason]
    held = [(i, patch.held_out_delta_e) for i, patch in rows if patch.held_out_delta_e is not None]
    lines = [Line("fitted", tuple(float(i) for i, _ in rows), tuple(patch.delta_e for _, patch in rows), "soft")]
    if held:
        lines.append(Line("left out one by one", tuple(float(i) for i, _ in held), tuple(e for _, e in held), "accent"))
    return (
        "ΔE00 of each patch: as fitted, and as predicted by the fit to all others.",
        Panel("Errors", "patch", "ΔE00", tuple(lines)),
    )
