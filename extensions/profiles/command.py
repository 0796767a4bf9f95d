"""`cyclopean display convert`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from runner.cli import say, takes, tell

if TYPE_CHECKING:
    from extensions.profiles.options import ConvertOptions


@click.command(name="convert")
@click.argument("file", metavar="[FILE]", default="-")
@takes("extensions.profiles.options.ConvertOptions")
def convert_command(file: str, options: ConvertOptions) -> None:
    """Convert a table of device codes to XYZ, or back; or write a display as an ICC profile or a .cube table.

    With --to code or xyz: reads CSV from FILE or standard input, or the readings of an ArgyllCMS .ti3, and writes CSV
    to standard output: the columns red,green,blue, in 0..255 or up to --full, become X,Y,Z in cd/m², or the other way
    about. XYZ include the room's light where the display file has it. Codes are not rounded. Colours outside the gamut
    become the nearest codes channel by channel; their number is printed on the error stream.

    With --to icc or cube: FILE is the display file. The model of one mode and eye is written for other programs,
    without the room's light, and how well the file agrees with the model is printed.
    """
    from extensions.profiles.convert import convert_display

    warning, lines = convert_display(None if file == "-" else file, options, sys.stdin.buffer)
    if warning:
        say(f"cyclopean: {warning}")
    tell(lines)
