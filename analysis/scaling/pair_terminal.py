"""Scores under any model of paired comparison as a table for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from analysis.scaling.pair_scores import ModelScores
from analysis.scaling.parameter import Parameter
from analysis.scaling.terminal import CLASS_STYLES, TOO_MANY
from documents.text.words import counted

if TYPE_CHECKING:
    from rich.console import Console

METHODS = {"ml": "maximum likelihood", "firth": "Firth's penalised likelihood", "map": "maximum a posteriori"}
ADJUSTMENTS = {"none": "unadjusted", "holm": "Holm", "bh": "Benjamini-Hochberg", "maxz": "single-step max z"}
NAMES = {"nu": "ties, ν", "eta": "ties, η", "order": "order effect"}


def print_model_scores(scores: ModelScores, console: Console | None = None) -> None:
    """Print one line per item, best first, then how the fit was made and what else was estimated."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = console or Console()
    thurstone = scores.fit.model == "thurstone"
    table = Table(box=None, header_style="bold", padding=(0, 1))
    table.add_column("item")
    for heading in ("wins", "of", *(("JOD", "se (JOD)") if thurstone else ("score", "log10", "se (nats)"))):
        table.add_column(heading, justify="right")
    table.add_column("class")
    for item in scores.items:
        strength, error = (None if v is None else v / scores.unit for v in (item.theta, item.se))
        values = (strength, error) if thurstone else (item.score, item.log10_score, item.se)
        style = CLASS_STYLES.get((item.label or "").split("+")[0], "")
        cells = [Text(item.name, overflow="fold"), Text(f"{item.wins:g}"), Text(f"{item.comparisons:g}")]
        cells += [Text("–" if value is None else f"{value:.4f}") for value in values]
        table.add_row(*cells, Text(item.label or "–", style=style))
    console.print(table)
    for line in summary_lines(scores):
        console.print(Text(line, style="dim"))


def summary_lines(scores: ModelScores) -> list[str]:
    """Say how the model was fitted, how well it fits, and what stands beside the strengths."""
    fit, classes, goodness = scores.fit, scores.classes, scores.fit.goodness
    if goodness is None:
        return ["No finite scores: see below."]
    prior = f", prior sd {fit.prior_sd:g}" if fit.prior_sd else ""
    covariance = "; covariance clustered by observer" if fit.covariance_kind == "sandwich" else ""
    lines = [
        f"{fit.model}, {METHODS[fit.method]}{prior}; log likelihood {fit.log_likelihood:.6g}{covariance}; "
        + (f"classes at alpha {classes.alpha:g}, {ADJUSTMENTS[classes.adjust]}" if classes else TOO_MANY)
    ]
    p = "" if goodness.p_deviance is None else f", p = {goodness.p_deviance:.2g}"
    lines.append(f"deviance {goodness.deviance:.4g} on {goodness.df} df{p}")
    if goodness.caveat and goodness.p_deviance is not None:
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
    if fit.ties_left_out:
        lines.append(
            f"{counted(fit.ties_left_out, 'answer prefers', 'answers prefer')} neither item; this "
            f"model leaves {'it' if fit.ties_left_out == 1 else 'them'} out."
        )
    return lines


def _line(parameter: Parameter) -> str:
    name = NAMES[parameter.name]
    if parameter.factor is None:
        return f"{name}: {parameter.estimate:+.4g} sd (95 % {parameter.low:.4g} to {parameter.high:.4g})"
    value, low, high = parameter.factor
    return f"{name}: {'× ' if parameter.name == 'order' else ''}{value:.4g} (95 % {low:.4g} to {high:.4g})"
