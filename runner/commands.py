"""The commands of `cyclopean` by name: ours, with their lines in the help, and those that other packages add."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from click import Command

    from documents.extensions import Registry

# The text is a command's line in the group's help.
COMMANDS = {
    "new": "Write a study of your own pictures, ready to run.",
    "check": "Check an experiment file and everything it names.",
    "run": "Run a session with an observer.",
    "watch": "Show the sessions that are running, on this station and others.",
    "report": "Write an HTML report on the results of one experiment.",
    "export": "Write results as a BIDS dataset, or in another form.",
    "verify": "Check that results are as they were recorded.",
    "seal": "Write down the SHA-256 of every file of results.",
    "scores": "Fit scores and perceptual classes to a table of paired comparisons.",
    "power": "Find how many observers an experiment needs, by simulated studies.",
    "preview": "Write what each eye sees in every trial, as PNG.",
    "display": "Measure a display, fit a model to it, and check both.",
    "camera": "Fit a camera to a colour chart, develop its photographs, and plan how finely it sees.",
    "compare": "Compare a rendering with a photograph, and report whether it is validated.",
    "agreement": "Compare measures of an experiment's pictures with its observers.",
    "stimuli": "Build stimuli from photographs, other pictures or computed plates, and measure them.",
    "show": "Show one stereo image with the display's response inverted.",
    "demo": "Repeat the thesis's second experiment with simulated observers.",
    "doctor": "Report what this machine can do.",
    "schema": "Print the JSON Schema of a file that you write.",
    "completion": "Print what makes a shell complete commands at Tab.",
    "help": "Print the help text of a command.",
}
GROUPS = {
    "display": {
        "new": "Write the file of a nominal display, to begin with before it is measured.",
        "patches": "Show patches of known device codes full-screen in a stereo mode.",
        "measure": "Show patches and read each with an instrument.",
        "fit": "Fit display models to measurements and choose the one that predicts best.",
        "verify": "Show new colours, read them, and report the colour error.",
        "convert": "Convert codes to XYZ or back, or a display file to an ICC profile or .cube.",
        "metamerism": "Find how differently observers see an object beside its match on the screen.",
        "report": "Write an HTML page that judges a display by its measurements.",
    },
    "camera": {
        "fit": "Fit a camera model to a photographed colour chart.",
        "develop": "Turn photographs into pictures of linear light.",
        "geometry": "Pixels per millimetre from sensor, lens and distance, and back.",
        "bracket": "Merge exposures of one scene into one picture of linear light.",
        "spectral": "Turn a spectral picture into XYZ, or into what a camera records.",
    },
    "stimuli": {
        "build": "Build the pictures of a recipe, or take them from the cache.",
        "contrast": "Contrast of sparkles over the exposure of their photographs.",
        "list": "List the stimulus sets in the cache.",
        "clean": "Remove leftovers of killed builds from the cache.",
    },
}
# Those of our extensions have a line above, so that the help loads nothing. `camera fit` is offered as "camera.fit".
_EXTENSIONS = (
    *("agreement", "camera.bracket", "camera.fit", "display.convert", "display.metamerism", "power"),
    "stimuli.contrast",
)
# Where each of the core's is.
OURS = {
    name: f"runner.cli.functions:{name.replace('.', '_')}_command"
    for name in (*COMMANDS, *(f"{group}.{name}" for group, lines in GROUPS.items() for name in lines))
    if name not in _EXTENSIONS
}


@cache
def commands() -> Registry[Command]:
    """Return the commands by name, those of other packages too."""
    from documents.extensions import Registry

    def wrong(name: str, command: Any) -> str | None:
        return None if hasattr(command, "make_context") else "is no command of click"

    return Registry("cyclopean.commands", OURS, wrong)
