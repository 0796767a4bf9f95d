"""`cyclopean stimuli`: build the pictures of a recipe, and list what is in the cache."""

from __future__ import annotations

import click

from runner.cli.main import LazyGroup

# A command's module is runner.cli.stimuli.<name>; the text is its line in the help.
COMMANDS = {
    "build": "Build the pictures of a recipe, or take them from the cache.",
    "contrast": "Contrast of sparkles over the exposure of their photographs.",
    "list": "List the stimulus sets in the cache.",
    "clean": "Remove leftovers of killed builds from the cache.",
}


@click.group(cls=LazyGroup, name="stimuli", package="runner.cli.stimuli", commands_help=COMMANDS)
def command() -> None:
    """Build stimuli from photographs, other pictures or computed plates, and measure them."""
