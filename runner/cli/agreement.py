"""`cyclopean agreement`: does a measure of pictures see what observers see?"""

from __future__ import annotations

from pathlib import Path

import click

from documents.files import writing
from runner.cli.number_types import NUMBER


class Limit(click.ParamType[tuple[str, float]]):
    """A measure's limit, such as flip=0.05."""

    name = "measure=value"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, float]:
        """Return the measure's name and the number."""
        if isinstance(value, tuple):
            return value
        measure, equals, number = str(value).rpartition("=")
        try:
            limit = NUMBER.convert(number, param, ctx)
        except click.BadParameter:
            limit, equals = 0.0, ""
        if not equals or not measure:
            self.fail(f"'{value}' is no limit of a measure, such as flip=0.05", param, ctx)
        return measure, limit


@click.command(name="agreement", short_help="Compare measures of an experiment's pictures with its observers.")
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RESULTS...")
@click.option(
    "--measures",
    required=True,
    metavar="NAME,...",
    help="Measures of pictures, such as delta-e-2000,flip; all for those that are installed.",
)
@click.option(
    "--photograph",
    "photographs",
    multiple=True,
    metavar="STIMULUS",
    help="Stimulus that the others are measured against, or FACTOR=LEVEL for one in each group; repeat for several. "
    "Default: the experiment's reference picture.",
)
@click.option(
    "--limit",
    "limits",
    type=Limit(),
    multiple=True,
    metavar="MEASURE=VALUE",
    help="Limit within which the measure sees no difference; repeat for each measure. Default: delta-e-2000=1.4, "
    "that of compare.",
)
@click.option(
    "--task",
    metavar="TASK",
    help="Answers to compare with: pairs, series, ratings or ratings:SCALE. Default: the first that there are.",
)
@click.option("--without", multiple=True, metavar="OBSERVER", help="Observer to leave out; repeat for each.")
@click.option(
    "--with-simulated",
    is_flag=True,
    help="Count simulated observers beside people; without it they count only where nobody else answered.",
)
@click.option("--alpha", type=NUMBER, help="Significance level. Default: the experiment's.")
@click.option(
    "--adjust",
    type=click.Choice(["holm", "bh", "maxz", "none"]),
    help="Correction for the number of pairs. Default: the experiment's.",
)
@click.option(
    "--experiment",
    type=click.Path(path_type=Path),
    help="Experiment file of the results. Default: experiments/NAME.yaml, or the study that holds them.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="HTML page to write, with figures.")
@click.option("--csv", "csv_folder", type=click.Path(path_type=Path), help="Folder for the tables as CSV.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    results: tuple[Path, ...],
    measures: str,
    photographs: tuple[str, ...],
    limits: tuple[tuple[str, float], ...],
    task: str | None,
    without: tuple[str, ...],
    with_simulated: bool,
    alpha: float | None,
    adjust: str | None,
    experiment: Path | None,
    output: Path | None,
    csv_folder: Path | None,
    as_json: bool,
) -> None:
    """Compare measures of an experiment's pictures with its observers.

    RESULTS are folders of sessions of one experiment. Every stimulus is measured beside its photograph, as the display
    showed both and from the distance in the record. Reported are correlations with observers' scores, how many of the
    pairs that observers tell apart the measure puts in order, and what a limit says of the photograph's class.
    """
    import json
    from typing import cast

    from analysis.agreement import print_agreement
    from analysis.choices import Adjust
    from analysis.observers import Filter
    from runner.agreement import AgreementOptions, compare_with_observers
    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.cli.work_done import work_done

    options = AgreementOptions(
        photographs=photographs,
        limits=dict(limits),
        task=task,
        rule=Filter(without, with_simulated=with_simulated),
        alpha=alpha,
        adjust=cast("Adjust | None", adjust),
        experiment=experiment,
        page=output,
        csv_folder=csv_folder,
    )
    with writing(output or results[0], "comparison", WorkError), progress_bar(quiet=as_json) as step:
        found = compare_with_observers(results, measures.split(","), options, step)
    if as_json:
        click.echo(json.dumps(found.to_json() | work_done(), indent=2, allow_nan=False))
        return
    print_agreement(found.agreement)
    if output is not None:
        click.echo(f"The page: {output}")
    if csv_folder is not None:
        click.echo(f"Its tables: {csv_folder}")
