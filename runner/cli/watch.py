"""`cyclopean watch`: the sessions that are running, on this station and others."""

from __future__ import annotations

from pathlib import Path

import click

from runner.cli.options import Within


@click.command(name="watch")
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--once", is_flag=True, help="Look once, not again and again until Ctrl-C.")
@click.option(
    "--every",
    "every_s",
    type=Within(0.2, 3600),
    default=2.0,
    metavar="SECONDS",
    show_default=True,
    help="How often to look again.",
)
@click.option(
    "--within",
    "within_minutes",
    type=Within(0.1, 1e6),
    default=30.0,
    show_default=True,
    metavar="MINUTES",
    help="Show the sessions that were written to so lately.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON: one line each time.")
def command(results: Path, *, once: bool, every_s: float, within_minutes: float, as_json: bool) -> None:
    """Show the sessions that are running, on this station and others.

    RESULTS is a folder, which may lie on a drive that several stations share. For each session: the trial, the time
    left, the last answers, missed frames, and when its log was last written to. Only logs are read, and nothing is
    written.
    """
    import json
    import time

    from runner.session.watching import Watch

    watch = Watch(results, 60 * within_minutes)
    while True:
        found = watch.look()
        if as_json:
            click.echo(json.dumps(found.to_json()))
        else:
            if not once:
                click.clear()
            for session in found.sessions:
                click.echo(session.line())
            if not found.sessions:
                click.echo(f"no session was written to in the last {within_minutes:g} min")
            for finding in found.findings:
                click.echo(f"warning: {finding}", err=True)
        if once:
            return
        try:
            time.sleep(every_s)
        except KeyboardInterrupt:
            return
