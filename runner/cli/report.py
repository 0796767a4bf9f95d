"""`cyclopean report`: an HTML page on the results of an experiment."""

from __future__ import annotations

from pathlib import Path

import click

from documents.files import writing
from runner.cli.number_types import COUNT, NUMBER


@click.command(name="report")
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RESULTS...")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="HTML page to write. Default: report.html in the first folder.",
)
@click.option("--pdf", is_flag=True, help="Also print the page to PDF, beside it; needs Chromium or Chrome.")
@click.option("--csv", "csv_folder", type=click.Path(path_type=Path), help="Folder for the tables as CSV.")
@click.option(
    "--figures",
    "figure_folder",
    type=click.Path(path_type=Path),
    help="Folder for the figures, each as SVG and as PDF.",
)
@click.option("--replace", is_flag=True, help="With --figures, replace figures that are there already.")
@click.option("--without", multiple=True, metavar="OBSERVER", help="Observer to leave out; repeat for each.")
@click.option(
    "--with-simulated",
    is_flag=True,
    help="Count simulated observers beside people; without it they count only where nobody else answered.",
)
@click.option(
    "--passed",
    multiple=True,
    metavar="TEST",
    help="Leave out observers who failed this test of vision, such as stereo_acuity; repeat for each.",
)
@click.option("--screened", is_flag=True, help="With --passed, also leave out observers who did not take the test.")
@click.option(
    "--most-missed",
    type=COUNT,
    help="Leave out observers who missed more than this number of obvious catch trials.",
)
@click.option(
    "--alpha", type=NUMBER, help="Significance level for a difference between two stimuli. Default: the experiment's."
)
@click.option(
    "--adjust",
    type=click.Choice(["holm", "bh", "maxz", "none"]),
    help="Correction for multiple comparisons. Default: the experiment's.",
)
@click.option(
    "--covariance",
    type=click.Choice(["auto", "model", "scaled", "sandwich", "shrinkage"]),
    help="Standard errors of the classes. Default: the experiment's.",
)
@click.option(
    "--experiment",
    type=click.Path(path_type=Path),
    help="Experiment file, for pictures of the stimuli and facts for Methods. Default: experiments/NAME.yaml.",
)
@click.option(
    "--thumbnails/--no-thumbnails",
    default=True,
    help="Show the stimuli on the page, if they are in the cache.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    results: tuple[Path, ...],
    output: Path | None,
    pdf: bool,
    csv_folder: Path | None,
    figure_folder: Path | None,
    replace: bool,
    without: tuple[str, ...],
    with_simulated: bool,
    passed: tuple[str, ...],
    screened: bool,
    most_missed: int | None,
    alpha: float | None,
    adjust: str | None,
    covariance: str | None,
    experiment: Path | None,
    thumbnails: bool,
    as_json: bool,
) -> None:
    """Write an HTML report on the results of one experiment.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files. No person is left
    out by default; the page lists observers who are left out by an option. Simulated observers are not counted beside
    people.
    """
    import json
    from typing import cast

    from analysis.classes import Adjust
    from analysis.observers import Filter
    from analysis.report import print_report
    from analysis.scaling import CovarianceChoice
    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.cli.work_done import work_done
    from runner.reports.results import ReportOptions, report_results

    if replace and figure_folder is None:
        raise click.UsageError("--replace goes with --figures: name the folder")
    if screened and not passed:
        raise click.UsageError("--screened goes with --passed: name the test")
    options = ReportOptions(
        rule=Filter(without, most_missed, passed or None, "leave_out" if screened else "keep", with_simulated),
        alpha=alpha,
        adjust=cast("Adjust | None", adjust),
        covariance=cast("CovarianceChoice | None", covariance),
        pictures=thumbnails,
        experiment=experiment,
        pdf=pdf,
        csv_folder=csv_folder,
        figure_folder=figure_folder,
        replace=replace,
    )
    with writing(output or results[0], "report", WorkError), progress_bar(quiet=as_json) as step:
        written = report_results(results, output, options, step)
    if as_json:
        click.echo(json.dumps(written.to_json() | work_done(), indent=2, allow_nan=False))
        return
    print_report(written.report)
    if written.without_pictures:
        click.echo(written.without_pictures)
    click.echo(f"The report: {written.page}")
    if written.pdf is not None:
        click.echo(f"As PDF: {written.pdf}")
    if csv_folder is not None:
        click.echo(f"Its tables: {csv_folder}")
    if figure_folder is not None:
        click.echo(f"Its figures: {figure_folder}")
    if written.empty_boxes:
        click.echo(
            f"In the PDF files of the figures these letters are empty boxes: {written.empty_boxes}. "
            "Install a font that has them, or take the SVG files."
        )
