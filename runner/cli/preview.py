"""`cyclopean preview`: every screen of a session as each eye would get it, as PNG files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from documents.text import counted
from runner.cli.options import NATURAL, PATH
from runner.cli.output import Step, gives, say


@click.command(short_help="Write what each eye sees in every trial, as PNG.")
@click.argument("experiment", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Folder to write to.")
@click.option("--observer", default="01", show_default=True, help="Observer whose order of trials is shown.")
@click.option("--mode", help="Stereo mode to use instead of the rig's.")
@click.option(
    "--backend", type=click.Choice(["egl", "null", "window"]), default="egl", show_default=True, help="Where to draw."
)
@click.option("--sheet", is_flag=True, help="Write all screens on pages of small pictures instead, each screen once.")
@click.option("--first", type=NATURAL, metavar="N", help="Show the first N trials only.")
@click.option("--clipping", is_flag=True, help="Also write each screen with the pixels outside the gamut marked.")
@click.option(
    "--allow-uncharacterised",
    is_flag=True,
    help="Use another mode's characterisation if this mode has none; every record states it.",
)
@gives(indent=None)
def preview_command(experiment: Path, output: Path, step: Step, **options: Any) -> Any:
    """Write what each eye sees in every trial, as PNG.

    The files hold the exact device codes of each eye's area, named by block, screen and eye. For a first look, --sheet
    puts all screens on pages of small pictures instead. With --clipping, red marks pixels that ask a channel for more
    light than it has, blue those that ask for less than none, magenta both.
    """
    from runner.reports.screens import preview

    files = preview(experiment, output, progress=step, notify=say, **options)
    return [str(file) for file in files], [f"{counted(len(files), 'picture is', 'pictures are')} in {output}"]
