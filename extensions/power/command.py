"""`cyclopean power`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from runner.cli import PATH, Step, gives, say, takes

if TYPE_CHECKING:
    from extensions.power.options import PowerOptions


@click.command(name="power")
@click.argument("experiment", type=PATH)
@takes("extensions.power.PowerOptions")
@gives()
def power_command(experiment: Path, options: PowerOptions, as_json: bool, progress: Step) -> Any:
    """Find how many observers an experiment needs, by simulated studies.

    EXPERIMENT is an experiment file with a block of all pairs; its stimuli need not be built. Whole studies are
    simulated under assumed scores, and analysed as `report` does.
    """
    from extensions.power.study import study_power

    if as_json and str(options.table) == "-":
        raise click.UsageError("Both --json and --csv - would go to the terminal.")

    def done(number: int, of: int) -> None:
        progress("Simulating studies", number, of)

    return study_power(experiment, options, done, lambda line: say(f"note: {line}"))
