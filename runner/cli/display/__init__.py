"""`cyclopean display`: measure a display, fit a model to it, and check both."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from runner.cli.main import LazyGroup
from runner.cli.options import PATH, takes
from runner.cli.output import gives, say, tell
from runner.measuring import Dialogue, MeasureOptions, PatchesOptions, VerifyOptions

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
_rig_or_display = click.argument("rig_or_display", type=PATH)


@click.group(cls=LazyGroup, name="display", package=__name__, commands_help=COMMANDS)
def display_command() -> None:
    """Measure a display, fit a model to it, and check both."""


command = display_command


def _dialogue(*, quiet: bool = False) -> Dialogue:
    """Return what talks with the person on the error stream and standard input; ``quiet`` of each patch."""
    return Dialogue(say, _ask) if quiet else Dialogue(say, _ask, say)


def _ask(prompt: str) -> str | None:
    click.echo(prompt, nl=False, err=True)
    typed = sys.stdin.readline()
    return typed.rstrip("\n") if typed else None


@click.command(name="patches")
@_rig_or_display
@takes(PatchesOptions)
@gives(indent=None)
def patches_command(rig_or_display: Path, options: PatchesOptions) -> Any:
    """Show patches of known device codes full-screen in a stereo mode.

    Both eyes see them, or one while the other sees black, so that the mode stays enabled. Right and left show the next
    and the previous patch, space pauses, Escape stops. The order is shuffled by the seed; black and white come again
    throughout.
    """
    from runner.measuring import show_patches

    shown = show_patches(rig_or_display, options, _dialogue())
    return tell(shown.told()) if options.list_only else shown


@click.command(name="measure")
@_rig_or_display
@takes(MeasureOptions)
@gives(indent=None)
def measure_command(rig_or_display: Path, options: MeasureOptions, as_json: bool) -> Any:
    """Show patches and read each with an instrument.

    Readings go to NAME.jsonl one by one, and to a table at the end, for `display fit` and `display report`. Space
    pauses, Escape stops after the reading; --resume continues. Close the blinds, and let the display warm up first,
    unless the warm-up is measured. Where the instrument or the glasses must be moved, the run says so and waits.
    """
    from runner.measuring import measure_display

    return measure_display(rig_or_display, options, _dialogue(quiet=as_json))


@click.command(name="verify")
@takes(VerifyOptions)
@gives(indent=None)
def verify_command(options: VerifyOptions, as_json: bool) -> Any:
    """Show new colours, read them, and report the colour error.

    The 24 colours of the ColorChecker are asked in XYZ, adapted and scaled into the display's gamut, and shown as a
    session shows its pictures: by the same shader, with crosstalk cancelled and the panel evened out, undithered. The
    differences are in ΔE00 against the display's white. Beside them stands what the display file alone predicts of the
    codes shown.
    """
    from runner.measuring import verify_display

    return verify_display(options, _dialogue(quiet=as_json))
