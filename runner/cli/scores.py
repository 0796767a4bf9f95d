"""`cyclopean scores`: scores of any table of comparisons, by the model asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from runner.cli.number_types import NUMBER
from runner.cli.work_done import work_done

if TYPE_CHECKING:
    from analysis.choices import Adjust
    from analysis.comparisons import TableRead
    from analysis.scaling import Model

RANDOM_EXCLUDES = (
    "checks",
    "multiverse",
    "method",
    "prior_sd",
    "order_effect",
    "covariance",
    "quasi_variances",
    "pairs",
    "margin",
)
JOD_EXCLUDES = ("observers", "observer_scores", *(name for name in RANDOM_EXCLUDES if name != "method"))


@click.command(name="scores")
@click.argument("table", metavar="TABLE.csv")
@click.option(
    "--layout",
    metavar="NAME",
    help="Layout of the table: winner-loser, pwcmp, items, options, matrix or trials. Default: by its columns.",
)
@click.option(
    "--choice-codes",
    metavar="A,B,TIE",
    help="What the column of choices has for the first option, the second and so on, and then for neither.",
)
@click.option(
    "--keep-na",
    is_flag=True,
    help="Take NA, NaN, None and the like for names; without it they are missing values, whose lines are left out.",
)
@click.option(
    "--alpha",
    type=NUMBER,
    default=0.05,
    show_default=True,
    help="Significance level for a difference between two items.",
)
@click.option(
    "--adjust",
    type=click.Choice(["holm", "bh", "maxz", "none"]),
    default="holm",
    show_default=True,
    help="Correction for multiple comparisons.",
)
@click.option(
    "--model",
    type=click.Choice(["bradley-terry", "davidson", "rao-kupper", "thurstone"]),
    default="bradley-terry",
    show_default=True,
    help="Model of the answers; davidson and rao-kupper have ties, thurstone (Case V) gives JOD.",
)
@click.option(
    "--method",
    type=click.Choice(["auto", "ml", "firth", "map", "pwcmp"]),
    default="auto",
    show_default=True,
    help="Auto: maximum likelihood (ml), or Firth's penalty (firth) where some items always win. Or a Gaussian prior "
    "(map), or JOD as pwcmp has them.",
)
@click.option("--jod-zero", metavar="ITEM", help="Item at 0 JOD with --method pwcmp. Default: the table's first item.")
@click.option(
    "--distance-prior",
    type=click.Choice(["gaussian", "bounded", "none"]),
    default="gaussian",
    show_default=True,
    help="pwcmp's prior on distances: that of its present version, that of 2017, or none.",
)
@click.option("--prior-sd", type=NUMBER, help="Standard deviation of the prior on each log score. Default with map: 2.")
@click.option("--order-effect", is_flag=True, help="Fit the advantage of being shown first; needs the column 'first'.")
@click.option(
    "--covariance",
    type=click.Choice(["auto", "model", "scaled", "sandwich", "shrinkage"]),
    default="auto",
    show_default=True,
    help="Standard errors: model takes all answers for independent, the others only observers. "
    "Auto: shrinkage where the table names observers.",
)
@click.option(
    "--quasi-variances",
    is_flag=True,
    help="Add an error bar for each item whose squares add up for the difference of any two.",
)
@click.option("--pairs", is_flag=True, help="Add the probability that each item is preferred over each other one.")
@click.option(
    "--margin",
    metavar="MARGIN",
    help="Test each pair for equivalence within a margin: 0.5jnd, 55:45 or 0.2nats.",
)
@click.option(
    "--checks",
    is_flag=True,
    help="Check the model: transitivity, badly fitted pairs, and how well each model predicts new observers.",
)
@click.option(
    "--multiverse",
    is_flag=True,
    help="Repeat the analysis by every model, covariance and correction, and without each observer.",
)
@click.option(
    "--observers",
    type=click.Choice(["alike", "random"]),
    default="alike",
    show_default=True,
    help="random: observers differ, as drawn from a distribution; scores of the typical one, and a new one's answers.",
)
@click.option("--observer-scores", metavar="FILE.csv", help="Write each observer's scores; with --observers random.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    table: str,
    layout: str | None,
    choice_codes: str | None,
    keep_na: bool,
    alpha: float,
    adjust: str,
    model: str,
    method: str,
    jod_zero: str | None,
    distance_prior: str,
    prior_sd: float | None,
    order_effect: bool,
    covariance: str,
    quasi_variances: bool,
    pairs: bool,
    margin: str | None,
    checks: bool,
    multiverse: bool,
    observers: str,
    observer_scores: str | None,
    as_json: bool,
) -> None:
    """Fit scores and perceptual classes to a table of paired comparisons.

    TABLE.csv has the columns winner,loser and optionally count, observer, first (the item shown first), outcome (win or
    tie) or ties (how many were tied), and group, scene or content: each group then has scores of its own. Tables of
    choices, square matrices of counts (also MAT-files) and pwcmp's tables are read too. A single dash reads the table
    from standard input.
    """
    import json
    import sys
    from typing import Any, cast

    from analysis.choices import Adjust, CovarianceChoice
    from analysis.comparisons import read_any
    from analysis.inference import neighbour_conclusions, parse_margin, print_answer, review
    from analysis.scaling import (
        DEFAULT_PRIOR_SD,
        MethodChoice,
        Model,
        ScoreOptions,
        Scores,
        group_problem_lines,
        print_groups,
        print_scores,
        problem_lines,
        score,
        score_groups,
    )
    from documents.text import clean_console

    if prior_sd is not None and method != "map":
        raise click.UsageError("--prior-sd goes with --method map.")
    if margin is not None:
        parse_margin(margin, cast(Model, model))
    if method == "pwcmp":
        _refuse(JOD_EXCLUDES, "--method pwcmp")
        if _is_given("model") and model != "thurstone":
            raise click.UsageError("--method pwcmp is for --model thurstone.")
    elif jod_zero is not None or _is_given("distance_prior"):
        raise click.UsageError("--jod-zero and --distance-prior go with --method pwcmp.")
    if observers == "random":
        _refuse(RANDOM_EXCLUDES, "--observers random")
    elif observer_scores is not None:
        raise click.UsageError("--observer-scores goes with --observers random.")
    source = sys.stdin.buffer if table == "-" else table
    codes = [code.strip() for code in choice_codes.split(",")] if choice_codes else []
    read = read_any(source, "standard input", layout=layout, choice_codes=codes, keep_na=keep_na)
    comparisons = read.comparisons
    if as_json:
        _say_warnings(read)
    else:
        click.echo("".join(f"{line}\n" for line in read.lines), nl=False)
    if observers == "random":
        _random_observers(read, cast(Model, model), alpha, cast(Adjust, adjust), observer_scores, as_json)
        return
    if method == "pwcmp":
        correction = adjust if _is_given("adjust") else "none"
        _jod(read, jod_zero, distance_prior, alpha, correction, as_json)
        return
    options = ScoreOptions(
        alpha=alpha,
        adjust=cast(Adjust, adjust),
        method=cast(MethodChoice, method),
        prior_sd=DEFAULT_PRIOR_SD if prior_sd is None else prior_sd,
        order_effect=order_effect,
        covariance=cast(CovarianceChoice, covariance),
        quasi_variances=quasi_variances,
    )

    def further(scores: Scores) -> dict[str, Any]:
        """Compute what else was asked for, and print it unless the result is JSON."""
        if problem_lines(scores):
            return {}
        asked = review(scores, pairs=pairs, margin=margin, checks=checks, choices=multiverse)
        if as_json:
            concluded = [one.to_json() for one in neighbour_conclusions(scores, asked)]
            return {"conclusions": concluded} | {name: answer.to_json() for name, answer in asked.items()}
        for one in neighbour_conclusions(scores, asked, most=1):  # the best item and the next
            clean_console().print(one.sentence, markup=False, highlight=False)
        for answer in asked.values():
            print_answer(answer)
        return {}

    if comparisons.groups:
        grouped = score_groups(comparisons, cast(Model, model), **options)
        problems, values = group_problem_lines(grouped), grouped.to_json(further) if as_json else {}
        if not as_json:
            print_groups(grouped, further)
    else:
        scores = score(comparisons, cast(Model, model), **options)
        problems, values = problem_lines(scores), scores.to_json() if as_json else {}
        if not as_json:
            print_scores(scores)
        values |= further(scores)
    if as_json:
        click.echo(json.dumps(values | read.to_json() | work_done(), indent=2, allow_nan=False))
    if problems:
        click.echo("\n".join([f"cyclopean: {problems[0]}", *problems[1:]]), err=True)
        sys.exit(1)


def _say_warnings(read: TableRead) -> None:
    """Print on the error stream which lines of a table were left out."""
    for line in read.warnings:
        click.echo(f"warning: {line}", err=True)


def _is_given(name: str) -> bool:
    return click.get_current_context().get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def _refuse(names: tuple[str, ...], beside: str) -> None:
    for name in names:
        if _is_given(name):
            raise click.UsageError(f"--{name.replace('_', '-')} does not go with {beside}.")


def _jod(read: TableRead, zero: str | None, prior: str, alpha: float, adjust: str, as_json: bool) -> None:
    import json
    import sys
    from typing import cast

    from analysis.choices import Adjust
    from analysis.jod import print_jod, scale_jod, unsettled_lines
    from analysis.scaling import DistancePrior

    how = cast(DistancePrior, prior)
    scales = scale_jod(read.comparisons, zero=zero, prior=how, alpha=alpha, adjust=cast(Adjust, adjust))
    if as_json:
        click.echo(json.dumps(scales.to_json() | read.to_json() | work_done(), indent=2, allow_nan=False))
    else:
        print_jod(scales)
    if lines := unsettled_lines(scales):
        click.echo("\n".join([f"cyclopean: {lines[0]}", *lines[1:]]), err=True)
        sys.exit(1)


def _random_observers(
    read: TableRead, model: Model, alpha: float, adjust: Adjust, file: str | None, as_json: bool
) -> None:
    import json
    from pathlib import Path

    from analysis.hierarchical import fit_observers, observer_table, print_fit
    from documents.files import write_whole, writing
    from runner.cli.main import WorkError

    fit = fit_observers(read.comparisons, model, alpha=alpha, adjust=adjust)
    if file is not None:
        with writing(Path(file), "table", WorkError):
            write_whole(Path(file), observer_table(fit), private=True)
    if as_json:
        click.echo(json.dumps(fit.to_json() | read.to_json() | work_done(), indent=2, allow_nan=False))
    else:
        print_fit(fit)
