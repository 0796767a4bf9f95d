"""`cyclopean compare`: is the rendering the photograph? In numbers, and as the eye resolves it."""

from __future__ import annotations

from pathlib import Path

import click

from runner.cli.options import PATH, takes, threads
from runner.cli.output import Step, gives, show
from runner.reports.comparison.options import ComparisonOptions


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
@takes(ComparisonOptions, leave_out={"viewing"})
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
