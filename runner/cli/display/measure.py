"""`cyclopean display measure`: patches shown and read, each reading on disk before the next patch."""

from __future__ import annotations

import json
from pathlib import Path

import click

from documents.text.words import counted
from runner.cli.display.measuring_options import (
    Choosing,
    Reading,
    Showing,
    choosing_options,
    reading_options,
    showing_options,
)


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
@choosing_options
@click.option("--notes", default="", help="Notes to store with the readings, such as the lens and the room.")
@click.option("--resume", is_flag=True, help="Resume a measurement: read the patches that have no reading yet.")
@click.option("--again", multiple=True, metavar="NAME", help="Patch to read once more; white#2 is the second white.")
@reading_options
@showing_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    rig_or_display: Path,
    output: Path,
    tables: tuple[Path, ...],
    mode: str | None,
    choosing: Choosing,
    notes: str,
    resume: bool,
    again: tuple[str, ...],
    reading: Reading,
    showing: Showing,
    as_json: bool,
) -> None:
    """Show patches and read each with an instrument.

    Readings go to NAME.jsonl one by one, and to a table at the end, for `display fit` and `display report`. Space
    pauses, Escape stops after the reading; --resume goes on. Close the blinds, and let the display warm up first,
    unless the warm-up is measured. Where the instrument or the glasses must be moved, the run says so and waits.
    """
    from devices.measurements.read import write_measurements
    from runner.cli.display.measuring_options import note, raise_unless_complete, talk, wiring_of
    from runner.measuring.station import Order, check_eye, measure, open_screen
    from runner.measuring.target import read_target

    tables = tables or (output.with_suffix(".csv"),)
    unknown = [str(table) for table in tables if table.suffix.lower() not in (".csv", ".ti3")]
    if unknown:
        raise click.UsageError(f"--table is {unknown[0]}; name it *.csv or *.ti3")
    target = read_target(rig_or_display, mode)
    note(check_eye(target, showing.eye))
    sets = choosing.sets(target, showing.eye)
    order = Order(sets, showing.eye, showing.seed, showing.repeat_every, showing.settle_s, notes)
    wiring = wiring_of(target, showing, reading)
    with open_screen(target, showing.backend, windowed=showing.windowed) as screen:
        for warning in screen.surface.facts.remarks:
            click.echo(f"warning: {warning}", err=True)
        outcome, session = measure(
            output,
            target,
            order,
            screen,
            reading.instrument,
            wiring,
            resume=resume,
            again=again,
            talk=talk(showing, reading, quiet=as_json),
        )
    for table in tables if session.readings else ():
        write_measurements(session, table)
    if as_json:
        facts = {"readings": len(session.readings), "missing": [step.label for step in session.missing]}
        done = {"taken": outcome.taken, "failed": outcome.failed, "stopped": outcome.stopped}
        click.echo(
            json.dumps({"measurement": str(output), "tables": [str(table) for table in tables], **facts, **done})
        )
    raise_unless_complete(outcome, output)
    if not as_json:
        click.echo(
            f"{counted(len(session.readings), 'reading is', 'readings are')} in "
            f"{' and '.join(str(table) for table in tables)}"
        )
