"""`cyclopean power`: how many observers an experiment needs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from documents.files import writing
from runner.cli.options import takes
from runner.reports.options import PowerOptions


class Numbers(click.ParamType[tuple[int, ...]]):
    """Numbers of observers: 30, or 10,20,40, or 10:60:5 for 10 to 60 in steps of 5."""

    name = "numbers"
    most = 1000
    most_observers = 100_000

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """Return the numbers, ascending, each once."""
        if isinstance(value, tuple):
            return value
        chosen: set[int] = set()
        for part in str(value).split(","):
            ends = part.split(":")
            if not all(end.strip().isdecimal() for end in ends) or len(ends) > 3:
                self.fail(f"'{part}' is neither a number nor a range such as 10:60:5", param, ctx)
            if any(len(end.strip()) > len(str(self.most_observers)) for end in ends):
                self.fail(f"there are {self.most_observers} observers at most", param, ctx)
            numbers = [int(end) for end in ends]
            first, last, step = numbers[0], numbers[min(1, len(ends) - 1)], numbers[2] if len(ends) == 3 else 1
            if first < 1 or not first <= last <= self.most_observers or step < 1:
                self.fail(f"'{part}' is not a number of observers", param, ctx)
            if (last - first) // step >= self.most:
                self.fail(f"'{part}' has more than {self.most} numbers", param, ctx)
            chosen |= set(range(first, last + 1, step))
        return tuple(sorted(chosen))


@click.command(name="power")
@click.argument("experiment", type=click.Path(path_type=Path))
@click.option(
    "--observers",
    type=Numbers(),
    default="10:60:5",
    show_default=True,
    help="Numbers of observers: 30, or first:last:step.",
)
@takes(PowerOptions, leave_out={"observers"})
@click.option("-o", "--output", type=click.Path(path_type=Path), help="HTML page to write, with curves and tables.")
@click.option(
    "--csv",
    "table",
    type=click.Path(path_type=Path),
    help="CSV file to write, with every value; a dash for the terminal.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    experiment: Path,
    observers: tuple[int, ...],
    output: Path | None,
    table: Path | None,
    as_json: bool,
    options: PowerOptions,
) -> None:
    """Find how many observers an experiment needs, by simulated studies.

    EXPERIMENT is an experiment file with a block of all pairs; its stimuli need not be built. Whole studies are
    simulated under assumed scores, and analysed as `report` does.
    """
    import json
    import sys

    from analysis.power import ComputeError, print_power, write_csv, write_page
    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.reports.power import study_power

    if sum(given is not None for given in (options.scores, options.simulate, options.spread_nats)) > 1:
        raise click.UsageError("Give one of --scores, --simulate and --spread.")
    if options.observer_sd is not None and options.observers_from is not None:
        raise click.UsageError("Give one of --observer-sd and --observers-from.")
    if options.scheduler is not None and options.workers is not None:
        raise click.UsageError("--workers are local processes; a scheduler has its own.")
    to_terminal = str(table) == "-"
    if as_json and to_terminal:
        raise click.UsageError("Both --json and --csv - would go to the terminal.")
    try:
        with progress_bar(quiet=as_json) as step:
            study = study_power(
                experiment,
                replace(options, observers=observers),
                lambda done, of: step("Simulating studies", done, of),
                lambda line: click.echo(f"note: {line}", err=True),
            )
    except ComputeError as error:
        raise WorkError(str(error)) from error
    if output is not None:
        with writing(output, "page", WorkError):
            write_page(study.needed, output, study.experiment, study.notes)
    if table is not None and not to_terminal:
        with writing(table, "table", WorkError):
            write_csv(study.needed, table)
    if as_json:
        click.echo(json.dumps(study.to_json(), indent=2, allow_nan=False))
        return
    if to_terminal:
        write_csv(study.needed, sys.stdout)
        return
    print_power(study.needed)
    for note in study.notes:
        click.echo(note)
    if output is not None:
        click.echo(f"The page: {output}")
