"""`cyclopean power`: how many observers an experiment needs."""

from __future__ import annotations

from pathlib import Path

import click

from documents.files import writing
from runner.cli.number_types import NATURAL, NUMBER, SEED, Whole


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
@click.option(
    "--replicates",
    type=Whole(2, 10**9),
    default=1000,
    show_default=True,
    help="Number of simulated studies for each number of observers.",
)
@click.option(
    "--scores",
    type=click.Path(path_type=Path),
    help="Assumed scores: a file of simulated observers, results or a table of a pilot study, or the JSON of "
    "`cyclopean scores`.",
)
@click.option(
    "--simulate", type=click.Path(path_type=Path), help="File of simulated observers: their scores and lapses."
)
@click.option("--spread", type=NUMBER, help="Assume evenly spaced scores over so many nats. Default without a file: 2.")
@click.option(
    "--observer-sd",
    type=NUMBER,
    help="Standard deviation between observers of each stimulus's log score, in nats. Default: that of --scores or "
    "--observers-from, or 0.7, with a note.",
)
@click.option(
    "--observers-from",
    type=click.Path(path_type=Path),
    help="Results, or a table TABLE.csv with observers, that say how much observers differ.",
)
@click.option(
    "--with-simulated",
    is_flag=True,
    help="Count simulated observers beside people in results; without it they count only where nobody else answered.",
)
@click.option(
    "--keep-na",
    is_flag=True,
    help="Take NA, NaN, None and the like in a table for names; without it they are missing values.",
)
@click.option("--lapse-rate", type=NUMBER, help="Share of random answers. Default: that of --simulate, or 0.")
@click.option("--pair", nargs=2, multiple=True, metavar="A B", help="Pair of stimuli that matters; repeat for each.")
@click.option(
    "--power",
    "target",
    type=NUMBER,
    default=0.8,
    show_default=True,
    help="Power that each of these pairs should reach.",
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
    help="Standard errors from the model, or clustered by observer. Default: the experiment's.",
)
@click.option(
    "--interval",
    type=click.Choice(["wald", "bootstrap"]),
    default="wald",
    show_default=True,
    help="Intervals from standard errors, or by bootstrap over observers in each study (slow).",
)
@click.option(
    "--seed",
    type=SEED,
    default=2016,
    show_default=True,
    help="Random seed; the same seed gives the same result.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Address of a Dask scheduler, such as tcp://10.0.0.5:8786.")
@click.option("--workers", type=NATURAL, help="Number of local processes. Default: as many as are useful.")
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
    replicates: int,
    scores: Path | None,
    simulate: Path | None,
    spread: float | None,
    observer_sd: float | None,
    observers_from: Path | None,
    with_simulated: bool,
    keep_na: bool,
    lapse_rate: float | None,
    pair: tuple[tuple[str, str], ...],
    target: float,
    alpha: float | None,
    adjust: str | None,
    covariance: str | None,
    interval: str,
    seed: int,
    scheduler: str | None,
    workers: int | None,
    output: Path | None,
    table: Path | None,
    as_json: bool,
) -> None:
    """Find how many observers an experiment needs, by simulated studies.

    EXPERIMENT is an experiment file with a block of all pairs; its stimuli need not be built. Whole studies are
    simulated under assumed scores, and analysed as `report` does.
    """
    import json
    import sys
    from typing import cast

    from analysis.classes import Adjust
    from analysis.power import ComputeError, Interval, print_power, write_csv, write_page
    from analysis.scaling import CovarianceChoice
    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.reports.power import PowerOptions, study_power

    if sum(given is not None for given in (scores, simulate, spread)) > 1:
        raise click.UsageError("Give one of --scores, --simulate and --spread.")
    if observer_sd is not None and observers_from is not None:
        raise click.UsageError("Give one of --observer-sd and --observers-from.")
    if scheduler is not None and workers is not None:
        raise click.UsageError("--workers are local processes; a scheduler has its own.")
    to_terminal = str(table) == "-"
    if as_json and to_terminal:
        raise click.UsageError("Both --json and --csv - would go to the terminal.")
    options = PowerOptions(
        observers=observers,
        scores=scores,
        simulate=simulate,
        spread_nats=spread,
        observer_sd=observer_sd,
        observers_from=observers_from,
        lapse_rate=lapse_rate,
        pairs=pair,
        target=target,
        alpha=alpha,
        adjust=cast("Adjust | None", adjust),
        covariance=cast("CovarianceChoice | None", covariance),
        interval=cast(Interval, interval),
        replicates=replicates,
        seed=seed,
        scheduler=scheduler,
        workers=workers,
        with_simulated=with_simulated,
        keep_na=keep_na,
    )
    try:
        with progress_bar(quiet=as_json) as step:
            study = study_power(
                experiment,
                options,
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
