"""How often each picture was chosen, and its score: each choice weighted by its similarity (Figure 4.14)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.series.choices import Choices
from analysis.series.observer_means import Estimate, means, shares

Floats = NDArray[np.float64]
WEIGHT = "similarity"


@dataclass(frozen=True, slots=True)
class PictureScore:
    """One picture of a series, or the pictures of one level in all series of a kind.

    Attributes
    ----------
    kind, level
        The kind of series, and where the picture stands in it.
    paint, series, stimulus
        None where all paints are taken together.
    chosen, of
        How often it was chosen, of how many choices from series that hold it.
    share
        chosen / of, 0 to 1.
    score
        Mean over these choices of the similarity if it was chosen, else 0: the thesis's score [Medina2016, Section
        4.5.1.1], in points of the scale. None without similarities. No interval where it was never chosen.
    weighted_share
        Its part of all similarity given in these choices, 0 to 1; over the pictures of a series they sum to 1.
    dwell_s, visits
        Mean time that it was seen, and how often it came up, in one choice.
    """

    kind: str
    level: float
    paint: str | None
    series: str | None
    stimulus: str | None
    chosen: int
    of: int
    share: Estimate
    score: Estimate | None
    weighted_share: float | None
    dwell_s: Estimate
    visits: Estimate

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "kind": self.kind,
            "level": self.level,
            "paint": self.paint,
            "series": self.series,
            "stimulus": self.stimulus,
            "chosen": self.chosen,
            "of": self.of,
            "share": self.share.to_json(),
            "score": None if self.score is None else self.score.to_json(),
            "weighted_share": self.weighted_share,
            "dwell_s": self.dwell_s.to_json(),
            "visits": self.visits.to_json(),
        }


def picture_scores(choices: Choices, *, pooled: bool, weight: str | None = WEIGHT) -> tuple[PictureScore, ...]:
    """Return the score of every picture, or, ``pooled``, of every level of every kind of series.

    ``weight`` is the scale by which choices count; None, or a scale that rated not all of them, gives no scores.
    The thesis prints no formula: "weighting each observation by its similarity to the reference" is read as written.
    """
    series = choices.design.series
    cells: dict[tuple[str, float], int] = {}
    place: dict[tuple[int, int], int] = {}
    labels: list[tuple[str, float, str | None, str | None, str | None]] = []
    for kind in choices.design.kinds if pooled else ():
        for level in choices.design.levels(kind):
            cells[kind, level] = len(labels)
            labels.append((kind, level, None, None, None))
    for number, one in enumerate(series):
        for index, (level, stimulus) in enumerate(zip(one.levels, one.stimuli, strict=True)):
            if pooled:
                place[number, index] = cells[one.kind, level]
            else:
                place[number, index] = len(labels)
                labels.append((one.kind, level, one.paint, one.name, stimulus))
    shape = len(choices.observers), len(labels)
    chosen, of, given, possible, dwell_s, visits = (np.zeros(shape) for _ in range(6))
    weighted = weight is not None and all(one.ratings.get(weight, -1.0) >= 0 for one in choices.choices)
    for choice in choices.choices:
        points = choice.ratings[weight] if weighted and weight is not None else 0.0
        for index in range(len(series[choice.series].stimuli)):
            cell = choice.observer, place[choice.series, index]
            of[cell] += 1
            possible[cell] += points
            dwell_s[cell] += choice.dwell_s[index]
            visits[cell] += choice.visits[index]
        cell = choice.observer, place[choice.series, choice.index]
        chosen[cell] += 1
        given[cell] += points
    scores = [_known(one) for one in means(given, of)] if weighted else [None] * shape[1]
    total, all_given = given.sum(axis=0), possible.sum(axis=0)
    found = zip(labels, shares(chosen, of), scores, means(dwell_s, of), means(visits, of), strict=True)
    return tuple(
        PictureScore(
            *label,
            chosen=int(chosen[:, cell].sum()),
            of=int(of[:, cell].sum()),
            share=share,
            score=score,
            weighted_share=float(total[cell] / all_given[cell]) if weighted and all_given[cell] > 0 else None,
            dwell_s=dwell,
            visits=visit,
        )
        for cell, (label, share, score, dwell, visit) in enumerate(found)
    )


def _known(score: Estimate) -> Estimate:
    """Return the score without its interval if nobody drawn anew could have given any other than 0."""
    if score.value != 0:
        return score
    return Estimate(0.0, None, None, score.answers, score.observers)
