"""`cyclopean show`: one stereo image on the screen, or its exact code values in a PNG."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import click

from runner.cli.options import PATH, takes
from runner.cli.output import gives, say, show
from runner.presenter.show_options import ShowOptions


@click.command(short_help="Show one stereo image with the display's response inverted.")
@click.argument("file", type=PATH)
@click.option("--display", type=PATH, required=True, help="Display file.")
@click.option("--mode", required=True, help="Stereo mode that the display was characterised in.")
@click.option("--headless", is_flag=True, help="Draw without a window, at the panel's resolution.")
@click.option(
    "--backend", type=click.Choice(["egl", "null"]), default="egl", show_default=True, help="Where to draw if headless."
)
@takes(ShowOptions, leave_out={"backend", "notify", "on_shown"})
@gives()
def show_command(
    file: Path,
    display: Path,
    mode: str,
    headless: bool,
    backend: Literal["egl", "null"],
    options: ShowOptions,
    as_json: bool,
) -> None:
    """Show one stereo image with the display's response inverted.

    FILE is an OpenEXR picture, or a PNG, JPEG, TIFF, WebP, MPO or JPS with its --white-luminance. It stands at 1:1 in
    the middle of each eye's area until Escape is pressed. The shares of pixels that the display cannot show, and that
    keep a ghost of the other eye's picture, are printed for each eye. Crosstalk and a gain map of the display file are
    compensated. Where both eyes see the same pixels, the flat version is shown.
    Of a screenshot of 10 bits, the upper 10 of each 16-bit value are the code.
    """
    from runner.presenter.show import show_picture

    if headless and options.screenshot is None:
        raise click.UsageError("Without a window there is nothing to see: add --screenshot OUT.png.")
    on_shown = partial(show, as_json=as_json, indent=1)
    options = replace(options, backend=backend if headless else "window", notify=say, on_shown=on_shown)
    shown = show_picture(file, display, mode, options)
    work = shown.work
    if work.frames_alternated and not shown.closed:
        click.echo(f"{work.frames_alternated} frames in turn, {work.frames_missed} refreshes missed", err=as_json)
