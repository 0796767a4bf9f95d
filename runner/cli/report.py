"""`cyclopean report`: an HTML page on the results of an experiment."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from documents.files import writing
from runner.cli.number_types import COUNT
from runner.cli.options import takes
from runner.reports.options import ReportOptions


@click.command(name="report")
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RESULTS...")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="HTML page to write. Default: report.html in the first folder.",
)
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
@takes(ReportOptions, leave_out={"rule"})
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    results: tuple[Path, ...],
    output: Path | None,
    without: tuple[str, ...],
    with_simulated: bool,
    passed: tuple[str, ...],
    screened: bool,
    most_missed: int | None,
    as_json: bool,
    options: ReportOptions,
) -> None:
    """Write an HTML report on the results of one experiment.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files. No person is left
    out by default; the page lists observers who are left out by an option. Simulated observers are not counted beside
    people.
    """
    import json

    from analysis.observers import Filter
    from analysis.report import print_report
    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.cli.work_done import work_done
    from runner.reports.results import report_results

    if options.replace and options.figure_folder is None:
        raise click.UsageError("--replace goes with --figures: name the folder")
    if screened and not passed:
        raise click.UsageError("--screened goes with --passed: name the test")
    rule = Filter(without, most_missed, passed or None, "leave_out" if screened else "keep", with_simulated)
    with writing(output or results[0], "report", WorkError), progress_bar(quiet=as_json) as step:
        written = report_results(results, output, replace(options, rule=rule), step)
    if as_json:
        click.echo(json.dumps(written.to_json() | work_done(), indent=2, allow_nan=False))
        return
    print_report(written.report)
    if written.without_pictures:
        click.echo(written.without_pictures)
    click.echo(f"The report: {written.page}")
    if written.pdf is not None:
        click.echo(f"As PDF: {written.pdf}")
    if options.csv_folder is not None:
        click.echo(f"Its tables: {options.csv_folder}")
    if options.figure_folder is not None:
        click.echo(f"Its figures: {options.figure_folder}")
    if written.empty_boxes:
        click.echo(
            f"In the PDF files of the figures these letters are empty boxes: {written.empty_boxes}. "
            "Install a font that has them, or take the SVG files."
        )
