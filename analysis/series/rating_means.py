"""Mean ratings of the choices by series and paint (Figures 4.15 and 4.16), and how long choosing took."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.series.choices import Choice, Choices
from analysis.series.observer_means import Estimate, means


@dataclass(frozen=True, slots=True)
class CellMean:
    """A mean over the choices from series of one ``kind`` and ``paint``; None stands for all of them."""

    kind: str | None
    paint: str | None
    mean: Estimate

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {"kind": self.kind, "paint": self.paint, **self.mean.to_json()}


def cell_means(choices: Choices, value: Callable[[Choice], float | None]) -> tuple[CellMean, ...]:
    """Return the mean of ``value`` (None where a choice has none) in each cell: kind and paint, kind, paint, and all.

    Every choice has the same weight. Intervals are those of `means`: observers drawn anew.
    """
    plan = choices.design
    cells: list[tuple[str | None, str | None]] = [(kind, paint) for kind in plan.kinds for paint in plan.paints]
    cells += [(kind, None) for kind in plan.kinds] + [(None, paint) for paint in plan.paints] + [(None, None)]
    place = {cell: number for number, cell in enumerate(cells)}
    total, count = np.zeros((len(choices.observers), len(cells))), np.zeros((len(choices.observers), len(cells)))
    for one in choices.choices:
        number = value(one)
        if number is None:
            continue
        series = plan.series[one.series]
        for cell in ((series.kind, series.paint), (series.kind, None), (None, series.paint), (None, None)):
            total[one.observer, place[cell]] += number
            count[one.observer, place[cell]] += 1
    return tuple(CellMean(*cell, mean) for cell, mean in zip(cells, means(total, count), strict=True))


def rating_means(choices: Choices, scale: str) -> tuple[CellMean, ...]:
    """Return the mean rating on ``scale``, in its points."""
    return cell_means(choices, lambda one: one.ratings.get(scale))


def response_times_s(choices: Choices) -> tuple[CellMean, ...]:
    """Return the mean time in s from a series' first picture to the choice."""
    return cell_means(choices, lambda one: one.response_time_s)


def path_lengths(choices: Choices) -> tuple[CellMean, ...]:
    """Return how many pictures came up before a choice, returns included, on average."""
    return cell_means(choices, lambda one: one.path_length)
