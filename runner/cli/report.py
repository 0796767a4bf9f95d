"""`cyclopean report`: an HTML page on the results of an experiment."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(name="report")
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RESULTS...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The page; report.html inside the first folder if left out."
)
@click.option("--alpha", type=float, help="Level at which two stimuli differ; the experiment's if left out.")
@click.option(
    "--adjust",
    type=click.Choice(["holm", "bh", "maxz", "none"]),
    help="Correction for testing every pair; the experiment's if left out.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the scores as JSON instead of a table.")
def command(
    results: tuple[Path, ...], output: Path | None, alpha: float | None, adjust: str | None, as_json: bool
) -> None:
    """Write an HTML report on the results of one experiment.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files.
    """
    import json
    from typing import cast

    from analysis.errors import ResultsError
    from analysis.multiplicity import Adjust
    from analysis.records import FILE_NAME, read_session, session_files
    from analysis.report import print_table, write_report
    from documents import Finding
    from runner.cli.main import WorkError

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
    try:
        summary = write_report(sessions, page, alpha=alpha, adjust=cast("Adjust | None", adjust))
    except OSError as error:
        raise WorkError(f"the report cannot be written to {page}: {error.strerror}") from error
    if as_json:
        click.echo(
            json.dumps({**summary.to_json(), "report": str(page)}, indent=2, allow_nan=False, ensure_ascii=False)
        )
        return
    print_table(summary)
    click.echo(f"The report: {page}")
