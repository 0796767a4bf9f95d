"""`cyclopean check`: every fault in a file and in what it names, at once, before anyone sits down."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click


@click.command(short_help="Check an experiment file and everything it names.")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--results",
    type=click.Path(path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Where sessions are to go.",
)
@click.option(
    "--screen/--no-screen",
    default=None,
    help="Whether this screen must be able to show it; without either, what it cannot is a warning.",
)
@click.option("--no-pictures", is_flag=True, help="Leave the stimuli unbuilt: nothing is said of what is clipped.")
@click.option(
    "--clip-limit",
    type=click.FloatRange(0, 100),
    metavar="PERCENT",
    help="Warn of stimuli with more of an eye's pixels clipped than this; 0.3 if left out, as in the thesis.",
)
@click.option("--json", "as_json", is_flag=True, help="Print what each file amounts to, and the faults, as JSON.")
def command(
    files: tuple[Path, ...],
    results: Path,
    screen: bool | None,
    no_pictures: bool,
    clip_limit: float | None,
    as_json: bool,
) -> None:
    """Check an experiment file and everything it names.

    FILES may be experiments, displays, rigs, stimulus recipes and simulated observers. All faults are told at once,
    each with file, line, column and what would be right. Errors keep a session from running, and make the exit status
    2; warnings are to be thought about.
    """
    from runner.check.files import check_file
    from runner.check.report import CLIP_LIMIT_PERCENT, CheckOptions, ScreenCheck
    from runner.cli.check_page import print_checked
    from runner.cli.progress import progress_bar

    limit = CLIP_LIMIT_PERCENT if clip_limit is None else clip_limit
    looking: dict[bool | None, ScreenCheck] = {None: "if there is one", True: "must do", False: "leave alone"}
    all_checked = []
    for file in files:
        with progress_bar(quiet=as_json or not sys.stderr.isatty()) as step:
            all_checked.append(check_file(file, CheckOptions(results, looking[screen], not no_pictures, limit, step)))
        if not as_json:
            print_checked(all_checked[-1])
    if as_json:
        click.echo(json.dumps([checked.to_json() for checked in all_checked], ensure_ascii=False))
    if any(checked.errors for checked in all_checked):
        sys.exit(2)
