"""`cyclopean doctor`: what this machine can do, and what is missing."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from runner.cli.monitor_option import monitor_option
from runner.cli.options import Within

if TYPE_CHECKING:
    from runner.check.doctor import MachineReport


@click.command(short_help="Report what this machine can do.")
@click.option("--timing", is_flag=True, help="Measure how evenly the frames of a window come, and explain.")
@click.option("--seconds", type=Within(0.5, 600), default=20.0, show_default=True, help="Duration of --timing.")
@click.option(
    "--rig",
    "rig_file",
    type=click.Path(path_type=Path),
    help="Rig to report what of it was not measured; with --timing, whether its photodiode record holds here, and how "
    "soon after a swap its timing marks are sent, which sends them.",
)
@click.option(
    "--experiment",
    "experiment_file",
    type=click.Path(path_type=Path),
    help="Experiment of whose keys to list those that the keyboard cannot send. Default: the keys of any experiment.",
)
@monitor_option
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    timing: bool,
    seconds: float,
    rig_file: Path | None,
    experiment_file: Path | None,
    monitors: tuple[str, ...],
    as_json: bool,
) -> None:
    """Report what this machine can do.

    Opens each kind of surface, tries each stereo mode and codes of 10 bits on it, and gives the reason if one cannot
    be shown. Lists the monitors with the number and name by which --monitor and a rig file choose them, and their gamma
    tables, and what else the system tells of what may change codes on their way to the panel; '!' marks what may change
    them. Lists keys that this keyboard cannot send. With --timing it measures the intervals between frames instead.
    """
    if timing:
        if experiment_file:
            raise click.UsageError("--experiment is about the keyboard, which --timing does not look at.")
        _timing(seconds, rig_file, monitors, as_json)
        return
    if monitors:
        raise click.UsageError("--monitor needs --timing: without it, all monitors are listed.")
    from devices.display import read_rig
    from runner.check.display_facts import not_measured
    from runner.check.doctor import ANY_KEYS, examine_machine
    from runner.presenter import primary_monitor

    rig = read_rig(rig_file, ask_monitor=primary_monitor) if rig_file else None
    meanings = _keys(experiment_file) if experiment_file else {}
    report = examine_machine(meanings or ANY_KEYS)
    if as_json:
        click.echo(json.dumps(asdict(report) | ({"rig_not_measured": not_measured(rig)} if rig else {}), indent=2))
        return
    _print(report, meanings)
    if rig:
        click.echo(f"\nRig '{rig_file}'\n  not measured: {', '.join(not_measured(rig))}")


def _keys(experiment: Path) -> dict[str, str]:
    from runner.check.experiment import keys_of
    from runner.protocol.experiment import read_experiment

    return keys_of(read_experiment(experiment))


def _print_keyboard(report: MachineReport, meanings: Mapping[str, str]) -> None:
    click.echo("\nKeyboard")
    if report.keyboard is None:
        click.echo("  not looked at: there is no display server")
        return
    labels = ", ".join(f"{key.upper()} ({label})" for key, label in report.keyboard.labels.items())
    if labels:
        click.echo(f"  keys that print something else and count by their place: {labels}")
    asked = "of the experiment" if meanings else "of any experiment"
    missing = [f"'{key}'" + (f" ({meanings[key]})" if meanings else "") for key in report.keyboard.cannot_send]
    if missing:
        click.echo(f"  ! keys {asked} that it cannot send: {', '.join(missing)}")
    else:
        click.echo(f"  sends all keys {asked}")


def _print(report: MachineReport, meanings: Mapping[str, str]) -> None:
    click.echo("Packages")
    for name, package in report.packages.items():
        click.echo(f"  {name}: {package.problem or 'from ' + package.folder}")
    for name, version in report.software.items():
        click.echo(f"  {name} {version}")
    there = [name for name, missing in report.measures.items() if missing is None]
    click.echo(f"\nMeasures of pictures\n  installed: {', '.join(there)}")
    for name, missing in report.measures.items():
        if missing is not None:
            click.echo(f"  {name}: {missing}")
    click.echo("\nMonitors, by number and name" if report.monitors else "\nNo monitor")
    for monitor in report.monitors:
        click.echo(f"  {monitor.line}\n    gamma table: {monitor.gamma_table}")
        click.echo(f"    size: {monitor.size}")
    _print_keyboard(report, meanings)
    click.echo("\nFrom the framebuffer to the panel, as far as the system tells")
    for fact in report.signal_path:
        click.echo(f"  {'! ' if fact.doubt else ''}{fact.title}: {fact.words}")
    for backend, surface in report.surfaces.items():
        click.echo(f"\nSurface '{backend}'")
        facts, ten_bits = surface.facts, surface.ten_bits
        if facts is None or ten_bits is None:
            click.echo(f"  not here: {surface.problem}")
            continue
        click.echo(f"  {facts.renderer}, OpenGL {facts.gl_version}, display server {facts.display_server}")
        click.echo(f"  colours computed in {facts.arithmetic}")
        for remark in facts.remarks:
            click.echo(f"  {remark}")
        for mode, reason in surface.modes.items():
            click.echo(f"  {mode}: {'yes' if reason is None else f'no, {reason}'}")
        click.echo(f"  codes of 10 bits: {'yes' if ten_bits.given else f'no, {ten_bits.problem}'}")


def _timing(seconds: float, rig_file: Path | None, monitors: tuple[str, ...], as_json: bool) -> None:
    from devices.display import read_rig
    from runner.check.doctor import examine_timing
    from runner.cli.output import progress_bar
    from runner.presenter.surfaces.screens import primary_monitor

    rig = read_rig(rig_file, ask_monitor=primary_monitor) if rig_file else None
    with progress_bar(quiet=as_json) as step:
        report = examine_timing(
            seconds, lambda done_s: step("Swapping frames", round(done_s), round(seconds)), rig, monitors
        )
    if as_json:
        click.echo(json.dumps(asdict(report), indent=2))
        return
    click.echo(f"{report.renderer}; {report.display_server}; {report.compositor}")
    for sentence in report.meaning:
        click.echo(sentence)
