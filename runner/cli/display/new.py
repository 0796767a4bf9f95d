"""`cyclopean display new`: the file of a nominal display."""

from __future__ import annotations

from pathlib import Path

import click

from runner.cli.options import NOT_NEGATIVE, POSITIVE

# As devices.display.nominal.NominalKind has them; repeated here so that help appears at once.
KINDS = ("srgb", "gamma2.2", "bt1886", "display-p3")


@click.command(short_help="Write the file of a nominal display, to begin with before it is measured.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, help="Display file to write: NAME.yaml."
)
@click.option(
    "--nominal", "kind", type=click.Choice(KINDS), default="srgb", show_default=True, help="Standard it is taken for."
)
@click.option(
    "--white-cd-m2",
    type=POSITIVE,
    default=100.0,
    show_default=True,
    metavar="CD_M2",
    help="Luminance of its white, without glasses.",
)
@click.option(
    "--black-cd-m2",
    type=NOT_NEGATIVE,
    metavar="CD_M2",
    help="Luminance of its black.  [default: 0.1 % of white]",
)
@click.option(
    "--panel",
    metavar="W x H,PITCH_MM[,HZ[,BITS]]",
    help="Panel, such as 1920x1080,0.2768,60,8.  [default: as the monitor reports it]",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    output: Path, kind: str, white_cd_m2: float, black_cd_m2: float | None, panel: str | None, as_json: bool
) -> None:
    """Write the file of a nominal display, to begin with before it is measured.

    A nominal display shows colours by a standard, in every stereo mode. Every record and report of its sessions says
    "nominal, not measured". Nothing is overwritten.

    \b
    Examples:
      cyclopean display new -o monitor.yaml
      cyclopean display new -o projector.yaml --nominal bt1886 --white-cd-m2 48 --panel 1920x1080,1.2
    """
    import json

    from devices.display import NEXT_STEP, NOT_MEASURED, NominalSpec, read_display, write_nominal_display
    from runner.cli.display.measuring_options import panel_of
    from runner.presenter import primary_monitor

    if black_cd_m2 is not None and black_cd_m2 >= white_cd_m2:
        raise click.UsageError(f"--black-cd-m2 is {black_cd_m2:g}; it must be below --white-cd-m2, {white_cd_m2:g}")
    spec = NominalSpec.model_validate(
        {
            "nominal": kind,
            "white_cd_m2": white_cd_m2,
            "black_cd_m2": black_cd_m2,
            "panel": panel_of(panel) if panel else None,
        }
    )
    nominal = write_nominal_display(output, spec, primary_monitor)
    stated = read_display(output).panel
    if as_json:
        facts = {"file": str(output), "nominal": nominal.to_json(), "panel": stated.model_dump(mode="json")}
        click.echo(json.dumps(facts))
        return
    across, down = stated.resolution_px
    size = f"{across} x {down} px of {stated.pixel_pitch_mm:g} mm, {stated.refresh_hz:g} Hz"
    click.echo(f"wrote {output}: {NOT_MEASURED}: {nominal.words}; {size}")
    click.echo(f"Name it in a rig: display: {output.name}. Next step, {NEXT_STEP}")
