"""`cyclopean report`: an HTML page on the results of an experiment."""

from __future__ import annotations

from pathlib import Path

import click

from documents.files import writing
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
@takes(ReportOptions)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    results: tuple[Path, ...],
    output: Path | None,
    as_json: bool,
    options: ReportOptions,
) -> None:
    """Write an HTML report on the results of one experiment.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files. No person is left
    out by default; the page lists observers who are left out by an option. Simulated observers are not counted beside
    people.
    """
    import json

    from analysis.report import print_report
    from documents import WorkError
    from runner.cli.output import progress_bar, work_done
    from runner.reports.results import report_results

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
    if options.csv_folder is not None:
        click.echo(f"Its tables: {options.csv_folder}")
    if options.figure_folder is not None:
        click.echo(f"Its figures: {options.figure_folder}")
    if written.empty_boxes:
        click.echo(
            f"In the PDF files of the figures these letters are empty boxes: {written.empty_boxes}. "
            "Install a font that has them, or take the SVG files."
        )
