"""`cyclopean demo`: the thesis's second experiment from recipe to report, with simulated observers."""

from __future__ import annotations

import json
import time
from pathlib import Path

import click


@click.command(short_help="Repeat the thesis's second experiment with simulated observers.")
@click.option(
    "--observers", type=click.IntRange(1, 999), default=30, show_default=True, help="Number of simulated observers."
)
@click.option("--window", is_flag=True, help="Draw in a window that you can watch.")
@click.option(
    "--results",
    type=click.Path(path_type=Path),
    default=Path("results/demo"),
    show_default=True,
    help="Folder that the sessions are written to.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(observers: int, window: bool, results: Path, as_json: bool) -> None:
    """Repeat the thesis's second experiment with simulated observers.

    Builds ten stimuli from configs/stimuli/manitoba_gray.yaml, shows all 45 pairs in stereo to every simulated
    observer, who answers by the thesis's published scores (Table 4.4), records each answer, fits Bradley-Terry
    scores and perceptual classes, and writes a report. The classes are those of the default analysis; the thesis's
    settings stand beside it.
    """
    from dataclasses import asdict

    from analysis.report import print_report
    from runner.cli.output import progress_bar
    from runner.reports.demo import run_demo

    began_s = time.monotonic()
    with progress_bar(quiet=as_json) as step:
        demo = run_demo(observers, results, window=window, progress=step)
    if as_json:
        scores = demo.report.pairs
        printed = {
            "scores": scores.to_json() if scores else None,
            "thesis_settings": demo.thesis.to_json(),
            "report": str(demo.page),
            "work": asdict(demo.work),
        }
        click.echo(json.dumps(printed))
        return
    print_report(demo.report, demo.published)
    click.echo(
        "The thesis's settings, which stand beside, do not correct for 45 tests and take all answers for independent: "
        "more classes, and more false ones. A study of your own should keep the analysis above."
    )
    if demo.agreement:
        click.echo(
            f"Agreement with Table 4.4: the log scores correlate at r = {demo.agreement.correlation:.3f}; "
            f"{demo.agreement.pairs_alike} of {demo.agreement.pairs} pairs share a class, or do not, as published."
        )
        if demo.expects_published_classes:
            click.echo(
                f"The counts that the published scores lead {observers} observers to on average give exactly the "
                "published classes by these settings; the rest is the luck of the draw."
            )
    click.echo(f"All of it took {time.monotonic() - began_s:.0f} s. The report: {demo.page}")
