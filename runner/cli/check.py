"""`cyclopean check`: every fault in a file and in what it names, at once, before a session."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from documents.text import counted, say
from runner.check.report import CheckOptions, CheckReport, ScreenCheck
from runner.cli.options import PATH, takes
from runner.cli.output import print_json, progress_bar, tell


@click.command(name="check", short_help="Check an experiment file and everything it names.")
@click.argument("files", nargs=-1, required=True, type=PATH)
@click.option(
    "--screen/--no-screen",
    default=None,
    help="Make it an error if this screen cannot show the experiment, or do not look at the screen. "
    "Default: give a warning.",
)
@takes(CheckOptions, leave_out={"screen", "progress"})
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def check_command(files: tuple[Path, ...], screen: bool | None, as_json: bool, options: CheckOptions) -> None:
    """Check an experiment file and everything it names.

    FILES may be experiments, displays, rigs, stimulus recipes, cameras, regions and simulated observers. All errors
    are reported at once, each with file, line, column and a remedy. With an error no session can run, and the exit
    status is 2. A warning is something to think about.
    """
    from runner.check import TRIED_OBSERVERS, check_file

    looking: dict[bool | None, ScreenCheck] = {None: "if present", True: "required", False: "skip"}
    options = replace(options, screen=looking[screen], observers=options.observers or TRIED_OBSERVERS)
    all_checked = []
    for file in files:
        with progress_bar(quiet=as_json) as step:
            all_checked.append(check_file(file, replace(options, progress=step)))
        if not as_json:
            _print(all_checked[-1])
    if as_json:
        print_json([report.to_json() for report in all_checked], None)
    if any(report.errors for report in all_checked):
        raise SystemExit(2)


def _print(report: CheckReport) -> None:
    """Print facts on standard output; warnings and errors after them, errors on the error stream."""
    verdict = counted(len(report.errors), "error", "errors") if report.errors else "right"
    doubts = f", {counted(len(report.warnings), 'warning', 'warnings')}" if report.warnings else ""
    say((f"{report.file}: {verdict}{doubts}", "bold"))
    tell(report.told())
    for finding in report.warnings:
        say(("warning:", "yellow"), f" {finding}")
    for finding in report.errors:
        say(("error:", "red"), f" {finding}", errors=True)
