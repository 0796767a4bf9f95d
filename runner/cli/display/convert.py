"""`cyclopean display convert`: device codes to XYZ, or back, by a display file."""

from __future__ import annotations

import click


@click.command(name="convert")
@click.argument("file", metavar="[FILE]", default="-")
@click.option("--display", "display_file", required=True, metavar="DISPLAY.yaml", help="Display file.")
@click.option("--mode", required=True, help="Stereo mode of the display file.")
@click.option(
    "--eye", type=click.Choice(["left", "right"]), default="left", show_default=True, help="Eye whose model is used."
)
@click.option("--to", "target", type=click.Choice(["code", "xyz"]), required=True, help="Quantity to print.")
@click.option(
    "--full", type=click.FloatRange(min=0, min_open=True), default=255.0, show_default=True, help="Code of full drive."
)
def command(file: str, display_file: str, mode: str, eye: str, target: str, full: float) -> None:
    """Convert a table of device codes to XYZ, or back.

    Reads CSV from FILE or standard input, or the readings of an ArgyllCMS .ti3, and writes CSV to standard output:
    the columns red,green,blue, in 0..255 or up to --full, become X,Y,Z in cd/m², or the other way about. Codes are
    not rounded. Colours outside the gamut become the nearest codes channel by channel; their number is printed on
    the error stream.
    """
    import sys
    from pathlib import Path
    from typing import cast

    from devices.display import Eye, Kind, convert_colours, read_display

    display = read_display(Path(display_file))
    model = display.models(mode).eye(cast(Eye, eye))
    table = convert_colours(
        sys.stdin.buffer if file == "-" else file, model, cast(Kind, target), full, display.observers[mode]
    )
    if table.outside:
        click.echo(f"cyclopean: {table.outside} of {len(table.values)} colours lie outside the gamut", err=True)
    table.write(sys.stdout)
