"""`cyclopean camera fit`: a photographed colour chart to a camera model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from runner.cli.camera.options import frame_options
from runner.cli.number_types import NUMBER, several

if TYPE_CHECKING:
    from devices.camera import CameraFit


@click.command(name="fit")
@click.argument("charts", metavar="CHART.csv|PHOTO...", nargs=-1, required=True)
@click.option(
    "--reference",
    "references",
    multiple=True,
    metavar="REF.csv",
    help="Measured patches of the chart as CSV: X,Y,Z[,name] in cd/m²; once for all photographs, or once for each.",
)
@click.option("--white", metavar="X,Y,Z", help="Measured white patch in cd/m²; the other patches as on a ColorChecker.")
@click.option(
    "--corners",
    nargs=4,
    metavar="X,Y X,Y X,Y X,Y",
    help="Outer corners of the patches in pixels, in order around the chart. Default: detected.",
)
@click.option("--exposure", metavar="TIME,F,ISO", help="Exposure, such as 1/15,8,800. Default: the photograph's own.")
@click.option(
    "--form",
    type=click.Choice(["linear", "affine"]),
    default="linear",
    show_default=True,
    help="Form of the camera model; affine has an offset and holds for one exposure only.",
)
@click.option(
    "--loss",
    type=click.Choice(["xyz", "delta-e"]),
    default="xyz",
    show_default=True,
    help="Error to minimise: least squares in XYZ, or ΔE00.",
)
@click.option(
    "--black", metavar="R,G,B", help="Black level to subtract first, as shares of full scale. Default: 0,0,0."
)
@click.option(
    "--saturated",
    type=NUMBER,
    metavar="CODE",
    help="Level from which a photosite counts as saturated. Default: the file's white.",
)
@frame_options
@click.option("--linear", is_flag=True, help="Read a TIFF or OpenEXR file as linear camera RGB, whatever it declares.")
@click.option(
    "--observer",
    metavar="NAME",
    help="Colorimetric observer of the measured XYZ; the camera file names it. Default: the table's, else CIE 1931 2.",
)
@click.option("--name", default="", help="Name of the camera.")
@click.option("-o", "--output", metavar="CAMERA.yaml", help="Camera file to write.")
@click.option("--replace", is_flag=True, help="Overwrite an existing camera file.")
@click.option("--report", metavar="PAGE.html", help="HTML page to write.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    charts: tuple[str, ...],
    references: tuple[str, ...],
    white: str | None,
    corners: tuple[str, ...] | None,
    exposure: str | None,
    form: str,
    loss: str,
    black: str | None,
    saturated: float | None,
    dark: tuple[str, ...],
    flat: tuple[str, ...],
    linear: bool,
    observer: str | None,
    name: str,
    output: str | None,
    replace: bool,
    report: str | None,
    as_json: bool,
) -> None:
    """Fit a camera model to a photographed colour chart.

    CHART.csv holds what camera and instrument saw: R,G,B,X,Y,Z[,name]. Or give a PHOTO of a 24-patch ColorChecker, raw
    or linear TIFF or OpenEXR, with --reference (or, less exactly, --white); its patches are then found, read and, if
    the chart lies upside down, turned.

    Several PHOTOs are fitted to together: those of one chart at one exposure as repeated shots, by their mean.

    Every patch is judged by the fit to all others. Saturated patches, and those that do not belong to the rest, are
    left out and named.
    """
    import json
    from pathlib import Path
    from typing import cast

    from devices.camera import Form, Loss, parse_exposure, refuse_existing, write_camera
    from documents.files import writing
    from documents.pages import write_page
    from runner.cli.main import WorkError
    from runner.reports.camera.page import page_of
    from stimuli.chart import fit_camera_to_chart, is_table

    chart = charts[0]
    of_photographs = references or white or corners or linear or saturated is not None or dark or flat
    if is_table(chart) and len(charts) == 1 and of_photographs:
        raise click.UsageError(
            "--reference, --white, --corners, --saturated, --dark, --flat and --linear go with a photograph, not "
            "with a table"
        )
    if not any(is_table(one) for one in charts) and bool(references) == (white is not None):
        raise click.UsageError("a photograph needs --reference REF.csv or --white X,Y,Z, and one of them")
    result = fit_camera_to_chart(
        charts,
        reference=references or None,
        white_XYZ_cd_m2=_triple(white, "--white") if white is not None else None,
        corners_px=[_pair(corner) for corner in corners] if corners else None,
        exposure=parse_exposure(exposure) if exposure else None,
        form=cast(Form, form),
        loss=cast(Loss, loss),
        black_rgb=_triple(black, "--black") if black else (0.0, 0.0, 0.0),
        saturated=saturated,
        assume_linear=linear,
        name=name,
        observer=observer,
        dark=dark,
        flat=flat,
    )
    if output and not replace:  # what is wrong with the table comes first: it has to be mended anyway
        refuse_existing(output)
    if report:
        charts_said = tuple(f"Chart {pooled}" for pooled in result.charts)
        with writing(Path(report), "page", WorkError):
            said = (*result.notes, *charts_said)
            write_page(page_of(result.fit, name or Path(chart).name, said), Path(report))
    if output:
        with writing(Path(output), "camera", WorkError):
            write_camera(result.fit.model, output)
    if as_json:
        facts = {**result.to_json(), "written": output, "report": report}
        click.echo(json.dumps(facts, indent=2, allow_nan=False))
        return
    _print(result.fit, result.notes)
    for pooled in result.charts:
        click.echo(f"Chart: {pooled}.")
    for what, path in (("Camera file", output), ("Report", report)):
        if path:
            click.echo(f"{what}: {path}")


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = several(text, ",")
    except ValueError:
        raise click.UsageError(f"a corner is '{text}'; write four as 120,90 620,130 590,455 95,410") from None
    return x, y


def _triple(text: str, option: str) -> tuple[float, float, float]:
    try:
        first, second, third = several(text, ",")
    except ValueError:
        raise click.UsageError(f"{option} is '{text}'; write three numbers with commas") from None
    return first, second, third


def _print(fit: CameraFit, notes: tuple[str, ...]) -> None:
    from documents.pages import Table, print_blocks
    from runner.reports.camera.page import sentence

    rows = []
    for patch in fit.patches:
        held = patch.held_out_delta_e
        numbers = (f"{value:.4g}" for value in (*patch.XYZ, *patch.estimated_XYZ))
        left_out = "not fitted" if patch.left_out_reason else "–" if held is None else f"{held:.2f}"
        rows.append([patch.name, *numbers, f"{patch.delta_e:.2f}", left_out])
    headings = ("patch", "X", "Y", "Z", "X est.", "Y est.", "Z est.", "ΔE00", "left out")
    print_blocks([Table.of_texts("", headings, rows)])
    model = fit.model
    for axis, row, offset in zip("XYZ", model.matrix.tolist(), model.offset_XYZ.tolist(), strict=True):
        shift = f" {offset:+.5g}" if model.form == "affine" else ""
        click.echo(f"{axis} = {row[0]:.5g} R {row[1]:+.5g} G {row[2]:+.5g} B{shift}")
    zone = model.safe_luminance_cd_m2
    if model.exposure:
        click.echo(f"Exposure: {model.exposure} (EV {model.exposure.ev:.2f})")
    click.echo(f"Condition number: {fit.condition:.1f}")
    if zone:
        click.echo(f"Safe luminance zone: {zone[0]:.4g} to {zone[1]:.4g} cd/m²")
    for patch in fit.left_out:
        click.echo(f"Left out: {patch.name}: {patch.left_out_reason}")
    for note in (*notes, *fit.notes):
        click.echo(f"Note: {note}.")
    click.echo(sentence(fit))
