"""`cyclopean new`: a study of one's own, from pictures or from an experiment that comes with cyclopean."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from documents.text import counted
from runner.cli.monitor_option import monitor_option
from runner.cli.number_types import NUMBER

if TYPE_CHECKING:
    from runner.studies import Kind, StudyOptions

KINDS = ("pairs", "best", "rating", "within-groups")


@click.command(short_help="Write a study of your own pictures, ready to run.")
@click.argument("study", required=False, type=click.Path(path_type=Path))
@click.argument("pictures", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--kind",
    type=click.Choice(KINDS),
    default="pairs",
    show_default=True,
    help="What observers do: compare pairs, choose the best of a series, rate single pictures, or compare pairs within "
    "groups. A group is a folder, or the files whose names agree before the last underscore.",
)
@click.option("--mode", help="Stereo mode. Default: flat for flat pictures, anaglyph-red-cyan for stereo pictures.")
@click.option("--question", help="What observers are asked. Default: a question that suits --kind.")
@click.option(
    "--display",
    type=click.Path(path_type=Path),
    help="Display or rig file of a display that was measured. Default: a nominal sRGB display.",
)
@click.option(
    "--panel",
    metavar="1920x1080,0.2768",
    help="Pixels and pixel pitch in mm of the nominal display. Default: what the monitor reports.",
)
@monitor_option
@click.option(
    "--white", "white_cd_m2", type=NUMBER, help="Luminance of white in cd/m². Default: 100, or the display's."
)
@click.option("--distance", "distance_mm", type=NUMBER, help="From the eyes to the screen in mm. Default: 600.")
@click.option(
    "--fit/--no-fit",
    default=None,
    help="Bring pictures to one size on the screen, or leave them. Default: where they differ by more than 5 %.",
)
@click.option(
    "--reference",
    metavar="FILE|physical",
    help="What the pictures are compared with: a picture, or a real thing beside the screen. Default: nothing.",
)
@click.option("--from", "shipped", metavar="NAME", help="Copy an experiment that comes with cyclopean; see --list.")
@click.option("--list", "as_list", is_flag=True, help="List the experiments that come with cyclopean.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    study: Path | None,
    pictures: tuple[Path, ...],
    kind: Kind,
    mode: str | None,
    question: str | None,
    display: Path | None,
    panel: str | None,
    monitors: tuple[str, ...],
    white_cd_m2: float | None,
    distance_mm: float | None,
    fit: bool | None,
    reference: str | None,
    shipped: str | None,
    as_list: bool,
    as_json: bool,
) -> None:
    """Write a study of your own pictures, ready to run.

    STUDY is the folder to make. PICTURES are files and folders: PNG, JPEG, TIFF, WebP, MPO and JPS. Pairs are found by
    name: plate_L.jpg and plate_R.jpg, or one name in folders left/ and right/. The pictures are copied; they are shown
    pixel for pixel where they fit the screen and are of one size. Nothing is overwritten.
    """
    if as_list:
        _list(as_json)
        return
    if shipped is None and (study is None or not pictures):
        words = "my_study photos/" if study is None else f"my_study {study}" if study.exists() else f"{study} photos/"
        raise click.UsageError(f"name the folder to make and the pictures: cyclopean new {words}")
    if shipped is not None:
        _refuse_others(pictures)
        _copy(shipped, study or Path(Path(shipped).stem), as_json)
    elif study is not None:
        from runner.studies import StudyOptions, panel_of

        known = panel_of(panel) if panel else None
        options = StudyOptions(kind, mode, question, white_cd_m2, display, known, distance_mm, monitors, fit, reference)
        _write(study, pictures, options, as_json)


def _refuse_others(pictures: tuple[Path, ...]) -> None:
    """Raise UsageError if more than a folder is given together with --from."""
    context = click.get_current_context()
    given = [
        f"--{name.split('_')[0].rstrip('s')}"
        for name in context.params
        if name not in ("study", "pictures", "shipped", "as_list", "as_json")
        and context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    ]
    if pictures or given:
        others = ", ".join(given) or "other pictures"
        raise click.UsageError(f"--from copies an experiment as it is, with its own pictures: leave out {others}")


def _write(folder: Path, pictures: tuple[Path, ...], options: StudyOptions, as_json: bool) -> None:
    from documents.files import writing
    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.studies import new_study

    with writing(folder, "study", WorkError), progress_bar(quiet=as_json) as step:
        made = new_study(folder, pictures, options, progress=step)
    if as_json:
        click.echo(json.dumps(made.to_json()))
        return
    about = f"{counted(made.pictures, 'picture', 'pictures')}, {counted(made.trials, 'trial', 'trials')}"
    minutes = counted(max(1, round(made.minutes)), "minute", "minutes")
    click.echo(f"{made.folder}: {about}, about {minutes} for each observer.")
    for note in made.notes:
        click.echo(f"  {note}")
    _print_commands(made.commands)


def _list(as_json: bool) -> None:
    from runner.studies import shipped_studies

    titles = shipped_studies()
    if as_json:
        click.echo(json.dumps(titles))
        return
    for name, title in titles.items():
        click.echo(f"{name:<18}{title}")


def _copy(name: str, folder: Path, as_json: bool) -> None:
    from documents.files import writing
    from runner.cli.main import WorkError
    from runner.studies import copy_shipped

    with writing(folder, "study", WorkError):
        copied = copy_shipped(name, folder)
    if as_json:
        click.echo(json.dumps(copied.to_json()))
        return
    click.echo(f"{folder}: a copy of '{name}' with everything that it names.")
    for note in copied.notes:
        click.echo(f"  {note}")
    _print_commands(copied.commands)


def _print_commands(commands: tuple[tuple[str, ...], ...]) -> None:
    """Print what to type next, with this program as it was called where the shell would not find it."""
    from runner.studies import typed

    called = sys.argv[0]
    program = "cyclopean" if shutil.which("cyclopean") or Path(called).stem != "cyclopean" else called
    click.echo("Next:")
    for words in commands:
        click.echo(f"  {typed([program, *words[1:]])}")
