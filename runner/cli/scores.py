"""`cyclopean scores`: scores of any table of comparisons, by the model asked for."""

from __future__ import annotations

from pathlib import Path

import click

from documents.files import writing
from runner.cli.options import takes
from runner.cli.output import work_done
from runner.reports.options import ScoresOptions


@click.command(name="scores")
@click.argument("table", metavar="TABLE.csv")
@takes(ScoresOptions)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(table: str, as_json: bool, options: ScoresOptions) -> None:
    """Fit scores and perceptual classes to a table of paired comparisons.

    TABLE.csv has the columns winner,loser and optionally count, observer, first (the item shown first), outcome (win or
    tie) or ties (how many were tied), and group, scene or content: each group then has scores of its own. Tables of
    choices, square matrices of counts (also MAT-files) and pwcmp's tables are read too. A single dash reads the table
    from standard input.
    """
    import json
    import sys

    from analysis.comparisons import read_any
    from documents import WorkError
    from runner.reports.scores import refuse_together, score_table

    refuse_together(options)  # before the table is read
    source = sys.stdin.buffer if table == "-" else table
    read = read_any(
        source, "standard input", layout=options.layout, choice_codes=options.codes, keep_na=options.keep_na
    )
    for line in read.warnings if as_json else read.lines:
        click.echo(f"warning: {line}" if as_json else line, err=as_json)
    with writing(options.observer_scores or Path("."), "table", WorkError):
        scored = score_table(read.comparisons, options)
    if as_json:
        click.echo(json.dumps(scored.to_json() | read.to_json() | work_done(), indent=2, allow_nan=False))
    else:
        scored.print()
    if problems := scored.problems:
        click.echo("\n".join([f"cyclopean: {problems[0]}", *problems[1:]]), err=True)
        sys.exit(1)
