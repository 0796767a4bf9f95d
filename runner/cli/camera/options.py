"""Options that the commands on photographs share, in one wording."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from runner.cli.number_types import NUMBER

_Command = TypeVar("_Command", bound=Callable[..., Any])

_FRAMES = (
    click.option(
        "--dark",
        multiple=True,
        metavar="FRAME|FOLDER",
        help="Dark frame to subtract, or a folder; several are averaged.",
    ),
    click.option(
        "--flat",
        multiple=True,
        metavar="FRAME|FOLDER",
        help="Flat field to divide by, or a folder; several are averaged.",
    ),
)
_DEVELOPING = (
    click.option(
        "--demosaic",
        type=click.Choice(["superpixel", "bilinear", "malvar", "vng", "ppg", "ahd"]),
        default="malvar",
        show_default=True,
        help="Demosaicing method; superpixel does not interpolate and halves the size.",
    ),
    click.option("--black", type=NUMBER, metavar="CODE", help="Black level of the sensor. Default: the file's own."),
    click.option("--white", type=NUMBER, metavar="CODE", help="Full scale of the sensor. Default: the file's own."),
    click.option(
        "--saturated",
        type=NUMBER,
        metavar="CODE",
        help="Level from which a photosite counts as saturated. Default: full scale.",
    ),
    *_FRAMES,
    click.option("--as-stored", is_flag=True, help="Do not rotate the picture upright."),
    click.option(
        "--linear", is_flag=True, help="Read a TIFF or OpenEXR file as linear camera RGB, whatever it declares."
    ),
    click.option(
        "--negative",
        type=click.Choice(["clip", "refuse"]),
        default="clip",
        show_default=True,
        help="What to do with negative XYZ from noise around black: set to 0 and count, or refuse.",
    ),
)


def frame_options(command: _Command) -> _Command:
    """Add ``--dark`` and ``--flat`` to a command."""
    return _added(command, _FRAMES)


def developing_options(command: _Command) -> _Command:
    """Add to a command what is asked of developing a photograph, dark frames and flat fields among it."""
    return _added(command, _DEVELOPING)


def _added(command: _Command, options: tuple[Callable[[_Command], _Command], ...]) -> _Command:
    for option in reversed(options):
        command = option(command)
    return command
