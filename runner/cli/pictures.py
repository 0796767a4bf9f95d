"""Commands on pictures: `preview`, `show` and `compare`."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from documents.text import counted
from runner.cli.options import NATURAL, PATH, takes, threads
from runner.cli.output import Step, gives, say, show

if TYPE_CHECKING:
    from runner.presenter.show_options import ShowOptions
    from runner.reports import ComparisonOptions


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


@click.command(short_help="Show one stereo image with the display's response inverted.")
@click.argument("file", type=PATH)
@click.option("--display", type=PATH, required=True, help="Display file.")
@click.option("--mode", required=True, help="Stereo mode that the display was characterised in.")
@click.option("--headless", is_flag=True, help="Draw without a window, at the panel's resolution.")
@click.option(
    "--backend", type=click.Choice(["egl", "null"]), default="egl", show_default=True, help="Where to draw if headless."
)
@takes("runner.presenter.show_options.ShowOptions", leave_out={"backend", "notify", "on_shown"})
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


@click.command(name="compare", short_help="Compare a rendering with a photograph, and report whether it is validated.")
@click.argument("photo", metavar="PHOTO", type=PATH)
@click.argument("rendering", metavar="RENDERING", type=PATH)
@click.option(
    "--regions",
    required=True,
    type=PATH,
    metavar="R.yaml",
    help="File of the regions to compare (chart, plates, areas) and the limits.",
)
@takes("runner.reports.ComparisonOptions", leave_out={"viewing"})
@threads
@gives()
def compare_command(
    photo: Path, rendering: Path, regions: Path, options: ComparisonOptions, as_json: bool, step: Step
) -> None:
    """Compare a rendering with a photograph, and report whether it is validated.

    PHOTO and RENDERING are OpenEXR or TIFF of XYZ or of camera RGB, raw photographs, spectral pictures, or, with
    --colour-space and --picture-white, pictures such as PNG and JPEG. They are brought to one grid, and compared by
    regions, pixel by pixel, as the eye resolves them at the viewing distance, and by their sparkles.

    Exit status: 0 validated, 1 not validated or undecided, 2 the input was wrong, and nothing was written.
    """
    from runner.reports.comparison.report import report_comparison

    asked = click.get_current_context().params
    found = report_comparison(photo, rendering, regions, options, progress=step, asked=asked)
    show(found, as_json=as_json, work=True)
    if not found.validated:
        raise SystemExit(1)
