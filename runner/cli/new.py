"""`cyclopean new`: a study of one's own, from pictures or from an experiment that comes with cyclopean."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import click
from click.core import ParameterSource

from documents.text import counted
from runner.cli.options import takes
from runner.studies.options import StudyOptions


@click.command(short_help="Write a study of your own pictures, ready to run.")
@click.argument("study", required=False, type=click.Path(path_type=Path))
@click.argument("pictures", nargs=-1, type=click.Path(path_type=Path))
@takes(StudyOptions, leave_out={"panel"})
@click.option(
    "--panel",
    metavar="1920x1080,0.2768",
    help="Pixels and pixel pitch in mm of the nominal display. Default: what the monitor reports.",
)
@click.option("--from", "shipped", metavar="NAME", help="Copy an experiment that comes with cyclopean; see --list.")
@click.option("--list", "as_list", is_flag=True, help="List the experiments that come with cyclopean.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    study: Path | None,
    pictures: tuple[Path, ...],
    panel: str | None,
    shipped: str | None,
    as_list: bool,
    as_json: bool,
    options: StudyOptions,
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
        from runner.studies import panel_of

        _write(study, pictures, replace(options, panel=panel_of(panel) if panel else None), as_json)


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
    from documents import WorkError
    from documents.files import writing
    from runner.cli.output import progress_bar
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
    from documents import WorkError
    from documents.files import writing
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
