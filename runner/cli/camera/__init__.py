"""`cyclopean camera`: characterise a camera, and develop its photographs; its commands load one at a time."""

from __future__ import annotations

import click

from runner.cli.main import LazyGroup

# A command's module is runner.cli.camera.<name>; the text is its line in the help.
COMMANDS = {
    "fit": "Fit a camera model to a photographed colour chart.",
    "develop": "Turn photographs into pictures of linear light.",
    "geometry": "Pixels per millimetre from sensor, lens and distance, and back.",
    "bracket": "Merge exposures of one scene into one picture of linear light.",
    "spectral": "Turn a spectral picture into XYZ, or into what a camera records.",
}


@click.group(cls=LazyGroup, name="camera", package="runner.cli.camera", commands_help=COMMANDS)
def command() -> None:
    """Fit a camera to a colour chart, develop its photographs, and plan how finely it sees."""
