"""`cyclopean demo`: the thesis's second experiment from recipe to report, with simulated observers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from runner.cli.options import PATH
from runner.cli.output import Step, gives, tell


@click.command(short_help="Repeat the thesis's second experiment with simulated observers.")
@click.option(
    "--observers", type=click.IntRange(1, 999), default=30, show_default=True, help="Number of simulated observers."
)
@click.option("--window", is_flag=True, help="Draw in a window that you can watch.")
@click.option(
    "--results",
    type=PATH,
    default=Path("results/demo"),
    show_default=True,
    help="Folder that the sessions are written to.",
)
@gives(indent=None)
def demo_command(observers: int, window: bool, results: Path, as_json: bool, step: Step) -> Any:
    """Repeat the thesis's second experiment with simulated observers.

    Builds ten stimuli from configs/stimuli/manitoba_gray.yaml, shows all 45 pairs in stereo to every simulated
    observer, who answers by the thesis's published scores (Table 4.4), records each answer, fits Bradley-Terry
    scores and perceptual classes, and writes a report. The classes are those of the default analysis; the thesis's
    settings stand beside it.
    """
    from dataclasses import asdict

    from analysis.report import report_blocks
    from runner.reports.demo import run_demo

    demo = run_demo(observers, results, window=window, progress=step)
    if not as_json:
        tell(report_blocks(demo.report, demo.published))
    scores = demo.report.pairs
    facts = {
        "scores": scores.to_json() if scores else None,
        "thesis_settings": demo.thesis.to_json(),
        "report": str(demo.page),
        "work": asdict(demo.work),
    }
    return facts, demo.told()
