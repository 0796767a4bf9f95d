"""`cyclopean scores`: scores of any table of comparisons, by the model asked for."""

from __future__ import annotations

import click


@click.command(name="scores")
@click.argument("table", metavar="TABLE.csv")
@click.option(
    "--alpha",
    type=float,
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
    type=click.Choice(["ml", "firth", "map"]),
    default="ml",
    show_default=True,
    help="Maximum likelihood; or, for items that always win, Firth's penalty or a Gaussian prior.",
)
@click.option("--prior-sd", type=float, help="Standard deviation of the prior on each log score. Default with map: 2.")
@click.option("--order-effect", is_flag=True, help="Fit the advantage of being shown first; needs the column 'first'.")
@click.option(
    "--covariance",
    type=click.Choice(["model", "sandwich"]),
    default="model",
    show_default=True,
    help="Standard errors from the model, or clustered by observer.",
)
@click.option(
    "--quasi-variances",
    is_flag=True,
    help="Add an error bar for each item whose squares add up for the difference of any two.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    table: str,
    alpha: float,
    adjust: str,
    model: str,
    method: str,
    prior_sd: float | None,
    order_effect: bool,
    covariance: str,
    quasi_variances: bool,
    as_json: bool,
) -> None:
    """Fit scores and perceptual classes to a table of paired comparisons.

    TABLE.csv has the columns winner,loser and optionally count, observer, first (the item shown first) and outcome
    (win or tie) or ties (how many were tied); a single dash reads the table from standard input.
    """
    import json
    import sys
    from typing import cast

    from analysis.classes import Adjust
    from analysis.comparisons import read_stream, read_table
    from analysis.scaling import (
        DEFAULT_PRIOR_SD,
        CovarianceKind,
        Model,
        ModelMethod,
        print_scores,
        problem_lines,
        score,
    )

    if prior_sd is not None and method != "map":
        raise click.UsageError("--prior-sd goes with --method map.")
    comparisons = read_stream(sys.stdin.buffer, "standard input") if table == "-" else read_table(table)
    scores = score(
        comparisons,
        cast(Model, model),
        alpha=alpha,
        adjust=cast(Adjust, adjust),
        method=cast(ModelMethod, method),
        prior_sd=DEFAULT_PRIOR_SD if prior_sd is None else prior_sd,
        order_effect=order_effect,
        covariance=cast(CovarianceKind, covariance),
        quasi_variances=quasi_variances,
    )
    if as_json:
        click.echo(json.dumps(scores.to_json(), indent=2, allow_nan=False, ensure_ascii=False))
    else:
        print_scores(scores)
    problems = problem_lines(scores)
    if problems:
        click.echo("\n".join([f"cyclopean: {problems[0]}", *problems[1:]]), err=True)
        sys.exit(1)
