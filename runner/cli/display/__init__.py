"""`cyclopean display`: measure a display, fit a model to it, and check both; its commands load one at a time."""

from __future__ import annotations

import click

from runner.cli.main import LazyGroup

# A command's module is runner.cli.display.<name>; the text is its line in the help.
COMMANDS = {
    "new": "Write the file of a nominal display, to begin with before it is measured.",
    "patches": "Show patches of known device codes full-screen in a stereo mode.",
    "measure": "Show patches and read each with an instrument.",
    "fit": "Fit display models to measurements and choose the one that predicts best.",
    "verify": "Show new colours, read them, and report the colour error.",
    "convert": "Convert codes to XYZ or back, or a display file to an ICC profile or .cube.",
    "metamerism": "Find how differently observers see an object beside its match on the screen.",
    "report": "Write an HTML page that judges a display by its measurements.",
}


@click.group(cls=LazyGroup, name="display", package="runner.cli.display", commands_help=COMMANDS)
def command() -> None:
    """Measure a display, fit a model to it, and check both."""
