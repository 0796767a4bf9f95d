"""The thesis's Figures 4.14, 4.15 and 4.16 from a summary of choices, each a figure with its table."""

from __future__ import annotations

from analysis.errors import ResultsError
from analysis.series.bar_figure import BarFigure
from analysis.series.observer_means import Estimate
from analysis.series.summary import SeriesSummary
from documents import Finding


def score_figure(summary: SeriesSummary) -> BarFigure:
    """Return the score of each level, a bar for each kind of series: Figure 4.14.

    Where there are no scores, the shares of choices take their place.
    """
    scored = any(one.score is not None for one in summary.levels)
    plan = summary.choices.design
    found: dict[tuple[float, str], Estimate | None] = {
        (one.level, one.kind): one.score if scored else one.share for one in summary.levels
    }
    levels = plan.levels()
    return BarFigure(
        "Score of each picture: choices weighted by similarity" if scored else "Share of choices of each picture",
        words(plan.along or "place in the series"),
        "mean score" if scored else "share of choices",
        tuple(f"{level:g}" for level in levels),
        plan.kinds,
        tuple(tuple(found.get((level, kind)) for kind in plan.kinds) for level in levels),
    )


def rating_figure(summary: SeriesSummary, scale: str) -> BarFigure:
    """Return the mean rating of each paint, a bar for each kind of series: Figures 4.15 and 4.16.

    The thesis draws ``difficulty`` the other way round: there a low number means hard to discern, here it is as rated,
    and a high number means hard.

    Raises
    ------
    ResultsError
        If nothing was rated on such a scale.
    """
    if scale not in summary.ratings:
        known = ", ".join(summary.ratings)
        remedy = f"one of: {known}" if known else "ask for ratings in the block"
        raise ResultsError(Finding(f"no choice was rated on a scale '{scale}'", remedy=remedy))
    plan = summary.choices.design
    found: dict[tuple[str | None, str | None], Estimate] = {
        (one.paint, one.kind): one.mean for one in summary.ratings[scale]
    }
    return BarFigure(
        f"Mean {words(scale)} by {words(plan.across or 'series')}",
        words(plan.across or ""),
        f"mean {words(scale)}",
        plan.paints,
        plan.kinds,
        tuple(tuple(found[paint, kind] for kind in plan.kinds) for paint in plan.paints),
    )


def words(name: str) -> str:
    """Return a factor's or a scale's name as words, its unit in brackets."""
    text = name.removesuffix("_s")
    return (f"{text} (s)" if text != name else name).replace("_", " ")
