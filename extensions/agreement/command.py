"""`cyclopean agreement`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from extensions.agreement.options import AgreementOptions
from runner.cli import PATH, Step, gives, takes


@click.command(name="agreement", short_help="Compare measures of an experiment's pictures with its observers.")
@click.argument("results", nargs=-1, required=True, type=PATH, metavar="RESULTS...")
@click.option(
    "--measures",
    required=True,
    metavar="NAME,...",
    help="Measures of pictures, such as delta-e-2000,flip; all for those that are installed.",
)
@takes(AgreementOptions, leave_out={"screening", "unscreened", "most_missed"})
@gives(work=True)
def agreement_command(results: tuple[Path, ...], measures: str, options: AgreementOptions, step: Step) -> Any:
    """Compare measures of an experiment's pictures with its observers.

    RESULTS are folders of sessions of one experiment. Every stimulus is measured beside its photograph, as the display
    showed both and from the distance in the record. Reported are correlations with observers' scores, how many of the
    pairs that observers tell apart the measure puts in order, and what a limit says of the photograph's class.
    """
    from extensions.agreement.compare import compare_with_observers

    return compare_with_observers(results, measures.split(","), options, step)
