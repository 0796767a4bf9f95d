"""A camera fitted to a chart and written, and the page on it: its matrix, its figures, and each patch."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from devices.camera import CameraFit, refuse_existing, write_camera
from devices.colour import srgb, xyY_from_XYZ
from devices.diagnostics import Colour, PlotAxes, Trace, locus_line, numbers
from documents import WorkError
from documents.files import writing
from documents.options import Typed
from documents.pages import Beside, Cell, Column, Facts, Figure, Page, Paragraph, Section, ShownAs, Table, write_page
from documents.text import fixed, with_error
from extensions.photo.camera_fit import ChartFit, fit_camera_to_chart
from extensions.photo.chart_options import ChartOptions
from runner.reports import draw_panel, short

_SWATCH_SHARE = 0.9  # of the page's white, for the brightest patch
_PATCHES_WORDS = (
    "Swatches: measured, then estimated, as they roughly look. ΔE00 is against the brightest patch measured."
)
_PATCHES = (
    Column("Patch", "patch"),
    Column("Look", "look", "swatches"),
    Column("R, G, B", "rgb", "number"),
    Column("X, Y, Z measured", "measured", "number"),
    Column("X, Y, Z estimated", "estimated", "number"),
    Column("ΔE00", "delta_e_00", "number", 2),
    Column("left out", "held_out_delta_e_00", "number", 2),
)
_AXES: tuple[tuple[str, Colour], ...] = (("X", "red"), ("Y", "green"), ("Z", "blue"))


def characterise_camera(
    charts: Annotated[Sequence[Path], Typed(metavar="CHART.csv|PHOTO...")],
    options: ChartOptions | None = None,
    *,
    output: Annotated[Path | None, Typed("-o --output", "CAMERA.yaml")] = None,
    replace: bool = False,
    page: Annotated[Path | None, Typed("--report", "PAGE.html")] = None,
) -> ChartFit:
    """Fit a camera model to a photographed colour chart.

    CHART.csv holds what camera and instrument saw: R,G,B,X,Y,Z[,name]. Or give a PHOTO of a 24-patch ColorChecker, raw
    or linear TIFF or OpenEXR, with --reference (or, less exactly, --white); its patches are then found, read and, if
    the chart lies upside down, turned.

    Several PHOTOs are fitted to together: those of one chart at one exposure as repeated shots, by their mean.

    Every patch is judged by the fit to all others. Saturated patches, and those that do not belong to the rest, are
    left out and named.

    Parameters
    ----------
    charts
        A table, or photographs of a chart.
    options
        What is known of the chart and the photographs, and how the model is fitted.
    output
        Camera file to write.
    replace
        Overwrite an existing camera file.
    page
        HTML page to write.

    Raises
    ------
    InputError
        As of `extensions.photo.fit_camera_to_chart`; if the camera file is there already.
    WorkError
        If a file cannot be written.
    """
    result = fit_camera_to_chart(charts, options)
    if output and not replace:  # what is wrong with the table comes first: it has to be mended anyway
        refuse_existing(output)
    if page:
        with writing(page, "page", WorkError):
            notes = (*result.notes, *(f"Chart {pooled}" for pooled in result.charts))
            write_page(page_of(result.fit, result.fit.model.name or Path(charts[0]).name, notes), page)
    if output:
        with writing(output, "camera", WorkError):
            write_camera(result.fit.model, output)
    return dataclasses.replace(result, written=output, page=page)


def page_of(fit: CameraFit, title: str, notes: tuple[str, ...] = ()) -> Page:
    """Return what the page says; ``notes`` stand above what the fit itself says."""
    figures = tuple(
        Figure(f"camera_{number}", draw_panel(panel, f"{panel.y_label} over {panel.x_label}"), None, caption)
        for number, (caption, panel) in enumerate(panels(fit), start=1)
    )
    return Page(
        kind="Camera report",
        title=title,
        of="camera report",
        sentences=(fit.sentence,),
        notes=tuple(f"{note[:1].upper()}{note[1:]}." for note in (*notes, *fit.notes)),
        sections=(
            Section("model", "Model", (Paragraph(_formula(fit)), _matrix(fit), Facts(_facts(fit)))),
            Section("figures", "Figures", (Beside(figures),)),
            Section("patches", "Patches", (Paragraph(_PATCHES_WORDS), _patches(fit))),
        ),
    )


def _formula(fit: CameraFit) -> str:
    model = fit.model
    affine = model.form == "affine"
    rgb = "(RGB − black)" if model.black_rgb.any() else "RGB"
    alone = "; V does not scale with exposure, so the model serves its own exposure alone" if affine else ""
    return (
        f"XYZ = M · {rgb}{' + V' if affine else ''} in cd/m², for linear camera RGB in shares of full scale{alone}. "
        f"Least squares in {'ΔE00' if fit.loss == 'delta-e' else 'XYZ'}; ± one standard error."
    )


def _matrix(fit: CameraFit) -> Table:
    model, errors = fit.model, fit.standard_errors
    affine = model.form == "affine"
    matrix = np.hstack([model.matrix, *([model.offset_XYZ[:, None]] if affine else [])])
    columns = [Column("", "XYZ"), *(Column(name, name, "number") for name in ("RGBV" if affine else "RGB"))]
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        ("XYZ"[i], *(_with_error(float(matrix[i, j]), float(errors[i, j])) for j in range(matrix.shape[1])))
        for i in range(3)
    )
    return Table("matrix", "", tuple(columns), rows)


def _with_error(value: float, error: float) -> ShownAs:
    return ShownAs(value, with_error(value, error).replace("-", "−"))


def _facts(fit: CameraFit) -> tuple[tuple[str, str], ...]:
    model, zone = fit.model, fit.model.safe_luminance_cd_m2 or (None, None)
    exposure = "not known" if model.exposure is None else f"{model.exposure} (EV {short(model.exposure.ev)})"
    facts = [("Observer of XYZ", model.observer), ("Exposure", exposure)]
    if model.black_rgb.any():
        facts.append(("Black subtracted", ", ".join(map(short, model.black_rgb.tolist()))))
    facts.append(("Safe luminance zone", f"{short(zone[0])} to {short(zone[1])} cd/m²"))
    facts.append(("ΔE00 as fitted", _errors_words(fit.fitted.mean, fit.fitted.p95, fit.fitted.max)))
    if (held := fit.held_out) is not None:
        held_out = f"{_errors_words(held.mean, held.p95, held.max)}, darkest third {short(held.dark_mean)}"
        facts.append(("ΔE00 left out one by one", held_out))
    return (*facts, ("Condition number", short(fit.condition)))


def _errors_words(mean: float, p95: float, largest: float) -> str:
    return f"mean {short(mean)}, 95th percentile {short(p95)}, largest {short(largest)}"


def _patches(fit: CameraFit) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for number, patch in enumerate(fit.patches, start=1):
        looks = _swatch(patch.XYZ, fit.white_XYZ), _swatch(patch.estimated_XYZ, fit.white_XYZ)
        rgb = " ".join(fixed(value) for value in patch.rgb.tolist())
        XYZ = [" ".join(map(short, values.tolist())) for values in (patch.XYZ, patch.estimated_XYZ)]
        held_out: Cell = patch.held_out_delta_e
        if patch.left_out_reason:
            held_out = ShownAs(None, f"not fitted: {patch.left_out_reason}")
        rows.append((f"{number} {patch.name}", looks, rgb, *XYZ, patch.delta_e, held_out))
    gone = [place for place, patch in enumerate(fit.patches) if patch.left_out_reason]
    return Table("patches", "", _PATCHES, tuple(rows), shaded=gone)


def _swatch(XYZ: NDArray[np.float64], white: NDArray[np.float64]) -> str:
    """Return roughly how a patch looks, as #rrggbb."""
    codes = srgb(_SWATCH_SHARE * XYZ, white)
    return "#" + "".join(f"{round(255 * value):02x}" for value in codes.tolist())


def panels(fit: CameraFit) -> tuple[tuple[str, PlotAxes], ...]:
    """Return each figure with its caption."""
    return (_agreement(fit), _chromaticities(fit), _zone(fit), _errors(fit))


def _used(fit: CameraFit) -> np.ndarray:
    return np.array([not patch.left_out_reason for patch in fit.patches])


def _agreement(fit: CameraFit) -> tuple[str, PlotAxes]:
    used = _used(fit)
    measured = np.array([patch.XYZ for patch in fit.patches])[used]
    estimated = np.array([patch.estimated_XYZ for patch in fit.patches])[used]
    top = float(max(measured.max(), estimated.max()))
    lines = [Trace("", (0.0, top), (0.0, top), "soft", "dashed")]
    for axis, (name, colour) in enumerate(_AXES):
        lines.append(Trace(name, numbers(measured[:, axis]), numbers(estimated[:, axis]), colour))
    return (
        "Estimated from the photograph over measured; on the dashed line they agree.",
        PlotAxes("Measured and estimated", "measured (cd/m²)", "estimated (cd/m²)", tuple(lines)),
    )


def _chromaticities(fit: CameraFit) -> tuple[str, PlotAxes]:
    used = _used(fit)
    measured = xyY_from_XYZ(np.array([patch.XYZ for patch in fit.patches])[used])
    estimated = xyY_from_XYZ(np.array([patch.estimated_XYZ for patch in fit.patches])[used])
    apart = [
        Trace("", (float(first[0]), float(second[0])), (float(first[1]), float(second[1])), "soft", "line")
        for first, second in zip(measured, estimated, strict=True)
    ]
    lines = (
        locus_line(),
        *apart,
        Trace("measured", numbers(measured[:, 0]), numbers(measured[:, 1]), "ink"),
        Trace("estimated", numbers(estimated[:, 0]), numbers(estimated[:, 1]), "red"),
    )
    return "CIE 1931 2°; a line joins what belongs together.", PlotAxes("Chromaticities", "x", "y", lines, equal=True)


def _zone(fit: CameraFit) -> tuple[str, PlotAxes]:
    used = _used(fit)
    place = np.arange(1, len(fit.patches) + 1)
    luminance = np.array([patch.tested_luminance_cd_m2 for patch in fit.patches])
    lines = [Trace("fitted to", numbers(place[used]), numbers(luminance[used]), "ink")]
    if not used.all():
        lines.append(Trace("left out", numbers(place[~used]), numbers(luminance[~used]), "red"))
    zone = fit.model.safe_luminance_cd_m2 or ()
    return (
        "Luminance of each patch, at the model's exposure. Between the dashed lines an estimate can be trusted "
        "(thesis Figure 5.8).",
        PlotAxes("Safe luminance zone", "patch", "luminance (cd/m²)", tuple(lines), levels=tuple(zone)),
    )


def _errors(fit: CameraFit) -> tuple[str, PlotAxes]:
    rows = [(i, patch) for i, patch in enumerate(fit.patches, start=1) if not patch.left_out_reason]
    held = [(i, patch.held_out_delta_e) for i, patch in rows if patch.held_out_delta_e is not None]
    lines = [Trace("fitted", tuple(float(i) for i, _ in rows), tuple(patch.delta_e for _, patch in rows), "soft")]
    if held:
        lines.append(
            Trace("left out one by one", tuple(float(i) for i, _ in held), tuple(e for _, e in held), "accent")
        )
    return (
        "ΔE00 of each patch: as fitted, and as predicted by the fit to all others.",
        PlotAxes("Errors", "patch", "ΔE00", tuple(lines)),
    )
