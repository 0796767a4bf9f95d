"""`cyclopean doctor`: what this machine can do, and what it lacks."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.command(short_help="Say what this machine can do.")
@click.option("--timing", is_flag=True, help="Measure how evenly a window's frames come, and explain.")
@click.option(
    "--seconds", type=click.FloatRange(0.5, 600), default=20.0, show_default=True, help="How long to measure."
)
@click.option(
    "--rig",
    "rig_file",
    type=click.Path(path_type=Path),
    help="With --timing, say whether this rig's photodiode verification holds here.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the facts as JSON.")
def command(timing: bool, seconds: float, rig_file: Path | None, as_json: bool) -> None:
    """Say what this machine can do.

    Opens each kind of surface, tries each stereo mode and codes of 10 bits on it, and says why one cannot be had. With
    --timing it measures the intervals between frames instead.
    """
    if timing:
        _timing(seconds, rig_file, as_json)
        return
    if rig_file is not None:
        raise click.UsageError("A rig is of use with --timing only; `cyclopean check RIG` reads one.")
    from runner.check.doctor import examine

    facts = examine()
    if as_json:
        click.echo(json.dumps(facts, indent=2))
        return
    click.echo("Packages")
    for name, package in facts["packages"].items():
        click.echo(f"  {name}: {package['problem'] or 'from ' + package['folder']}")
    for name, version in facts["software"].items():
        click.echo(f"  {name} {version}")
    for backend, surface in facts["surfaces"].items():
        click.echo(f"\nSurface '{backend}'")
        if surface["problem"]:
            click.echo(f"  not here: {surface['problem']}")
            continue
        drawn = surface["facts"]
        click.echo(f"  {drawn['renderer']}, OpenGL {drawn['gl_version']}, display server {drawn['display_server']}")
        for mode, reason in surface["modes"].items():
            click.echo(f"  {mode}: {'yes' if reason is None else f'no, {reason}'}")
        ten_bits = surface["ten_bits"]
        click.echo(f"  codes of 10 bits: {'yes' if ten_bits['given'] else 'no, ' + ten_bits['problem']}")


def _timing(seconds: float, rig_file: Path | None, as_json: bool) -> None:
    from devices.display.rig_file import read_rig
    from runner.check.doctor import examine_timing
    from runner.cli.progress import progress_bar

    rig = read_rig(rig_file) if rig_file else None
    with progress_bar(quiet=as_json) as step:
        facts = examine_timing(seconds, lambda done_s: step("Swapping frames", round(done_s), round(seconds)), rig)
    if as_json:
        click.echo(json.dumps(facts, indent=2))
        return
    click.echo(f"{facts['renderer']}; {facts['display_server']}; {facts['compositor']}")
    for sentence in facts["meaning"]:
        click.echo(sentence)
