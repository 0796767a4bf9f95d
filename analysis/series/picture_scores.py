"""Shares and scores of pictures (Figure 4.14), mean ratings (Figures 4.15, 4.16), and times of choices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from analysis.series.choices import Choice, Choices
from analysis.series.observer_means import Estimated, bounded_means, means, shares
from documents.text import JsonResult

# What a choice is rated on: similarity to a reference, as in the thesis, or quality where there is none.
WEIGHTS = ("similarity", "quality")


@dataclass(frozen=True, slots=True)
class PictureScore(JsonResult):
    """One picture of a series, or the pictures of one level in all series of a kind.

    Attributes
    ----------
    kind, level
        The kind of series, and the level of the picture in it.
    paint, series, stimulus
        None where all paints are pooled.
    chosen, of
        How often it was chosen, and how many choices there were from its series.
    share
        chosen / of, 0 to 1.
    score
        Mean over these choices of the rating (similarity, or quality without a reference) if it was chosen, else 0:
        the thesis's score [Medina2016, Section 4.5.1.1], in points of the scale. None without such ratings. No interval
        where it was never chosen.
    weighted_share
        Its share of the sum of these ratings in these choices, 0 to 1; over the pictures of a series they sum to 1.
    dwell_s, visits
        Mean time for which it was shown, and how often, per choice.
    """

    kind: str
    level: float
    paint: str | None
    series: str | None
    stimulus: str | None
    chosen: int
    of: int
    share: Estimated
    score: Estimated | None
    weighted_share: float | None
    dwell_s: Estimated
    visits: Estimated


def weight_of(choices: Choices, weights: Sequence[str] = WEIGHTS) -> str | None:
    """Return the first of ``weights`` that every choice was rated on, 0 or more; None if there is none."""
    rated = (scale for scale in weights if all(choice.ratings.get(scale, -1.0) >= 0 for choice in choices.choices))
    return next(rated, None)


def picture_scores(choices: Choices, *, pooled: bool, weight: str | None) -> tuple[PictureScore, ...]:
    """Return the score of every picture, or, ``pooled``, of every level of every kind of series.

    ``weight`` is the rating scale by which choices are weighted, as `weight_of` finds it; without one there are no
    scores. The thesis prints no formula: "weighting each observation by its similarity to the reference" is read as
    written.
    """
    series = choices.design.series
    cells: dict[tuple[str, float], int] = {}
    place: dict[tuple[int, int], int] = {}
    labels: list[tuple[str, float, str | None, str | None, str | None]] = []
    for kind in choices.design.kinds if pooled else ():
        for level in choices.design.levels(kind):
            cells[kind, level] = len(labels)
            labels.append((kind, level, None, None, None))
    for number, shown in enumerate(series):
        for index, (level, stimulus) in enumerate(zip(shown.levels, shown.stimuli, strict=True)):
            if pooled:
                place[number, index] = cells[shown.kind, level]
            else:
                place[number, index] = len(labels)
                labels.append((shown.kind, level, shown.paint, shown.name, stimulus))
    shape = len(choices.observers), len(labels)
    chosen, of, given, squares, possible, dwell_s, visits = (np.zeros(shape) for _ in range(7))
    most = 0.0
    for choice in choices.choices:
        points = choice.ratings[weight] if weight else 0.0
        for index in range(len(series[choice.series].stimuli)):
            cell = choice.observer, place[choice.series, index]
            of[cell] += 1
            possible[cell] += points
            dwell_s[cell] += choice.dwell_s[index]
            visits[cell] += choice.visits[index]
        cell = choice.observer, place[choice.series, choice.index]
        chosen[cell] += 1
        given[cell] += points
        squares[cell] += points**2
        most = max(most, points)
    scores = bounded_means(given, squares, of, most or 1.0) if weight else [None] * shape[1]
    total, all_given = given.sum(axis=0), possible.sum(axis=0)
    columns = zip(labels, shares(chosen, of), scores, means(dwell_s, of), means(visits, of), strict=True)
    return tuple(
        PictureScore(
            *label,
            chosen=int(chosen[:, cell].sum()),
            of=int(of[:, cell].sum()),
            share=share,
            score=score,
            weighted_share=float(total[cell] / all_given[cell]) if weight and all_given[cell] > 0 else None,
            dwell_s=dwell,
            visits=visit,
        )
        for cell, (label, share, score, dwell, visit) in enumerate(columns)
    )


@dataclass(frozen=True, slots=True)
class CellMean(JsonResult):
    """A mean over the choices from series of one ``kind`` and ``paint``; None means all of them."""

    kind: str | None
    paint: str | None
    mean: Estimated
    json_keys: ClassVar = {"mean": "*"}


def cell_means(choices: Choices, value: Callable[[Choice], float | None]) -> tuple[CellMean, ...]:
    """Return the mean of ``value`` (None where a choice has none) in each cell: kind and paint, kind, paint, and all.

    Every choice has the same weight. Intervals are by bootstrap over observers, as in `means`.
    """
    plan = choices.design
    cells: list[tuple[str | None, str | None]] = [(kind, paint) for kind in plan.kinds for paint in plan.paints]
    cells += [(kind, None) for kind in plan.kinds] + [(None, paint) for paint in plan.paints] + [(None, None)]
    place = {cell: number for number, cell in enumerate(cells)}
    total, count = np.zeros((len(choices.observers), len(cells))), np.zeros((len(choices.observers), len(cells)))
    for choice in choices.choices:
        number = value(choice)
        if number is None:
            continue
        series = plan.series[choice.series]
        for cell in ((series.kind, series.paint), (series.kind, None), (None, series.paint), (None, None)):
            total[choice.observer, place[cell]] += number
            count[choice.observer, place[cell]] += 1
    return tuple(CellMean(*cell, mean) for cell, mean in zip(cells, means(total, count), strict=True))


def rating_means(choices: Choices, scale: str) -> tuple[CellMean, ...]:
    """Return the mean rating on ``scale``, in its points."""
    return cell_means(choices, lambda choice: choice.ratings.get(scale))


def response_times_s(choices: Choices) -> tuple[CellMean, ...]:
    """Return the mean time in s from a series' first picture to the choice."""
    return cell_means(choices, lambda choice: choice.response_time_s)


def path_lengths(choices: Choices) -> tuple[CellMean, ...]:
    """Return the mean number of pictures shown before a choice, returns included."""
    return cell_means(choices, lambda choice: choice.path_length)
