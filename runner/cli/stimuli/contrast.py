"""`cyclopean stimuli contrast`: how the contrast of sparkles changes with the exposure of their photographs."""

from __future__ import annotations

import click

from documents.files import writing
from runner.cli.options import NUMBER, Within


@click.command(name="contrast", short_help="Contrast of sparkles over the exposure of their photographs.")
@click.argument("recipe", metavar="RECIPE")
@click.option("--rig", "rig_file", metavar="RIG.yaml", help="Rig that will show the pictures; its display clips them.")
@click.option("--pixel-pitch-mm", type=NUMBER, metavar="MM", help="Pixel pitch of the display, if there is no rig.")
@click.option(
    "--stimuli", "names", metavar="NAME,...", help="Pictures of one plate. Default: all that were not scaled."
)
@click.option(
    "--mean", "mean_cd_m2", type=NUMBER, metavar="CD_M2", help="Mean luminance to bring each picture to before."
)
@click.option(
    "--times",
    type=Within(1, 1e12, min_open=True),
    default=2.0,
    show_default=True,
    help="A sparkle is so many times as bright as its background.",
)
@click.option("-o", "--output", metavar="FIGURE.svg|.pdf", help="Figure to write.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    recipe: str,
    rig_file: str | None,
    pixel_pitch_mm: float | None,
    names: str | None,
    mean_cd_m2: float | None,
    times: float,
    output: str | None,
    as_json: bool,
) -> None:
    """Contrast of sparkles over the exposure of their photographs.

    RECIPE photographs one plate at two exposures or more; its pictures are built, or taken from the cache. All are
    measured at the sparkles of the shortest exposure: long exposures fill the sensor, and the contrast falls.
    """
    import json
    from pathlib import Path

    from devices.display import read_rig
    from documents import WorkError
    from runner.cli.output import progress_bar
    from runner.presenter.surfaces.screens import primary_monitor
    from runner.reports.contrast import check_figure, contrast_of_set, lines, write_figure
    from stimuli.build import build_set
    from stimuli.recipes import DisplaySetup
    from stimuli.sparkle import Threshold

    if (rig_file is None) == (pixel_pitch_mm is None):
        raise click.UsageError("Name the display: --rig RIG.yaml, or --pixel-pitch-mm MM.")
    figure = None if output is None else Path(output)
    if figure is not None:
        check_figure(figure)
    rig = None if rig_file is None else read_rig(Path(rig_file), ask_monitor=primary_monitor)
    pitch_mm = pixel_pitch_mm if rig is None else rig.display.panel.pixel_pitch_mm
    assert pitch_mm is not None
    with progress_bar(as_json) as step:
        setup = None if rig is None else DisplaySetup.of(rig)
        built = build_set(Path(recipe), pitch_mm, step, setup=setup)
    chosen = [name.strip() for name in names.split(",")] if names else []
    found = contrast_of_set(built, rig, names=chosen, threshold=Threshold(times), mean_cd_m2=mean_cd_m2)
    if figure is not None:
        with writing(figure, "figure", WorkError):
            write_figure(found, figure)
    if as_json:
        click.echo(json.dumps(found.to_json() | {"figure": output}, indent=2, allow_nan=False))
        return
    click.echo("\n".join(lines(found)))
    if output:
        click.echo(f"Figure: {output}")
