"""`cyclopean scores`: Bradley-Terry scores of any table of comparisons."""

from __future__ import annotations

import click


@click.command(name="scores")
@click.argument("table", metavar="TABLE.csv")
@click.option("--alpha", type=float, default=0.05, show_default=True, help="Level at which two items differ.")
@click.option(
    "--adjust",
    type=click.Choice(["holm", "bh", "maxz", "none"]),
    default="holm",
    show_default=True,
    help="Correction for testing every pair.",
)
@click.option(
    "--method",
    type=click.Choice(["ml", "firth"]),
    default="ml",
    show_default=True,
    help="Maximum likelihood, or Firth's penalised fit, finite for items that always win.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
def command(table: str, alpha: float, adjust: str, method: str, as_json: bool) -> None:
    """Fit scores and perceptual classes to a table of paired comparisons.

    TABLE.csv has the columns winner,loser and optionally count, observer and first (the item shown first);
    a single dash reads the table from standard input.
    """
    import json
    import sys
    from pathlib import Path
    from typing import cast

    from analysis.bradley_terry import Method
    from analysis.comparison_table import read_stream, read_table
    from analysis.multiplicity import Adjust
    from analysis.scores import score
    from analysis.separation import explain

    comparisons = read_stream(sys.stdin.buffer, "standard input") if table == "-" else read_table(Path(table))
    scores = score(comparisons, alpha=alpha, adjust=cast(Adjust, adjust), method=cast(Method, method))
    if as_json:
        click.echo(json.dumps(scores.to_json(), indent=2, allow_nan=False, ensure_ascii=False))
    else:
        from analysis.terminal import print_scores

        print_scores(scores)
    if scores.fit.separated:
        click.echo("cyclopean: no finite scores fit these comparisons:", err=True)
        for sentence in explain(scores.fit.separated, comparisons.wins, comparisons.items):
            click.echo(f"  {sentence}", err=True)
        click.echo(f"  {_remedy(method)}", err=True)
    elif not scores.fit.converged:
        click.echo(f"cyclopean: the fit did not converge in {scores.fit.iterations} steps", err=True)
    if not scores.fit.converged:
        sys.exit(1)


def _remedy(method: str) -> str:
    if method == "ml":
        return "Collect more comparisons, or ask for Firth's penalised fit: --method firth."
    return "Compare items of different groups with each other: only then have they a common scale."
