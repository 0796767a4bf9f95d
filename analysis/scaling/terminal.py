"""Scores as a table for the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from analysis.scaling.scores import Scores

if TYPE_CHECKING:
    from rich.console import Console

Published = Mapping[str, tuple[float, str]]

TOO_MANY = "no classes: the items overlap in too many to list"
CLASS_STYLES = {"1": "green", "2": "blue", "3": "yellow", "4": "rgb(165,100,40)", "5": "red"}


def print_scores(scores: Scores, published: Published | None = None, console: Console | None = None) -> None:
    """Print one line per item, best first.

    Parameters
    ----------
    scores
        What to print.
    published
        For each item, where there is one, a score and class published before, to stand beside.
    console
        Where to print; standard output if None.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = console or Console()
    table = Table(box=None, header_style="bold", padding=(0, 1))
    table.add_column("item")
    for heading in ("wins", "of", "score", "log10", "se (nats)"):
        table.add_column(heading, justify="right")
    table.add_column("class")
    if published:
        table.add_column("published", justify="right")
        table.add_column("class")
    for item in scores.items:
        style = CLASS_STYLES.get((item.label or "").split("+")[0], "")
        cells = [
            Text(item.name, overflow="fold"),
            Text(f"{item.wins:g}"),
            Text(f"{item.comparisons:g}"),
            Text(_number(item.score)),
            Text(_number(item.log10_score)),
            Text(_number(item.se)),
            Text(item.label or "–", style=style),
        ]
        if published:
            known = published.get(item.name)
            cells += [Text(f"{known[0]:.4f}"), Text(known[1])] if known else [Text("–"), Text("–")]
        table.add_row(*cells)
    console.print(table)
    console.print(Text(summary_line(scores), style="dim"))


def summary_line(scores: Scores) -> str:
    """Say in one line how well the model fits and how the classes were found."""
    fitted, classes = scores.fit, scores.classes
    if fitted.separated:
        return "No finite scores: the items are separated."
    name = {"none": "unadjusted", "holm": "Holm", "bh": "Benjamini-Hochberg", "maxz": "single-step max z"}
    method = "maximum likelihood" if fitted.method == "ml" else "Firth's penalised likelihood"
    goodness = scores.goodness()
    p = "" if goodness is None or goodness.p_deviance is None else f" (p = {goodness.p_deviance:.2g})"
    rough = ", small counts: p is rough" if p and goodness and goodness.caveat else ""
    return f"{method}; deviance {fitted.deviance:.4g} on {fitted.df} df{p}{rough}; " + (
        f"classes at alpha {classes.alpha:g}, {name[classes.adjust]}" if classes else TOO_MANY
    )


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4f}"
