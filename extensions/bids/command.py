"""`cyclopean export`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from extensions.bids.options import About
from runner.cli import PATH, Step, gives, takes


@click.command(name="export")
@click.argument("results", nargs=-1, required=True, type=PATH, metavar="RESULTS...")
@click.option("-o", "--output", required=True, type=PATH, help="Folder of the dataset.")
@takes(About, "about", leave_out={"facts"})
@gives()
def export_command(results: tuple[Path, ...], output: Path, about: About, step: Step) -> Any:
    """Write results as a BIDS dataset.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files.
    """
    from extensions.bids.results import export_results

    return export_results(results, output, about, step)
