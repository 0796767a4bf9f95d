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
    scores and perceptual classes, and writes a report.
    """
    from dataclasses import asdict

    from analysis.records.results import read_results
    from analysis.report.page import write_report
    from analysis.report.report import print_report
    from analysis.scaling.agreement import agreement, expected_classes
    from runner.cli.progress import build_stimuli, progress_bar
    from runner.observers.observer_file import read_scored_observer
    from runner.protocol.experiment import read_experiment
    from runner.reports.thumbnails import thumbnails
    from runner.session.folders import new_label
    from runner.session.station import Station

    began_s = time.monotonic()
    root = Path(__file__).parents[2]
    design = read_experiment(root / "experiments/dynamic_range.yaml")
    law = read_scored_observer(root / "configs/observers/table_4_4.yaml", design.stimulus_names)
    folder = results / new_label()
    with progress_bar(quiet=as_json) as step:
        stimuli = build_stimuli(design, step)
        with Station.open(design, stimuli, folder, "window" if window else "egl", windowed=True) as station:
            for number in range(1, observers + 1):
                observer = f"{number:02d}"
                station.run(observer, station.simulated(law, observer), simulated=True)
                step("Running simulated observers", number, observers)
            work = station.presenter.counters
        sessions = read_results(folder)
        step("Writing the report", 0, 1)
        published = {name: (stimulus.score, stimulus.perceptual_class) for name, stimulus in law.stimuli.items()}
        report = folder / "report.html"
        written = write_report(sessions, report, published=published, thumbnails=thumbnails(design, stimuli))
        step("Writing the report", 1, 1)
    summary = written.pairs
    assert summary is not None  # every observer compared every pair
    if as_json:
        click.echo(json.dumps({"scores": summary.to_json(), "report": str(report), "work": asdict(work)}))
        return
    print_report(written, published)
    found = agreement(summary.scores, published)
    if found:
        click.echo(
            f"Agreement with Table 4.4: the log scores correlate at r = {found.correlation:.3f}; "
            f"{found.pairs_alike} of {found.pairs} pairs share a class, or do not, as published."
        )
        expected = expected_classes(published, observers, summary.alpha, summary.adjust)
        by_model = summary.estimate.covariance == "model"
        if by_model and expected == {name: label for name, (_, label) in published.items()}:
            click.echo(
                f"The counts that the published scores lead {observers} observers to on average give exactly the "
                "published classes; the rest is the luck of the draw."
            )
    click.echo(f"All of it took {time.monotonic() - began_s:.0f} s. The report: {report}")
