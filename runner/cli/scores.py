"""`cyclopean scores`: scores of any table of comparisons, by the model asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from documents.text.words import counted

if TYPE_CHECKING:
    from analysis.comparisons.comparisons import Comparisons
    from analysis.scaling.pair_scores import ModelScores
    from analysis.scaling.scores import Scores


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
    as_json: bool,
) -> None:
    """Fit scores and perceptual classes to a table of paired comparisons.

    TABLE.csv has the columns winner,loser and optionally count, observer, first (the item shown first) and outcome
    (win or tie) or ties (how many were tied); a single dash reads the table from standard input.
    """
    import sys
    from pathlib import Path
    from typing import cast

    from analysis.classes.multiplicity import Adjust
    from analysis.comparisons.table import read_stream, read_table
    from analysis.scaling.bradley_terry import Method
    from analysis.scaling.pair_fit import DEFAULT_PRIOR_SD, CovarianceKind, Model, ModelMethod
    from analysis.scaling.pair_scores import score_model
    from analysis.scaling.scores import score

    if prior_sd is not None and method != "map":
        raise click.UsageError("--prior-sd goes with --method map.")
    comparisons = read_stream(sys.stdin.buffer, "standard input") if table == "-" else read_table(Path(table))
    correction = cast(Adjust, adjust)
    if model == "bradley-terry" and method != "map" and covariance == "model" and not order_effect:
        plain = score(comparisons, alpha=alpha, adjust=correction, method=cast(Method, method))
        sound = _tell_plain(plain, comparisons, as_json)
    else:
        sound = _tell(
            score_model(
                comparisons,
                cast(Model, model),
                alpha=alpha,
                adjust=correction,
                method=cast(ModelMethod, method),
                prior_sd=DEFAULT_PRIOR_SD if prior_sd is None else prior_sd,
                order_effect=order_effect,
                covariance=cast(CovarianceKind, covariance),
            ),
            as_json,
        )
    if not sound:
        sys.exit(1)


def _tell_plain(scores: Scores, comparisons: Comparisons, as_json: bool) -> bool:
    from analysis.scaling.separation import explain
    from analysis.scaling.terminal import print_scores

    if as_json:
        _print_json(scores.to_json())
    else:
        print_scores(scores)
        if comparisons.ties:
            one, many = "answer prefers neither item and is", "answers prefer neither item and are"
            click.echo(f"{counted(comparisons.ties, one, many)} left out; see --model davidson.")
    if scores.fit.separated:
        _explain(explain(scores.fit.separated, comparisons.wins, comparisons.items), scores.fit.method)
    elif not scores.fit.converged:
        click.echo(f"cyclopean: the fit did not converge in {scores.fit.iterations} steps", err=True)
    return scores.fit.converged


def _tell(scores: ModelScores, as_json: bool) -> bool:
    from analysis.scaling.pair_terminal import print_model_scores

    if as_json:
        _print_json(scores.to_json())
    else:
        print_model_scores(scores)
    fit = scores.fit
    if fit.separation:
        _explain(list(fit.separation.sentences), fit.method)
    elif not fit.converged:
        click.echo(f"cyclopean: the fit did not converge in {fit.iterations} steps", err=True)
    return fit.converged


def _print_json(told: dict[str, object]) -> None:
    import json

    click.echo(json.dumps(told, indent=2, allow_nan=False, ensure_ascii=False))


def _explain(sentences: list[str], method: str) -> None:
    click.echo("cyclopean: no finite scores fit these comparisons:", err=True)
    for sentence in sentences:
        click.echo(f"  {sentence}", err=True)
    remedy = {
        "ml": "Collect more comparisons, or ask for a fit that stays finite: --method firth or --method map.",
        "firth": "Compare items of different groups with each other: only then have they a common scale.",
        "map": "Collect answers of other kinds: the prior holds the strengths, and nothing else.",
    }
    click.echo(f"  {remedy[method]}", err=True)
