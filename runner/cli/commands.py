"""Commands that do more than call a function: they read standard input, or print while they work."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import get_completion_class

from documents import WorkError
from documents.files import writing
from runner.cli.options import PATH, Within, takes
from runner.cli.output import Step, gives, print_json, say, show, tell, work_done
from runner.protocol.schemas import KINDS, FileKind, json_schema

if TYPE_CHECKING:
    from documents.pages import Block
    from runner.check import CheckOptions
    from runner.presenter.show_options import ShowOptions
    from runner.reports import ScoresOptions
    from runner.session.options import SessionOptions
    from runner.studies import StudyOptions


@click.command(name="new")
@click.argument("study", required=False, type=PATH)
@click.argument("pictures", nargs=-1, type=PATH)
@takes("runner.studies.StudyOptions")
@click.option("--from", "shipped", metavar="NAME", help="Copy an experiment that comes with cyclopean; see --list.")
@click.option("--list", "as_list", is_flag=True, help="List the experiments that come with cyclopean.")
@gives(indent=None)
def new_command(
    study: Path | None,
    pictures: tuple[Path, ...],
    options: StudyOptions,
    shipped: str | None,
    as_list: bool,
    progress: Step,
) -> Any:
    """Write a study of your own pictures, ready to run.

    STUDY is the folder to make. PICTURES are files and folders: PNG, JPEG, TIFF, WebP, MPO and JPS. Pairs are found by
    name: plate_L.jpg and plate_R.jpg, or one name in folders left/ and right/. The pictures are copied; they are shown
    pixel for pixel where they fit the screen and are of one size. Nothing is overwritten.
    """
    from runner.studies import copy_shipped, new_study, shipped_studies

    if as_list:
        titles = shipped_studies()
        return titles, (f"{name:<18}{title}" for name, title in titles.items())
    with writing(study or Path(shipped or ""), "study", WorkError):
        if shipped is not None:
            return copy_shipped(shipped, study, pictures, options)
        return new_study(study, pictures, options, progress=progress)


@click.command(name="check")
@click.argument("files", nargs=-1, required=True, type=PATH)
@takes("runner.check.CheckOptions", leave_out={"progress"})
@gives()
def check_command(files: tuple[Path, ...], options: CheckOptions, as_json: bool, progress: Step) -> None:
    """Check an experiment file and everything it names.

    FILES may be experiments, displays, rigs, stimulus recipes, cameras, regions and simulated observers. All errors
    are reported at once, each with file, line, column and a remedy. With an error no session can run, and the exit
    status is 2. A warning is something to think about.
    """
    from runner.check import TRIED_OBSERVERS, check_file

    options = replace(options, observers=options.observers or TRIED_OBSERVERS, progress=progress)
    checked = []
    for file in files:
        checked.append(check_file(file, options))
        if not as_json:
            show(checked[-1], as_json=False)
    if as_json:
        print_json([report.to_json() for report in checked], None)
    if any(report.errors for report in checked):
        sys.exit(2)


@click.command(name="run")
@click.argument("experiment", type=PATH)
@click.option("--observer", required=True, help="Code of the observer: letters and digits, such as 01.")
@takes("runner.session.options.SessionOptions", leave_out={"progress", "notify", "listeners"})
@click.option(
    "--console/--no-console",
    default=None,
    help="Take notes and marks in this terminal during the session. Default: if a person answers.",
)
@gives(indent=None)
def run_command(
    experiment: Path, observer: str, console: bool | None, options: SessionOptions, as_json: bool, progress: Step
) -> Any:
    """Run a session with an observer.

    EXPERIMENT is a file such as experiments/dynamic_range.yaml. Every answer is on disk before the next trial
    appears. The observer answers with the keys that the instructions name; Escape opens a menu: continue, repeat, note,
    stop. Meanwhile the experimenter can type notes at the terminal, and 'r' to have the last trial asked again.

    Exit status: 0 if the session is complete, also where a failed vision test ended it; 1 if it was stopped, closed,
    interrupted or failed, with the command that continues it; 2 if the input was wrong.
    """
    from runner.errors import UsedCodeError
    from runner.session.console import ConsoleStatus, at_a_terminal
    from runner.session.run import run_session

    if options.simulate and Path(options.simulate).suffix == ".jsonl":
        options = replace(options, simulate=None, replay=options.simulate)
    if console is None:
        console = options.of_a_person and options.backend in (None, "window") and at_a_terminal()
    with ConsoleStatus(observer, progress, console and not options.replay) as shown:
        options = replace(options, progress=progress, notify=say, listeners=(shown,))
        try:
            return run_session(experiment, observer, options)
        except UsedCodeError as error:
            if not options.of_a_person or as_json or not at_a_terminal():
                raise
            say(error.what)
            if not click.confirm("Is this the same person, who sits once more?", err=True):
                raise
            return run_session(experiment, observer, replace(options, again=True))


@click.command(name="scores")
@click.argument("table", metavar="TABLE.csv")
@takes("runner.reports.ScoresOptions")
@gives()
def scores_command(table: str, options: ScoresOptions, as_json: bool) -> None:
    """Fit scores and perceptual classes to a table of paired comparisons.

    TABLE.csv has the columns winner,loser and optionally count, observer, first (the item shown first), outcome (win or
    tie) or ties (how many were tied), and group, scene or content: each group then has scores of its own. Tables of
    choices, square matrices of counts (also MAT-files) and pwcmp's tables are read too. A single dash reads the table
    from standard input.
    """
    from analysis.comparisons import read_any
    from runner.reports.scores import refuse_together, score_table

    refuse_together(options)  # before the table is read
    source = sys.stdin.buffer if table == "-" else table
    read = read_any(
        source, "standard input", layout=options.layout, choice_codes=options.codes, keep_na=options.keep_na
    )
    if as_json:
        for line in read.warnings:
            say(f"warning: {line}")
    else:
        tell(read.lines)
    with writing(options.observer_scores or Path("."), "table", WorkError):
        scored = score_table(read.comparisons, options)
    if as_json:
        whose = {"method_of": scored.whose} if scored.whose else {}
        print_json(scored.to_json() | whose | read.to_json() | work_done())
    else:
        tell([*scored.told(), *([f"the method '{options.method}' is of {scored.whose}"] if scored.whose else [])])
    if problems := scored.problems:
        say("\n".join([f"cyclopean: {problems[0]}", *problems[1:]]))
        sys.exit(1)


@click.command(name="show")
@click.argument("file", type=PATH)
@click.option("--display", type=PATH, required=True, help="Display file.")
@click.option("--mode", required=True, help="Stereo mode that the display was characterised in.")
@takes("runner.presenter.show_options.ShowOptions", leave_out={"notify", "on_shown"})
@gives()
def show_command(file: Path, display: Path, mode: str, options: ShowOptions, as_json: bool) -> None:
    """Show one stereo image with the display's response inverted.

    FILE is an OpenEXR picture, or a PNG, JPEG, TIFF, WebP, MPO or JPS with its --white-luminance. It stands at 1:1 in
    the middle of each eye's area until Escape is pressed. The shares of pixels that the display cannot show, and that
    keep a ghost of the other eye's picture, are printed for each eye. Crosstalk and a gain map of the display file are
    compensated. Where both eyes see the same pixels, the flat version is shown.
    Of a screenshot of 10 bits, the upper 10 of each 16-bit value are the code.
    """
    from runner.presenter.show import show_picture

    options = replace(options, notify=say, on_shown=partial(show, as_json=as_json, indent=1))
    shown = show_picture(file, display, mode, options)
    work = shown.work
    if work.frames_alternated and not shown.closed:
        line = f"{work.frames_alternated} frames in turn, {work.frames_missed} refreshes missed"
        say(line) if as_json else tell([line])


@click.command(name="list")
@gives(indent=1)
def stimuli_list_command() -> Any:
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


@click.command(name="clean")
@click.option(
    "--hours",
    type=Within(0, 1e12),
    default=24.0,
    show_default=True,
    help="Hours since the last write after which a build counts as killed.",
)
@gives(indent=1)
def stimuli_clean_command(hours: float) -> Any:
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


@click.command()
@click.argument("kind", type=click.Choice(KINDS), default="experiment")
def schema_command(kind: FileKind) -> None:
    """Print the JSON Schema of a file that you write.

    Save it and name it in your editor's settings for YAML. The editor then completes keys and marks mistakes.
    """
    print_json(json_schema(kind))


@click.command()
@click.argument("shell", type=click.Choice(("bash", "zsh", "fish")))
@click.pass_context
def completion_command(ctx: click.Context, shell: str) -> None:
    """Print what makes a shell complete commands at Tab.

    Put the line of the example that suits your shell into ~/.bashrc, ~/.zshrc or ~/.config/fish/config.fish. Tab then
    completes commands, options, their values and files.
    """
    kind = get_completion_class(shell)
    if kind is None:
        raise click.UsageError(f"nothing is known of the shell '{shell}'")
    tell([kind(ctx.find_root().command, {}, "cyclopean", "_CYCLOPEAN_COMPLETE").source()])


@click.command()
@click.argument("words", nargs=-1, metavar="[COMMAND]...")
@click.pass_context
def help_command(ctx: click.Context, words: tuple[str, ...]) -> None:
    """Print the help text of a command.

    Without COMMAND, print what commands there are. `cyclopean COMMAND --help` prints the same.
    """
    here = ctx.find_root()
    for word in words:
        if not isinstance(here.command, click.Group):
            raise click.UsageError(f"'{here.command_path}' has no commands of its own: cyclopean help {here.info_name}")
        _, below, _ = here.command.resolve_command(here, [word])
        if below is None:
            raise click.UsageError(f"There is no command '{word}'.", here)
        here = click.Context(below, info_name=word, parent=here)
    tell([here.get_help()])
    if not words:
        from documents.extensions import installed
        from runner.commands import commands

        offers = [offer for offer in installed() if offer.group == commands().group]
        tell(["\nCommands of other packages:"] if offers else [])
        tell(f"  {offer.shown.replace('.', ' ')}  of {offer}" for offer in offers)
