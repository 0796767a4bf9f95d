"""`cyclopean display report`: an HTML page that judges a display by its measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from devices.diagnostics.examine import MeasuredSet
    from devices.display.display_file import EyeModels
    from runner.reports.display.page import Verdicts


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
    output: Path | None,
    as_json: bool,
) -> None:
    """Judge a display by its measurements, and write an HTML page.

    MEASUREMENTS are files of readings. Each check passes, fails, or says what would have to be read for it. Checks
    that fail do not make the command fail.
    """
    import json

    from devices.diagnostics.examine import examine, read_sets
    from runner.cli.main import WorkError
    from runner.reports.display.page import Verdicts, write_page

    if mode is not None and display is None:
        raise click.UsageError("--mode is a mode of the file that --display names.")
    sets = read_sets(measurements, codes)
    bare = read_sets([without_glasses], codes)[0] if without_glasses is not None else None
    models = _models(display, mode, sets) if display is not None else None
    found = examine(sets, models=models, without_glasses=bare)
    every: list[MeasuredSet] = [*sets, *([bare] if bare is not None else [])]
    notes = [f"{one.label}: {said}" for one in every for said in one.measurements.assumptions]
    verdicts = Verdicts(", ".join(one.label for one in sets), found, tuple(notes))
    page = output or measurements[0].with_suffix(".html")
    try:
        write_page(verdicts, page)
    except OSError as error:
        raise WorkError(f"the report cannot be written to {page}: {error.strerror}") from error
    if as_json:
        told = {**verdicts.to_json(), "report": str(page)}
        click.echo(json.dumps(told, indent=2, allow_nan=False, ensure_ascii=False))
        return
    _print(verdicts)
    click.echo(f"The report: {page}")


def _models(display: Path, mode: str | None, sets: list[MeasuredSet]) -> EyeModels:
    from devices.display.display_file import read_display
    from devices.errors import DeviceError
    from documents import Finding

    read = read_display(display)
    if mode is None:
        said = {one.measurements.mode for one in sets if one.measurements.mode}
        if len(said) == 1:
            mode = said.pop()
        elif len(read.modes) == 1:
            mode = next(iter(read.modes))
        else:
            known = ", ".join(sorted(read.modes))
            raise DeviceError(
                Finding(
                    "the file holds several modes, and the readings do not say theirs",
                    str(display),
                    remedy=f"name one with --mode: {known}",
                )
            )
    return read.models(mode)


def _print(verdicts: Verdicts) -> None:
    from runner.reports.display.page import short, verdict

    marks = {
        "passed": ("passed", "green"),
        "failed": ("FAILED", "red"),
        "told": ("", None),
        "open": ("not judged", None),
    }
    for one in verdicts.diagnoses:
        word, colour = marks[verdict(one)]
        name = f"{one.title} ({one.subject})" if one.subject else one.title
        limit = f", {'at least' if one.at_least else 'at most'} {short(one.limit)}" if one.limit is not None else ""
        number = f"{short(one.value)} {one.unit}{limit}" if one.value is not None else one.words
        click.echo(f"{click.style(f'{word:10}', fg=colour)}  {name}: {number}")
    click.echo(verdicts.sentence)
