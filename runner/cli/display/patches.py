"""`cyclopean display patches`: patches on the screen, for an instrument that nothing here can drive."""

from __future__ import annotations

import json
from pathlib import Path

import click

from documents.files import writing
from runner.cli.display.measuring_options import patch_options, show_options
from runner.cli.options import POSITIVE
from runner.measuring.options import PatchOptions, ShowOptions


@click.command(short_help="Show patches of known device codes full-screen in a stereo mode.")
@click.argument("rig_or_display", type=click.Path(path_type=Path))
@click.option("--mode", help="Stereo mode; a rig has its own.")
@patch_options
@click.option(
    "--each",
    "each_s",
    type=POSITIVE,
    metavar="S",
    help="Show the next patch after so many seconds, without a key.",
)
@click.option("--start", "start_label", metavar="NAME", help="Patch to begin with; white#2 is the second white.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Table of the patches shown, with empty X, Y, Z to fill in."
)
@click.option("--list", "list_only", is_flag=True, help="Print the patches in their order as CSV, and show nothing.")
@show_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    rig_or_display: Path,
    mode: str | None,
    patches: PatchOptions,
    each_s: float | None,
    start_label: str | None,
    output: Path | None,
    list_only: bool,
    show: ShowOptions,
    as_json: bool,
) -> None:
    """Show patches of known device codes full-screen in a stereo mode.

    Both eyes see them, or one while the other sees black, so that the mode stays enabled. Right and left show the next
    and the previous patch, space pauses, Escape stops. The order is shuffled by the seed; black and white come again
    throughout.
    """
    from documents import WorkError
    from documents.files import write_whole
    from runner.cli.display.measuring_options import dialogue, duration, note, say
    from runner.measuring.show_patches import Shown, plan_patches, show_plan

    if show.backend != "window" and each_s is None and not list_only:
        raise click.UsageError("Without a window there are no keys: add --each S.")
    plan = plan_patches(rig_or_display, patches, show, mode=mode, start=start_label)
    for remark in plan.notes:
        note(remark)
    if list_only:
        click.echo(plan.table(), nl=False)
        return

    def on_shown(shown: Shown) -> None:
        codes = " ".join(f"{round(code * shown.highest)}" for code in shown.step.patch.codes)
        left = f", {duration(shown.left_s)} left" if each_s else ""
        say(f"{shown.number}/{shown.of}  {shown.step.label}: {codes}{left}")

    result = show_plan(plan, each_s, dialogue(show, unattended=True, quiet=False), on_shown)
    if output is not None:
        with writing(output, "table", WorkError):
            write_whole(output, result.table, make_folder=False)
    if as_json:
        click.echo(json.dumps({"shown": result.shown, "of": result.of, "table": str(output) if output else None}))
    if result.shown < result.of:
        raise WorkError(f"stopped after {result.shown} of {result.of} patches")
