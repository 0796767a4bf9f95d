"""Scores as a table for the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from analysis.scaling.result import Parameter
from analysis.scaling.scores import Scores
from documents.text import counted

if TYPE_CHECKING:
    from rich.console import Console

Published = Mapping[str, tuple[float, str]]

TOO_MANY = "no classes: the items overlap in too many to list"
CLASS_STYLES = {"1": "green", "2": "blue", "3": "yellow", "4": "rgb(165,100,40)", "5": "red"}
METHODS = {"ml": "maximum likelihood", "firth": "Firth's penalised likelihood", "map": "maximum a posteriori"}
ADJUSTMENTS = {"none": "unadjusted", "holm": "Holm", "bh": "Benjamini-Hochberg", "maxz": "single-step max z"}
NAMES = {"nu": "ties, ν", "eta": "ties, η", "order": "order effect"}
REMEDIES = {
    "ml": "Collect more comparisons, or ask for a fit that stays finite: --method firth or --method map.",
    "firth": "Compare items of different groups with each other: only then have they a common scale.",
    "map": "Collect answers of other kinds: the prior keeps the strengths finite, and nothing else.",
}


def print_scores(scores: Scores, published: Published | None = None, console: Console | None = None) -> None:
    """Print one line per item, best first, then how the fit was made and what else was estimated.

    Parameters
    ----------
    scores
        What to print.
    published
        For each item, where there is one, a score and class published before, printed beside.
    console
        Where to print; standard output if None.

    Examples
    --------
    >>> import io
    >>> from rich.console import Console
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> scores = score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)]))
    >>> console = Console(file=io.StringIO(), width=120)
    >>> print_scores(scores, console=console)
    >>> console.file.getvalue().split()[:3]
    ['item', 'wins', 'of']
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = console or Console()
    table = Table(box=None, header_style="bold", padding=(0, 1))
    table.add_column("item")
    heading, numbers = _aligned(scores)
    table.add_column(heading, no_wrap=True)
    table.add_column("class")
    if published:
        table.add_column("published", justify="right")
        table.add_column("class")
    for item, line in zip(scores.items, numbers, strict=True):
        style = CLASS_STYLES.get((item.label or "").split("+")[0], "")
        cells = [Text(item.name, overflow="fold"), Text(line, no_wrap=True), Text(item.label or "–", style=style)]
        if published:
            known = published.get(item.name)
            cells += [Text(f"{known[0]:.4f}"), Text(known[1])] if known else [Text("–"), Text("–")]
        table.add_row(*cells)
    console.print(table)
    for line in summary_lines(scores):
        console.print(Text(line, style="dim"))


def _aligned(scores: Scores) -> tuple[str, list[str]]:
    """Return the headings of the numbers and each item's numbers, aligned: one cell of the table, quick to print."""
    thurstone, quasi = scores.fit.model == "thurstone", scores.quasi is not None
    unit = scores.jnd if thurstone else 1.0
    rows = [["wins", "of", *(("JOD", "se (JOD)") if thurstone else ("score", "log10", "se (nats)"))]]
    for item in scores.items:
        theta, se, quasi_se = (None if v is None else v / unit for v in (item.theta, item.se, item.quasi_se))
        values = [theta, se] if thurstone else [item.score, item.log10_score, se]
        shown = ["–" if value is None else f"{value:.4f}" for value in [*values, *([quasi_se] if quasi else [])]]
        rows.append([f"{item.wins:g}", f"{item.comparisons:g}", *shown])
    if quasi:
        rows[0].append("quasi se")
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True)) for row in rows]
    return lines[0], lines[1:]


def summary_lines(scores: Scores) -> list[str]:
    """Say how the model was fitted, how well it fits, and what was estimated beside the strengths."""
    fit, classes, goodness = scores.fit, scores.classes, scores.fit.goodness
    if goodness is None:
        return ["No finite estimate: complete separation."]
    plain = (
        fit.model == "bradley-terry" and fit.method != "map" and fit.covariance_kind == "model" and not fit.parameters
    )
    p = "" if goodness.p_deviance is None else f"{goodness.p_deviance:.2g}"
    grouped = f"classes at alpha {classes.alpha:g}, {ADJUSTMENTS[classes.adjust]}" if classes else TOO_MANY
    if plain:
        chance = f" (p = {p})" if p else ""
        rough = ", small counts: p is rough" if p and goodness.caveat else ""
        lines = [f"{METHODS[fit.method]}; deviance {goodness.deviance:.4g} on {fit.df} df{chance}{rough}; {grouped}"]
    else:
        prior = f", prior sd {fit.prior_sd:g}" if fit.prior_sd else ""
        clustered = "; covariance clustered by observer" if fit.covariance_kind == "sandwich" else ""
        likelihood = f"log likelihood {fit.log_likelihood:.6g}"
        lines = [f"{fit.model}, {METHODS[fit.method]}{prior}; {likelihood}{clustered}; {grouped}"]
        lines.append(f"deviance {goodness.deviance:.4g} on {goodness.df} df" + (f", p = {p}" if p else ""))
        if goodness.caveat and p:
            lines.append(goodness.caveat)
    if fit.held_by_prior:
        lines.append("Only the prior keeps these scores finite. " + " ".join(fit.held_by_prior.sentences))
    if classes and classes.without_spread:
        lines.append(
            f"{counted(classes.without_spread, 'pair has', 'pairs have')} no spread between observers, who all agree: "
            "not significant."
        )
    lines += [_line(parameter) for parameter in fit.parameters]
    if fit.order_test:
        lines.append(
            f"order effect against none: χ² = {fit.order_test.statistic:.4g} on 1 df, p = {fit.order_test.p:.2g}"
        )
    if scores.quasi is not None:
        low, high = scores.quasi.worst_below, scores.quasi.worst_above
        lines.append(f"quasi-variances: standard errors of differences are off by {low:+.1%} to {high:+.1%}")
    if fit.ties_left_out:
        them = "it" if fit.ties_left_out == 1 else "them"
        prefers = counted(fit.ties_left_out, "answer prefers", "answers prefer")
        lines.append(f"{prefers} neither item; this model leaves {them} out (davidson and rao-kupper do not).")
    return lines


def _line(parameter: Parameter) -> str:
    name = NAMES[parameter.name]
    if parameter.factor is None:
        return f"{name}: {parameter.estimate:+.4g} sd (95 % {parameter.low:.4g} to {parameter.high:.4g})"
    value, low, high = parameter.factor
    return f"{name}: {'× ' if parameter.name == 'order' else ''}{value:.4g} (95 % {low:.4g} to {high:.4g})"


def problem_lines(scores: Scores) -> list[str]:
    """Say why there are no scores and what to do, or that the iteration did not converge; else return nothing.

    Parameters
    ----------
    scores
        Scores of paired comparisons, as `score` returns them.

    Returns
    -------
    list[str]
        Lines of plain text; empty if the fit converged.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> problem_lines(score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)])))
    []
    >>> problem_lines(score(from_answers([Answer("a", "b", 30)])))[0]
    'no finite scores fit these comparisons:'
    """
    fit = scores.fit
    if fit.separation:
        why = [f"  {sentence}" for sentence in fit.separation.sentences]
        return ["no finite scores fit these comparisons:", *why, f"  {REMEDIES[fit.method]}"]
    return [] if fit.converged else [f"the fit did not converge in {fit.iterations} steps"]
