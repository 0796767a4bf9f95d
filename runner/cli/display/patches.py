"""`cyclopean display patches`: patches on the screen, for an instrument that nothing here can drive."""

from __future__ import annotations

import json
from pathlib import Path

import click

from runner.cli.display.measuring_options import Choosing, Showing, choosing_options, showing_options


@click.command(short_help="Show patches of known device codes full-screen in a stereo mode.")
@click.argument("rig_or_display", type=click.Path(path_type=Path))
@click.option("--mode", help="Stereo mode; a rig has its own.")
@choosing_options
@click.option(
    "--each",
    "each_s",
    type=click.FloatRange(0, min_open=True),
    metavar="S",
    help="Show the next patch after so many seconds, without a key.",
)
@click.option("--start", "start_label", metavar="NAME", help="Patch to begin with; white#2 is the second white.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Table of the patches shown, with empty X, Y, Z to fill in."
)
@click.option("--list", "list_only", is_flag=True, help="Print the patches in their order as CSV, and show nothing.")
@showing_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    rig_or_display: Path,
    mode: str | None,
    choosing: Choosing,
    each_s: float | None,
    start_label: str | None,
    output: Path | None,
    list_only: bool,
    showing: Showing,
    as_json: bool,
) -> None:
    """Show patches of known device codes full-screen in a stereo mode.

    Both eyes see them, or one while the other sees black, so that the mode stays enabled. Right and left go on and
    back, space pauses, Escape stops. The order is shuffled by the seed; black and white come again throughout.
    """
    from devices.errors import MeasuringError
    from devices.patches import steps
    from runner.cli.display.measuring_options import duration, note
    from runner.cli.main import WorkError
    from runner.measuring.show_patches import Shown, patch_table, show_patches
    from runner.measuring.station import check_eye, open_screen
    from runner.measuring.target import read_target

    if showing.backend != "window" and each_s is None and not list_only:
        raise click.UsageError("Without a window there are no keys: add --each S.")
    target = read_target(rig_or_display, mode)
    eye = showing.eye
    remark = check_eye(target, eye)
    highest = 255 if target.panel.code_bits == 8 else 1023
    order = steps(
        [one.rounded(highest) for one in choosing.sets(target, eye)], showing.seed, showing.repeat_every, eye=eye
    )
    if start_label is not None:
        labels = [step.label for step in order]
        if start_label not in labels:
            raise MeasuringError(f"there is no patch '{start_label}' in this order: see them with --list")
        order = order[labels.index(start_label) :]
    if list_only:
        click.echo(patch_table(order, eye, target.mode.name, target.panel.code_bits), nl=False)
        return
    note(remark)

    def tell(shown: Shown) -> None:
        codes = " ".join(f"{round(code * shown.highest)}" for code in shown.step.patch.codes)
        left = f", {duration(shown.left_s)} left" if each_s else ""
        click.echo(f"{shown.number}/{shown.of}  {shown.step.label}: {codes}{left}", err=True)

    with open_screen(target, showing.backend, windowed=showing.windowed) as screen:
        for warning in screen.surface.facts.remarks:
            click.echo(f"warning: {warning}", err=True)
        if screen.highest != highest:
            order = tuple(type(step)(step.position, step.label, step.patch.rounded(screen.highest)) for step in order)
        hold_s = None if each_s is None else showing.settle_s + each_s
        times_s = show_patches(screen, order, eye, hold_s, lambda words: click.echo(words, err=True), tell)
        bits = screen.surface.bits
    if output is not None:
        try:
            output.write_text(patch_table(order, eye, target.mode.name, bits, times_s), encoding="utf-8")
        except OSError as error:
            raise WorkError(f"{output} cannot be written: {error.strerror}") from error
    if as_json:
        click.echo(json.dumps({"shown": len(times_s), "of": len(order), "table": str(output) if output else None}))
    if len(times_s) < len(order):
        raise WorkError(f"stopped after {len(times_s)} of {len(order)} patches")
