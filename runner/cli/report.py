"""`cyclopean report`: an HTML page on the results of an experiment."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from analysis.records.session_record import Header


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
@click.option("--without", multiple=True, metavar="OBSERVER", help="Observer to leave out; repeat for each.")
@click.option(
    "--passed",
    multiple=True,
    metavar="TEST",
    help="Leave out observers who failed this test of vision, such as stereo_acuity; repeat for each.",
)
@click.option("--screened", is_flag=True, help="With --passed, also leave out observers who did not take the test.")
@click.option(
    "--most-missed",
    type=click.IntRange(min=0),
    help="Leave out observers who missed more obvious catch trials than this share.",
)
@click.option(
    "--alpha", type=float, help="Significance level for a difference between two stimuli. Default: the experiment's."
)
@click.option(
    "--adjust",
    type=click.Choice(["holm", "bh", "maxz", "none"]),
    help="Correction for multiple comparisons. Default: the experiment's.",
)
@click.option(
    "--covariance",
    type=click.Choice(["auto", "model", "sandwich"]),
    help="Standard errors of the classes. Default: the experiment's.",
)
@click.option(
    "--experiment",
    type=click.Path(path_type=Path),
    help="Experiment file, for pictures of the stimuli. Default: experiments/NAME.yaml.",
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
    without: tuple[str, ...],
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

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files. Nobody is left out
    unless you ask, and the page says whom you asked to leave out.
    """
    import json
    from typing import cast

    from analysis.classes.multiplicity import Adjust
    from analysis.errors import ResultsError
    from analysis.observers.filters import Filter
    from analysis.observers.screening import outcomes
    from analysis.records.session_record import FILE_NAME, read_session, session_files
    from analysis.report.estimate import CovarianceWish
    from analysis.report.page import write_report
    from analysis.report.report import print_report
    from documents import Finding
    from runner.cli.main import WorkError
    from runner.reports.print_page import print_pdf

    if screened and not passed:
        raise click.UsageError("--screened goes with --passed: name the test")
    files: dict[Path, Path] = {}
    for place in results:
        if not place.exists():
            raise ResultsError(Finding("there is no such folder or file", str(place), remedy="check the path"))
        found = list(session_files(place))
        if not found:
            raise ResultsError(
                Finding(f"the folder holds no {FILE_NAME}", str(place), remedy="name a folder of results")
            )
        files |= {file.resolve(): file for file in found}
    first = results[0]
    page = output or (first if first.is_dir() else first.parent) / "report.html"
    sessions = [read_session(file) for file in files.values()]
    for test in passed:
        known = list(dict.fromkeys(one.test for session in sessions for one in outcomes(session)))
        if test not in known:
            remedy = f"tests taken: {', '.join(known)}" if known else "no session has a test of vision"
            raise ResultsError(Finding(f"nobody took the test of vision '{test}'", remedy=remedy))
    pictures = _thumbnails(sessions[0].header, experiment, quiet=as_json) if thumbnails else {}
    try:
        report = write_report(
            sessions,
            page,
            alpha=alpha,
            adjust=cast("Adjust | None", adjust),
            covariance=cast("CovarianceWish | None", covariance),
            rule=Filter(without, most_missed, passed or None, "leave_out" if screened else "keep"),
            thumbnails=pictures,
            csv_folder=csv_folder,
        )
        if pdf:
            print_pdf(page, page.with_suffix(".pdf"))
    except OSError as error:
        raise WorkError(f"the report cannot be written to {error.filename or page}: {error.strerror}") from error
    if as_json:
        told = {**report.to_json(), "report": str(page)}
        click.echo(json.dumps(told, indent=2, allow_nan=False, ensure_ascii=False))
        return
    print_report(report)
    click.echo(f"The report: {page}")
    if pdf:
        click.echo(f"As PDF: {page.with_suffix('.pdf')}")
    if csv_folder is not None:
        click.echo(f"Its tables: {csv_folder}")


def _thumbnails(header: Header, experiment: Path | None, *, quiet: bool) -> dict[str, dict[str, bytes]]:
    """Return pictures of the stimuli, or none where they are not at hand; a file that was named must be the one."""
    from analysis.errors import ResultsError
    from documents import Finding
    from runner.cli.progress import progress_bar
    from runner.reports.thumbnails import find_shown, thumbnails

    roots = (Path.cwd(), Path(__file__).parents[2])
    usual = [root / "experiments" / f"{Path(header.experiment).name}.yaml" for root in roots]
    for file in [experiment] if experiment else usual:
        shown = find_shown(header, file) if file.is_file() else None
        if shown is not None:
            with progress_bar(quiet=quiet) as step:
                return thumbnails(*shown, lambda done, of: step("Making small pictures", done, of))
    if experiment is not None:
        what = "these are not the stimuli and the display of the results, or the stimuli are not built"
        remedy = "name the experiment file of these sessions, or leave --experiment out"
        raise ResultsError(Finding(what, str(experiment), remedy=remedy))
    return {}
