"""`cyclopean stimuli`: build the pictures of a recipe, measure them, and look after the cache."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from runner.cli.main import LazyGroup
from runner.cli.options import NOT_NEGATIVE, NUMBER, PATH, Within, threads
from runner.cli.output import Step, gives

if TYPE_CHECKING:
    from devices.display import Rig
    from documents.pages import Block

COMMANDS = {
    "build": "Build the pictures of a recipe, or take them from the cache.",
    "contrast": "Contrast of sparkles over the exposure of their photographs.",
    "list": "List the stimulus sets in the cache.",
    "clean": "Remove leftovers of killed builds from the cache.",
}
_recipe = click.argument("recipe", metavar="RECIPE", type=PATH)
_pitch = click.option(
    "--pixel-pitch-mm", type=NUMBER, metavar="MM", help="Pixel pitch of the display, if there is no rig."
)


@click.group(cls=LazyGroup, name="stimuli", package=__name__, commands_help=COMMANDS)
def stimuli_command() -> None:
    """Build stimuli from photographs, other pictures or computed plates, and measure them."""


@click.command(name="build", short_help="Build the pictures of a recipe, or take them from the cache.")
@_recipe
@click.option(
    "--rig", type=PATH, metavar="RIG.yaml", help="Rig that will show the pictures: its pixels, range and distance."
)
@_pitch
@click.option(
    "-o",
    "--output",
    type=PATH,
    metavar="FOLDER",
    help="New folder for a copy of pictures, manifest and contact sheet.",
)
@click.option(
    "--export-exr",
    "exported",
    type=PATH,
    metavar="FOLDER",
    help="New folder for the pictures as OpenEXR in XYZ, with a recipe.",
)
@click.option(
    "--jobs", type=click.IntRange(1, 256), metavar="N", help="Number of threads that make pictures. Default: 2."
)
@click.option("--force", is_flag=True, help="Build all pictures again.")
@click.option("--verify", is_flag=True, help="Read every picture in the cache, not only those changed since.")
@threads
@gives(indent=1)
def build_command(
    recipe: Path, rig: Path | None, pixel_pitch_mm: float | None, jobs: int | None, step: Step, **options: Any
) -> Any:
    """Build the pictures of a recipe, or take them from the cache.

    Pictures are made once and kept in the cache; after a change of the recipe, only the pictures that it concerns are
    made again.
    A build that was stopped is resumed. Wrong input is reported with its file and reason, and leaves the cache as it
    was.

    With a rig, the percentages of pixels that its display cannot show bright enough are reported too.
    """
    from documents.platform import cores
    from stimuli.build import build_report

    shown_by = _rig(rig, pixel_pitch_mm)
    # Not more than two unless asked for: each thread may hold a pair of photographs, of 36 megapixels a few GB.
    at_once = jobs or min(2, cores())
    return build_report(recipe, rig=shown_by, pixel_pitch_mm=pixel_pitch_mm, progress=step, jobs=at_once, **options)


def _rig(rig: Path | None, pixel_pitch_mm: float | None) -> Rig | None:
    """Return the rig, None where the pixel pitch stands for it; one of them must be given."""
    from devices.display import read_rig
    from runner.presenter import primary_monitor

    if (rig is None) == (pixel_pitch_mm is None):
        raise click.UsageError("Name the display: --rig RIG.yaml, or --pixel-pitch-mm MM.")
    return None if rig is None else read_rig(rig, ask_monitor=primary_monitor)


@click.command(name="contrast", short_help="Contrast of sparkles over the exposure of their photographs.")
@_recipe
@click.option("--rig", type=PATH, metavar="RIG.yaml", help="Rig that will show the pictures; its display clips them.")
@_pitch
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
@click.option("-o", "--output", type=PATH, metavar="FIGURE.svg|.pdf", help="Figure to write.")
@gives()
def contrast_command(
    recipe: Path,
    rig: Path | None,
    pixel_pitch_mm: float | None,
    names: str | None,
    mean_cd_m2: float | None,
    times: float,
    output: Path | None,
    step: Step,
) -> Any:
    """Contrast of sparkles over the exposure of their photographs.

    RECIPE photographs one plate at two exposures or more; its pictures are built, or taken from the cache. All are
    measured at the sparkles of the shortest exposure: long exposures fill the sensor, and the contrast falls.
    """
    from documents import WorkError
    from documents.files import writing
    from runner.reports.contrast import check_figure, contrast_of_set, lines, write_figure
    from stimuli.build import build_set
    from stimuli.recipes import DisplaySetup
    from stimuli.sparkle import Threshold

    shown_by = _rig(rig, pixel_pitch_mm)
    if output is not None:
        check_figure(output)
    pitch_mm = pixel_pitch_mm if shown_by is None else shown_by.display.panel.pixel_pitch_mm
    assert pitch_mm is not None
    built = build_set(recipe, pitch_mm, step, setup=None if shown_by is None else DisplaySetup.of(shown_by))
    chosen = [name.strip() for name in names.split(",")] if names else []
    found = contrast_of_set(built, shown_by, names=chosen, threshold=Threshold(times), mean_cd_m2=mean_cd_m2)
    if output is not None:
        with writing(output, "figure", WorkError):
            write_figure(found, output)
    figure = None if output is None else str(output)
    return found.to_json() | {"figure": figure}, (*lines(found), *([f"Figure: {figure}"] if figure else []))


@click.command(name="list", short_help="List the stimulus sets in the cache.")
@gives(indent=1)
def list_command() -> Any:
    """List the stimulus sets in the cache: how many pictures, of which kind, how large. Any may be deleted."""
    from stimuli.build import cache_folder, cached_sets, leftovers

    sets = list(cached_sets())

    def told() -> Iterator[str | Block]:
        from documents.pages import Table

        rows = []
        for cached in sets:
            cells = (cached.kind, len(cached.names), cached.names[0], f"{cached.pixel_pitch_mm:g}")
            rows.append((*map(str, cells), f"{cached.bytes / 1e6:.1f}", cached.folder.name))
        yield Table.of_texts("", ("kind", "stimuli", "first", "pitch mm", "MB", "folder"), rows, words=(0, 2))
        yield f"In {cache_folder()}"
        for left in leftovers():
            yield (
                f"Unfinished: {left}, untouched for {left.untouched_s / 3600:.1f} hours "
                "(its next build resumes there; `cyclopean stimuli clean` removes it)"
            )

    return [cached.to_json() for cached in sets], told()


@click.command(name="clean", short_help="Remove leftovers of killed builds from the cache.")
@click.option(
    "--hours",
    type=NOT_NEGATIVE,
    default=24.0,
    show_default=True,
    help="Hours since the last write after which a build counts as killed.",
)
@gives(indent=1)
def clean_command(hours: float) -> Any:
    """Remove leftovers of killed builds from the cache.

    The next build of the same recipe would have resumed there. Finished sets stay, and so do those being built now.
    """
    from stimuli.build import cache_folder, leftovers, remove_leftovers

    removed = remove_leftovers(hours * 3600)
    told = [f"Removed {leftover}" for leftover in removed]
    if left := sum(1 for _ in leftovers()):
        told.append(f"Left alone: {left} unfinished, built or touched in the last {hours:g} hours")
    elif not removed:
        told.append(f"There is nothing to remove in {cache_folder()}")
    return [leftover.to_json() for leftover in removed], told
