"""Commands on the program and the machine: `doctor`, `schema`, `completion` and `help`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.shell_completion import get_completion_class

from documents.options import MONITOR_WORDS
from runner.cli.options import PATH, Within
from runner.cli.output import Step, gives, print_json, tell
from runner.protocol.schemas import KINDS, FileKind, json_schema


@click.command(short_help="Report what this machine can do.")
@click.option("--timing", is_flag=True, help="Measure how evenly the frames of a window come, and explain.")
@click.option("--seconds", type=Within(0.5, 600), default=20.0, show_default=True, help="Duration of --timing.")
@click.option(
    "--rig",
    type=PATH,
    help="Rig to report what of it was not measured; with --timing, whether its photodiode record holds here, and how "
    "soon after a swap its timing marks are sent, which sends them.",
)
@click.option(
    "--experiment",
    type=PATH,
    help="Experiment of whose keys to list those that the keyboard cannot send. Default: the keys of any experiment.",
)
@click.option("--monitor", "monitors", multiple=True, metavar="NAME|NUMBER", help=MONITOR_WORDS)
@gives()
def doctor_command(
    timing: bool, seconds: float, rig: Path | None, experiment: Path | None, monitors: tuple[str, ...], step: Step
) -> Any:
    """Report what this machine can do.

    Opens each kind of surface, tries each stereo mode and codes of 10 bits on it, and gives the reason if one cannot
    be shown. Lists the monitors with the number and name by which --monitor and a rig file choose them, and their gamma
    tables, and what else the system tells of what may change codes on their way to the panel; '!' marks what may change
    them. Lists keys that this keyboard cannot send. With --timing it measures the intervals between frames instead.
    """
    from dataclasses import asdict

    from devices.display import read_rig
    from documents import json_fields
    from runner.check.display_facts import not_measured
    from runner.check.doctor import ANY_KEYS, examine_machine, examine_timing, told_of
    from runner.check.experiment import keys_of
    from runner.presenter import primary_monitor
    from runner.protocol.experiment import read_experiment

    if timing and experiment:
        raise click.UsageError("--experiment is about the keyboard, which --timing does not look at.")
    if monitors and not timing:
        raise click.UsageError("--monitor needs --timing: without it, all monitors are listed.")
    its_rig = read_rig(rig, ask_monitor=primary_monitor) if rig else None
    if timing:

        def progress(done_s: float) -> None:
            step("Swapping frames", round(done_s), round(seconds))

        timed = examine_timing(seconds, progress, its_rig, monitors)
        return asdict(timed), (f"{timed.renderer}; {timed.display_server}; {timed.compositor}", *timed.meaning)
    meanings = keys_of(read_experiment(experiment)) if experiment else {}
    report = examine_machine(meanings or ANY_KEYS)
    lacks = {"rig_not_measured": not_measured(its_rig)} if its_rig else {}
    of_rig = [f"\nRig '{rig}'\n  not measured: {', '.join(words)}" for words in lacks.values()]
    return json_fields(report) | lacks, (*told_of(report, meanings), *of_rig)


@click.command(short_help="Print the JSON Schema of a file that you write.")
@click.argument("kind", type=click.Choice(KINDS), default="experiment")
def schema_command(kind: FileKind) -> None:
    """Print the JSON Schema of a file that you write.

    Save it and name it in your editor's settings for YAML. The editor then completes keys and marks mistakes.
    """
    print_json(json_schema(kind))


@click.command(short_help="Print what makes a shell complete commands at Tab.")
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


@click.command(short_help="Print the help text of a command.")
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
        tell(f"  {offer.name}  of {offer}" for offer in offers)
