"""`cyclopean power`: how many observers an experiment needs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from runner.cli.options import PATH, takes
from runner.cli.output import Step, gives, say
from runner.reports.options import PowerOptions


@click.command(name="power")
@click.argument("experiment", type=PATH)
@takes(PowerOptions)
@gives()
def command(experiment: Path, options: PowerOptions, as_json: bool, step: Step) -> Any:
    """Find how many observers an experiment needs, by simulated studies.

    EXPERIMENT is an experiment file with a block of all pairs; its stimuli need not be built. Whole studies are
    simulated under assumed scores, and analysed as `report` does.
    """
    from runner.reports.power import study_power

    if as_json and str(options.table) == "-":
        raise click.UsageError("Both --json and --csv - would go to the terminal.")

    def progress(done: int, of: int) -> None:
        step("Simulating studies", done, of)

    return study_power(experiment, options, progress, lambda line: say(f"note: {line}"))
