"""The report on a fitted camera: one HTML page that needs nothing but itself."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.camera.fit import CameraFit
from devices.colour.srgb import srgb
from documents.files.whole_file import write_whole
from documents.pages.environment import page_environment

_MOST_DECIMALS = 6
_SWATCH_SHARE = 0.9  # of the page's white, for the brightest patch


def write_page(found: CameraFit, title: str, output: Path, notes: tuple[str, ...] = ()) -> None:
    """Write the page to ``output``, whole or not at all; its folder is made if need be. Raises OSError if it cannot."""
    page = render(found, title, notes)
    write_whole(output, page)


def render(found: CameraFit, title: str, notes: tuple[str, ...] = ()) -> str:
    """Return the page's HTML; text from people is escaped. ``notes`` stand above what the fit itself says."""
    from markupsafe import Markup

    from runner.reports.camera.figures import panels
    from runner.reports.display.figure import panel_svg
    from runner.reports.display.page import short

    # The style is that of the report on a display.
    environment = page_environment("runner.reports.camera", "runner.reports.display")
    environment.filters["short"] = short
    drawn = [
        # matplotlib escapes the text that it writes.
        (caption, Markup(panel_svg(panel, f"f{number}", f"{panel.y_label} over {panel.x_label}")))
        for number, (caption, panel) in enumerate(panels(found), start=1)
    ]
    model, errors = found.model, found.standard_errors
    columns = [model.matrix, *([model.offset_XYZ[:, None]] if model.form == "affine" else [])]
    matrix = np.hstack(columns)
    cells = [[_with_error(float(matrix[i, j]), float(errors[i, j])) for j in range(matrix.shape[1])] for i in range(3)]
    patches = [
        (number, patch, _swatch(patch.XYZ, found.white_XYZ), _swatch(patch.estimated_XYZ, found.white_XYZ))
        for number, patch in enumerate(found.patches, start=1)
    ]
    return environment.get_template("camera.html.j2").render(
        title=title,
        found=found,
        model=model,
        sentence=sentence(found),
        notes=(*notes, *found.notes),
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


def sentence(found: CameraFit) -> str:
    """Return the outcome in a sentence or two."""
    count, gone = len(found.patches), len(found.left_out)
    if found.held_out is None:
        told = "No patch could be held out, so nothing tells how well others are predicted."
    else:
        told = (
            f"A patch that the fit has not seen is off by {found.held_out.mean:.2f} ΔE00 on average, "
            f"{found.held_out.max:.2f} at most."
        )
    return told + (f" {gone} of {count} patches {'was' if gone == 1 else 'were'} left out." if gone else "")


def _swatch(XYZ: NDArray[np.float64], white: NDArray[np.float64]) -> str:
    """Return roughly how a patch looks, as #rrggbb."""
    codes = srgb(_SWATCH_SHARE * XYZ, white)
    return "#" + "".join(f"{round(255 * value):02x}" for value in codes.tolist())
