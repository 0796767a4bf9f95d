"""`cyclopean camera spectral`: pictures of many wavelengths to XYZ, or to what a camera records."""

from __future__ import annotations

import click

from runner.cli.number_types import NUMBER


@click.command(name="spectral")
@click.argument("file", metavar="FILE")
@click.option("-o", "--output", required=True, metavar="OUT.exr", help="OpenEXR file to write.")
@click.option(
    "--quantity",
    type=click.Choice(["radiance", "reflectance"]),
    help="Quantity of the values, if FILE does not state it.",
)
@click.option(
    "--illuminant", metavar="NAME|LIGHT.csv", help="Illuminant of reflectances: A, D50, D65, E, … or a spectrum."
)
@click.option(
    "--white-luminance", "white", type=NUMBER, metavar="CD_M2", help="Luminance of a perfect diffuser in that light."
)
@click.option(
    "--scale",
    type=NUMBER,
    default=1.0,
    show_default=True,
    help="Factor for the values or the light, for other units.",
)
@click.option(
    "--observer", default="CIE 1931 2", show_default=True, metavar="NAME", help="Colorimetric observer of the XYZ."
)
@click.option(
    "--sensitivities",
    metavar="SENSOR.csv",
    help="Sensor table (wavelength_nm,red,green,blue): write camera RGB instead of XYZ.",
)
@click.option(
    "--full-scale", type=NUMBER, metavar="CD_M2", help="Luminance of equal-energy light that just saturates the sensor."
)
@click.option("--exposure", metavar="TIME,F,ISO", help="Exposure to store with the camera RGB, such as 1/15,8,200.")
@click.option(
    "--negative",
    type=click.Choice(["refuse", "clip"]),
    default="refuse",
    show_default=True,
    help="What to do with negative XYZ: refuse, or set to 0 and count.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    file: str,
    output: str,
    quantity: str | None,
    illuminant: str | None,
    white: float | None,
    scale: float,
    observer: str,
    sensitivities: str | None,
    full_scale: float | None,
    exposure: str | None,
    negative: str,
    as_json: bool,
) -> None:
    """Turn a spectral picture into XYZ, or into what a camera records.

    FILE is OpenEXR with a channel per wavelength (S0.550nm, T.550nm or 550nm) or ENVI (.hdr). Radiance is in
    W/(sr m² nm). By the --observer's functions it becomes absolute XYZ; with --sensitivities, linear camera RGB that
    can be compared with a photograph.
    """
    import json
    from pathlib import Path
    from typing import Literal, cast

    from devices.camera import parse_exposure
    from devices.colour_matching import DEFAULT_OBSERVER, colorimetric_observer
    from stimuli.spectral import Illumination, Quantity, VirtualCamera, convert_spectral

    if (sensitivities is None) != (full_scale is None):
        raise click.UsageError("--sensitivities and --full-scale go together")
    if exposure and sensitivities is None:
        raise click.UsageError("--exposure goes with --sensitivities: XYZ has none")
    if sensitivities is not None and colorimetric_observer(observer).name != DEFAULT_OBSERVER:
        raise click.UsageError(
            "--observer is that of XYZ, and --sensitivities writes camera RGB; the camera file names the observer of "
            "its XYZ: cyclopean camera fit --observer"
        )
    camera = None
    if sensitivities is not None and full_scale is not None:
        camera = VirtualCamera(Path(sensitivities), full_scale, parse_exposure(exposure) if exposure else None)
    report = convert_spectral(
        Path(file),
        Path(output),
        Illumination(illuminant, white, scale),
        quantity=cast("Quantity | None", quantity),
        camera=camera,
        negative=cast(Literal["refuse", "clip"], negative),
        observer=observer,
    )
    if as_json:
        click.echo(json.dumps(report.to_json(), indent=2, allow_nan=False))
        return
    if report.saturated_share is not None:
        shares = " ".join(f"{100 * share:.2f} %" for share in report.saturated_share)
        result = f"camera RGB, saturated R, G, B {shares}"
    else:
        mean, highest = report.mean_luminance_cd_m2, report.max_luminance_cd_m2
        result = f"XYZ, mean {mean:.4g} cd/m², largest {highest:.4g} cd/m²"
    step = report.step
    bands = f"{step['bands']} bands over {step['first_nm']:g}..{step['last_nm']:g} nm"
    size = f"{report.width_px} × {report.height_px} pixels of {bands}"
    click.echo(f"{output}: {size}, {report.quantity}; {result}.")
    for note in report.notes:
        click.echo(f"Note: {note}.")
