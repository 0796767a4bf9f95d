"""The summary of an experiment as a table for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from analysis.report.report import Report
from analysis.report.summary import Summary
from analysis.scaling.terminal import Published, print_scores

if TYPE_CHECKING:
    from rich.console import Console


def print_table(summary: Summary, published: Published | None = None, console: Console | None = None) -> None:
    """Print the scores, best first, beside ``published`` ones where given, and what a reader must know of them.

    Parameters
    ----------
    summary
        What `summarise` returned.
    published
        For each stimulus, where there is one, the score and the class published before.
    console
        Where to print; standard output if None.
    """
    from rich.console import Console
    from rich.text import Text

    console = console or Console()
    print_scores(summary.scores, published, console)
    console.print(Text(summary.sentence))
    for note in summary.notes:
        console.print(Text(f"Note: {note}", style="yellow"))


def print_report(report: Report, published: Published | None = None, console: Console | None = None) -> None:
    """Print scores where there are any, a sentence for each part, who was left out, and what must be known."""
    from rich.console import Console
    from rich.text import Text

    console = console or Console()
    if report.pairs is not None:
        print_scores(report.pairs.scores, published, console)
    for sentence in report.sentences:
        console.print(Text(sentence))
    if report.kept.left_out:
        console.print(Text(f"{report.kept.rule.sentence} {report.kept.sentence}"))
    for note in report.notes:
        console.print(Text(f"Note: {note}", style="yellow"))
