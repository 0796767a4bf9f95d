"""`cyclopean display report`: an HTML page that judges a display by its measurements."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill, indent
from typing import TYPE_CHECKING

import click

from runner.cli.options import POSITIVE

if TYPE_CHECKING:
    from devices.diagnostics import Verdicts


@click.command(name="report")
@click.argument("measurements", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="MEASUREMENTS...")
@click.option("--display", type=click.Path(path_type=Path), help="Display file to compare the readings with.")
@click.option("--mode", help="Stereo mode in it. Default: that of the readings, or the only one.")
@click.option(
    "--without-glasses",
    "without_glasses",
    type=click.Path(path_type=Path),
    help="Readings of the same patches without glasses.",
)
@click.option("--codes", metavar="RANGE", help="Range of the codes in the files: 0..1, 0..255 or 0..1023.")
@click.option(
    "--white-cd-m2",
    type=POSITIVE,
    metavar="CD_M2",
    help="Luminance of the white, of ICC profiles that do not say it.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="HTML page to write. Default: the first file's name with .html.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    measurements: tuple[Path, ...],
    display: Path | None,
    mode: str | None,
    without_glasses: Path | None,
    codes: str | None,
    white_cd_m2: float | None,
    output: Path | None,
    as_json: bool,
) -> None:
    """Judge a display by its measurements, and write an HTML page.

    MEASUREMENTS are files of readings. Each check passes, fails, or says what would have to be read for it. Checks
    that fail do not make the command fail.
    """
    import json

    from devices.diagnostics import judge_display
    from documents import WorkError
    from documents.files import writing
    from documents.pages import write_page
    from runner.reports.display.page import page_of

    if mode is not None and display is None:
        raise click.UsageError("--mode is a mode of the file that --display names.")
    verdicts = judge_display(
        measurements,
        display=display,
        mode=mode,
        without_glasses=without_glasses,
        codes=codes,
        white_cd_m2=white_cd_m2,
    )
    page = output or measurements[0].with_suffix(".html")
    with writing(page, "report", WorkError):
        write_page(page_of(verdicts), page)
    if as_json:
        result = {**verdicts.to_json(), "report": str(page)}
        click.echo(json.dumps(result, indent=2, allow_nan=False))
        return
    _print(verdicts)
    click.echo(f"The report: {page}")


def _print(verdicts: Verdicts) -> None:
    from documents.text import say
    from runner.reports.display.page import limit_words, short

    marks = {
        "passed": ("passed", "green"),
        "failed": ("FAILED", "red"),
        "no_limit": ("", None),
        "open": ("not judged", None),
    }
    for check in verdicts.diagnoses:
        word, colour = marks[check.verdict]
        name = f"{check.title} ({check.subject})" if check.subject else check.title
        limit = "" if check.limit is None else f", {limit_words(check)}"
        number = f"{short(check.value)} {check.unit}{limit}" if check.value is not None else check.words
        say((f"{word:10}", colour or ""), f"  {name}: {number}")
        if check.verdict == "no_limit":
            click.echo(indent(fill(check.words, 100), 12 * " "))
        if check.verdict == "failed":
            limit = f"The limit: {check.source}." if check.source else ""
            click.echo(indent(fill(f"{check.words} {limit}", 100), 12 * " "))
    click.echo(verdicts.sentence)
    for note in verdicts.notes:
        click.echo(f"Note: {note}")
