"""The comparison matrix as cells with a count and a tint."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.scaling.scores import Scores


@dataclass(frozen=True, slots=True)
class Cell:
    """How often the row's item was preferred over the column's: ``wins`` of ``total``; ``tint`` is a CSS colour."""

    wins: float
    total: float
    tint: str
    dark: bool


def matrix_rows(scores: Scores) -> list[tuple[str, list[Cell | None]]]:
    """Return the items' names with their cells, best first both ways; None on the diagonal."""
    wins, totals = scores.comparisons.wins, scores.comparisons.totals
    return [
        (
            scores.comparisons.items[row],
            [None if row == column else _cell(wins[row, column], totals[row, column]) for column in scores.order],
        )
        for row in scores.order
    ]


def _cell(wins: float, total: float) -> Cell:
    if not total:
        return Cell(0.0, 0.0, "transparent", dark=False)
    share = float(wins / total)
    # From white (never) to a deep blue-green (always), through evenly darker steps that also read in grey.
    red, green, blue = (round(255 + share * (deep - 255)) for deep in (22, 84, 102))
    return Cell(float(wins), float(total), f"rgb({red},{green},{blue})", dark=share > 0.55)
