"""`cyclopean stimuli build`: from a recipe to pictures in absolute XYZ, and a manifest of what was done."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from stimuli.build.stimulus_set import StimulusSet
    from stimuli.luminance.saturated import Saturated


@click.command(name="build", short_help="Build the pictures of a recipe, or find them built.")
@click.argument("recipe", metavar="RECIPE")
@click.option("--rig", "rig_file", metavar="RIG.yaml", help="The rig that will show them: its pixels, range and place.")
@click.option("--pixel-pitch-mm", type=float, metavar="MM", help="Without a rig: the size of a display's pixel.")
@click.option("-o", "--output", metavar="FOLDER", help="Copy pictures, manifest and a contact sheet there.")
@click.option("--jobs", type=click.IntRange(1, 256), metavar="N", help="Threads that make pictures.  [2]")
@click.option("--force", is_flag=True, help="Make all pictures anew.")
@click.option(
    "--verify", is_flag=True, help="Read every picture that was built before, instead of those touched since."
)
@click.option("--json", "as_json", is_flag=True, help="Print what was built as JSON.")
def command(
    recipe: str,
    rig_file: str | None,
    pixel_pitch_mm: float | None,
    output: str | None,
    jobs: int | None,
    force: bool,
    verify: bool,
    as_json: bool,
) -> None:
    """Build the pictures of a recipe, or find them built.

    Pictures are made once and kept in the cache; of a recipe that was changed, those that the change concerns are made.
    A build that was stopped goes on where it was. Wrong input is told with its file and reason, and leaves the cache as
    it was.

    With a rig, the percentages of pixels that its display cannot show bright enough are told too.
    """
    import json
    import sys
    from pathlib import Path

    from devices.display.rig_file import read_rig
    from runner.cli.progress import progress_bar
    from runner.cli.stimuli.build_words import tell
    from stimuli.build.recipe_to_set import build_set
    from stimuli.luminance.saturated import saturated_percent
    from stimuli.recipes.build_context import DisplaySetup

    if (rig_file is None) == (pixel_pitch_mm is None):
        raise click.UsageError("Name the display: --rig RIG.yaml, or --pixel-pitch-mm MM.")
    rig = None if rig_file is None else read_rig(Path(rig_file))
    setup = None if rig is None else DisplaySetup.of(rig)
    pitch_mm = pixel_pitch_mm if rig is None else rig.display.panel.pixel_pitch_mm
    assert pitch_mm is not None
    target = None if output is None else _free(Path(output))
    with progress_bar(as_json or not sys.stderr.isatty()) as step:
        made = build_set(
            Path(recipe),
            pitch_mm,
            lambda _, done, of: step("Building stimuli", done, of),
            setup=setup,
            jobs=jobs or _cores(),
            force=force,
            verify=verify,
        )
        saturated = None
        if setup is not None:
            saturated = saturated_percent(made, setup, lambda done, of: step("Looking at stimuli", done, of))
        told = _told(made, saturated)
        if target is not None:
            from runner.reports.stimulus_copy import copy_set

            copy_set(made, target, saturated, lambda done, of: step("Copying", done, of))
            told["output"] = str(target)
    if as_json:
        click.echo(json.dumps(told, indent=1, allow_nan=False, ensure_ascii=False))
    else:
        tell(told)


def _cores() -> int:
    from documents.platform import cores

    # Not more unless asked for: each thread may hold a pair of photographs, of 36 megapixels a few GB.
    return min(2, cores())


def _free(folder: Path) -> Path:
    """Return ``folder``, refusing one that holds anything or lies in the cache, which is tidied up."""
    from documents import Finding, InputError
    from stimuli.build.recipe_to_set import cache_folder

    try:
        taken = folder.exists() and (not folder.is_dir() or any(folder.iterdir()))
        in_cache = folder.resolve().is_relative_to(cache_folder().resolve())
    except (OSError, RuntimeError) as error:  # links that lead to one another are a RuntimeError
        reason = getattr(error, "strerror", None) or error
        raise InputError(Finding(f"the folder cannot be made: {reason}", str(folder))) from error
    if in_cache:
        raise InputError(Finding("it lies in the cache of stimuli", str(folder), remedy="name a folder of your own"))
    if taken:
        raise InputError(Finding("there is something already", str(folder), remedy="name a new or an empty folder"))
    return folder


def _told(made: StimulusSet, saturated: Mapping[str, Saturated] | None) -> dict[str, Any]:
    from runner.cli.stimuli.build_words import tone_mapped

    stimuli = []
    for entry in made.manifest["stimuli"]:
        one = {key: entry[key] for key in ("name", "factors", "flat", "size_px", "statistics")}
        said = [sentence for step in entry["steps"] for sentence in step.get("said", ())]
        tone = next((step for step in entry["steps"] if step["step"] == "tone_map"), None)
        if tone is not None:
            said.append(tone_mapped(tone))
        one["said"] = said
        if saturated is not None:
            one["saturated_percent"] = saturated[entry["name"]]
        stimuli.append(one)
    return {
        "recipe": str(made.recipe_path),
        "folder": str(made.folder),
        "manifest": str(made.manifest_path),
        "digest": made.digest,
        "rendered": made.rendered,
        "stimuli": stimuli,
    }
