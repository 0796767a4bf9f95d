"""`cyclopean stimuli build`: from a recipe to pictures in absolute XYZ, and a manifest of all steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import click

from runner.cli.options import NUMBER
from runner.cli.options import threads as threads_option

if TYPE_CHECKING:
    from stimuli.build import BuildReport, BuiltStimulus

# So many names are listed; of more, the first and how many others.
_NAMED = 3


@click.command(name="build", short_help="Build the pictures of a recipe, or take them from the cache.")
@click.argument("recipe", metavar="RECIPE")
@click.option(
    "--rig", "rig_file", metavar="RIG.yaml", help="Rig that will show the pictures: its pixels, range and distance."
)
@click.option("--pixel-pitch-mm", type=NUMBER, metavar="MM", help="Pixel pitch of the display, if there is no rig.")
@click.option("-o", "--output", metavar="FOLDER", help="New folder for a copy of pictures, manifest and contact sheet.")
@click.option(
    "--export-exr", "exported", metavar="FOLDER", help="New folder for the pictures as OpenEXR in XYZ, with a recipe."
)
@click.option(
    "--jobs", type=click.IntRange(1, 256), metavar="N", help="Number of threads that make pictures. Default: 2."
)
@click.option("--force", is_flag=True, help="Build all pictures again.")
@click.option("--verify", is_flag=True, help="Read every picture in the cache, not only those changed since.")
@threads_option
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    recipe: str,
    rig_file: str | None,
    pixel_pitch_mm: float | None,
    output: str | None,
    exported: str | None,
    jobs: int | None,
    force: bool,
    verify: bool,
    as_json: bool,
) -> None:
    """Build the pictures of a recipe, or take them from the cache.

    Pictures are made once and kept in the cache; after a change of the recipe, only the pictures that it concerns are
    made again.
    A build that was stopped is resumed. Wrong input is reported with its file and reason, and leaves the cache as it
    was.

    With a rig, the percentages of pixels that its display cannot show bright enough are reported too.
    """
    import json
    from pathlib import Path

    from devices.display import read_rig
    from runner.cli.output import progress_bar
    from runner.presenter.surfaces.screens import primary_monitor
    from stimuli.build import build_report

    if (rig_file is None) == (pixel_pitch_mm is None):
        raise click.UsageError("Name the display: --rig RIG.yaml, or --pixel-pitch-mm MM.")
    rig = None if rig_file is None else read_rig(Path(rig_file), ask_monitor=primary_monitor)
    with progress_bar(as_json) as step:
        report = build_report(
            Path(recipe),
            rig=rig,
            pixel_pitch_mm=pixel_pitch_mm,
            output=None if output is None else Path(output),
            exported=None if exported is None else Path(exported),
            progress=step,
            jobs=jobs or _cores(),
            force=force,
            verify=verify,
        )
    if as_json:
        click.echo(json.dumps(report.to_json(), indent=1, allow_nan=False))
    else:
        _print(report)


def _cores() -> int:
    from documents.platform import cores

    # Not more unless asked for: each thread may hold a pair of photographs, of 36 megapixels a few GB.
    return min(2, cores())


def _print(report: BuildReport) -> None:
    """Print a table of the stimuli, notes on them, and where they lie."""
    from documents.pages import Table, print_blocks

    has_rig = report.stimuli[0].saturated_percent is not None
    title = "Luminance in cd/m², left and right eye; range in stops from the darkest to the brightest thousandth"
    if has_rig:
        title += "; pixels beyond the display in %"
    columns = ["stimulus", "view", "size", "mean", "max", "range", "RMS contrast", *["saturated %"] * has_rig]
    rows = []
    for stimulus in report.stimuli:
        eyes = stimulus.statistics["eyes"]
        shown = ["left"] if stimulus.flat else ["left", "right"]
        stops = [eyes[eye]["dynamic_range_robust"]["stops"] for eye in shown]
        cells = [
            " ".join(f"{eyes[eye]['mean_luminance_cd_m2']:.3g}" for eye in shown),
            " ".join(f"{eyes[eye]['max_luminance_cd_m2']:.3g}" for eye in shown),
            " ".join("∞" if value is None else f"{value:.1f}" for value in stops),
            " ".join(f"{eyes[eye]['rms_contrast']:.2f}" for eye in shown),
        ]
        if stimulus.saturated_percent is not None:
            cells.append(" ".join(f"{stimulus.saturated_percent[eye]['any']:.2f}" for eye in ("left", "right")))
        size = "×".join(str(side) for side in stimulus.size_px)
        rows.append((stimulus.name, "flat" if stimulus.flat else "stereo", size, *cells))
    print_blocks([Table.of_texts(title, columns, rows, words=(0, 1))])
    for note in notes(report.stimuli):
        click.echo(f"Note: {note}")
    built, count = report.built, len(report.stimuli)
    stimuli = "1 stimulus" if count == 1 else f"{count} stimuli"
    click.echo(f"{stimuli}, {built.rendered} of them made now; digest {built.digest[:16]}")
    click.echo(f"Manifest: {built.manifest_path}")
    if report.output is not None:
        click.echo(f"Copied to: {report.output}")
    if report.exported is not None:
        click.echo(f"As OpenEXR, with a recipe that shows them: {report.exported}")


def notes(stimuli: Sequence[BuiltStimulus]) -> Iterator[str]:
    """Yield the notes on the stimuli: each sentence once, with those that it holds for."""
    names_by_note: dict[str, list[str]] = {}
    for stimulus in stimuli:
        for note in dict.fromkeys(stimulus.notes):
            names_by_note.setdefault(note, []).append(stimulus.name)
    for note, names in names_by_note.items():
        yield f"{_those(names, len(stimuli))}: {note}."


def _those(names: Sequence[str], of: int) -> str:
    if len(names) == of > 1:
        return "every picture"
    if len(names) <= _NAMED:
        return ", ".join(names)
    return f"{names[0]} and {len(names) - 1} others of the {of} pictures"
