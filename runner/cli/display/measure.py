"""`cyclopean display measure`: patches shown and read, each reading on disk before the next patch."""

from __future__ import annotations

import json
from pathlib import Path

import click

from documents.text import counted
from runner.cli.display.measuring_options import instrument_options, patch_options, show_options
from runner.measuring.options import InstrumentOptions, PatchOptions, ShowOptions


@click.command(short_help="Show patches and read each with an instrument.")
@click.argument("rig_or_display", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, help="Measurement file to write: NAME.jsonl."
)
@click.option(
    "--table",
    "tables",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Table to write at the end: *.csv, or *.ti3 of ArgyllCMS with spectra; repeat for both.  [default: NAME.csv]",
)
@click.option("--mode", help="Stereo mode; a rig has its own.")
@patch_options
@click.option("--notes", default="", help="Notes to store with the readings, such as the lens and the room.")
@click.option("--resume", is_flag=True, help="Resume a measurement: read the patches that have no reading yet.")
@click.option("--again", multiple=True, metavar="NAME", help="Patch to read once more; white#2 is the second white.")
@instrument_options
@show_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    rig_or_display: Path,
    output: Path,
    tables: tuple[Path, ...],
    mode: str | None,
    patches: PatchOptions,
    notes: str,
    resume: bool,
    again: tuple[str, ...],
    instrument: InstrumentOptions,
    unattended: bool,
    show: ShowOptions,
    as_json: bool,
) -> None:
    """Show patches and read each with an instrument.

    Readings go to NAME.jsonl one by one, and to a table at the end, for `display fit` and `display report`. Space
    pauses, Escape stops after the reading; --resume continues. Close the blinds, and let the display warm up first,
    unless the warm-up is measured. Where the instrument or the glasses must be moved, the run says so and waits.
    """
    from runner.cli.display.measuring_options import dialogue, raise_unless_complete
    from runner.measuring.station import measure_display

    unknown = [str(table) for table in tables if table.suffix.lower() not in (".csv", ".ti3")]
    if unknown:
        raise click.UsageError(f"--table is {unknown[0]}; name it *.csv or *.ti3")
    report = measure_display(
        rig_or_display,
        output,
        instrument,
        patches,
        show,
        tables=tables,
        mode=mode,
        notes=notes,
        resume=resume,
        again=again,
        dialogue=dialogue(show, unattended=unattended, quiet=as_json),
    )
    if as_json:
        click.echo(json.dumps(report.to_json()))
    raise_unless_complete(report.outcome, output)
    if not as_json:
        readings = counted(len(report.session.readings), "reading is", "readings are")
        click.echo(f"{readings} in {' and '.join(str(table) for table in report.tables)}")
