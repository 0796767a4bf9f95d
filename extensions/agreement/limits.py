"""Does "within the limit" of a measure mean that observers do not tell a stimulus from the photograph?

Each stimulus is in one class with the photograph or not, and the measure lies within its limit or not. A limit is good
where the two say the same; where they do not, another limit may, and the area under the curve of hits against false
alarms says how well any limit can do [Green1966].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap import widened_percentiles
from analysis.report import wilson_interval
from documents.arrays import Flags, Floats
from documents.text import JsonResult
from extensions.agreement.observed import ObservedGroup
from extensions.agreement.pairs import LEAST_DRAWS


@dataclass(frozen=True, slots=True)
class Proportion(JsonResult):
    """``times`` ``of`` so many stimuli, their share, and Wilson's 95 % interval; None for no stimulus."""

    times: int
    of: int
    share: float | None
    low: float | None
    high: float | None

    @classmethod
    def counted(cls, times: int, of: int) -> Proportion:
        """Return the rate of so many stimuli."""
        if not of:
            return cls(times, of, None, None, None)
        low, high = wilson_interval(times / of, of)
        return cls(times, of, times / of, max(0.0, low), min(1.0, high))


@dataclass(frozen=True, slots=True)
class LimitTable(JsonResult):
    """What a limit says of the stimuli, against the classes.

    ``hits`` are within the limit and in one class with the photograph, ``misses`` beyond it and in one class,
    ``false_alarms`` within it and in another class, ``correct_rejections`` beyond it and in another class.
    """

    limit: float
    hits: int
    misses: int
    false_alarms: int
    correct_rejections: int
    json_also: ClassVar = ("hit_rate", "false_alarm_rate", "right")

    @property
    def hit_rate(self) -> Proportion:
        """Of the stimuli in one class with the photograph, those within the limit."""
        return Proportion.counted(self.hits, self.hits + self.misses)

    @property
    def false_alarm_rate(self) -> Proportion:
        """Of the stimuli in other classes, those within the limit."""
        return Proportion.counted(self.false_alarms, self.false_alarms + self.correct_rejections)

    @property
    def right(self) -> Proportion:
        """Of all stimuli, those of which the limit says what observers say."""
        count = self.hits + self.misses + self.false_alarms + self.correct_rejections
        return Proportion.counted(self.hits + self.correct_rejections, count)


@dataclass(frozen=True, slots=True, eq=False)
class LimitCheck(JsonResult):
    """A measure's limit against the classes.

    Attributes
    ----------
    stimuli, same
        How many stimuli there are beside the photographs, and how many of them are in one class with theirs.
    table
        What the limit says; None without a limit.
    area, area_low, area_high
        Area under the curve, 0 to 1: how often the measure puts a stimulus in the photograph's class nearer than one in
        another class. None where all are in one class, or none is. The interval is by bootstrap over observers.
    best, best_low, best_high
        The limit that agrees best, by the hit rate minus the false alarm rate [Youden1950], and its interval likewise.
    best_from, best_to
        All limits between these agree equally well; infinite where nothing bounds them.
    best_table
        What it says.
    curve
        The limits in order, each with its false alarm rate and its hit rate; empty without an area.
    """

    stimuli: int
    same: int
    table: LimitTable | None
    area: float | None
    area_low: float | None
    area_high: float | None
    best: float | None
    best_low: float | None
    best_high: float | None
    best_from: float | None
    best_to: float | None
    best_table: LimitTable | None
    curve: tuple[tuple[float, float, float], ...]


def calibrate(
    groups: Sequence[ObservedGroup],
    values: Sequence[Floats],
    photographs: Sequence[int],
    limit: float | None,
    *,
    higher_is_better: bool = False,
    level: float = 0.95,
) -> LimitCheck:
    """Compare a measure's limit with the classes of all groups.

    Parameters
    ----------
    groups
        What observers said, each with its photograph among the stimuli.
    values
        For each group, shape (n,): the measure in its own unit.
    photographs
        For each group, the index of its photograph.
    limit
        The limit; None for a measure without one.
    higher_is_better
        Whether stimuli within the limit are those at or above it.
    level
        The coverage of the intervals.

    Returns
    -------
    LimitCheck
        The table, the area and the best limit.
    """
    sign = -1.0 if higher_is_better else 1.0
    others = [np.delete(np.arange(len(own)), photograph) for own, photograph in zip(values, photographs, strict=True)]
    far = sign * np.concatenate([own[rest] for own, rest in zip(values, others, strict=True)])
    parts = list(zip(groups, photographs, others, strict=True))
    same = np.concatenate([~group.differs[photograph, rest] for group, photograph, rest in parts])
    area, best = _area(far, same), best_limits(far, same)
    areas, limits = _drawn(parts, far)
    people = min(group.observers for group in groups)
    area_ends, best_ends = (_ends(drawn, people, level) for drawn in (areas, limits))
    if area is None or best is None:
        area_ends = best_ends = (None, None)
    if best_ends[0] is not None and best_ends[1] is not None and sign < 0:
        best_ends = sign * best_ends[1], sign * best_ends[0]
    middle = None if best is None else sign * _middle(*best)
    stretch = (None, None) if best is None else (sign * best[0], sign * best[1])[:: int(sign)]
    return LimitCheck(
        stimuli=len(far),
        same=int(same.sum()),
        table=None if limit is None else _table(far, same, sign * limit, limit),
        area=area,
        area_low=area_ends[0],
        area_high=area_ends[1],
        best=middle,
        best_low=best_ends[0],
        best_high=best_ends[1],
        best_from=stretch[0],
        best_to=stretch[1],
        best_table=None if middle is None else _table(far, same, sign * middle, middle),
        curve=() if area is None else _curve(far, same, sign),
    )


def _table(far: Floats, same: Flags, limit: float, shown: float) -> LimitTable:
    within = far <= limit
    kinds = (within & same, ~within & same, within & ~same, ~within & ~same)
    return LimitTable(shown, *(int(kind.sum()) for kind in kinds))


def _area(far: Floats, same: Flags) -> float | None:
    """Return how often one of the same class is nearer than one of another, ties by half; None without both."""
    near, distant = far[same][:, None], far[~same][None]
    if not near.size or not distant.size:
        return None
    return float(((near < distant) + 0.5 * (near == distant)).mean())


def best_limits(far: Floats, same: Flags) -> tuple[float, float] | None:
    """Return the stretch of limits with the largest hit rate minus false alarm rate; None where all are of one sort.

    A limit counts what is at or below it. Of several stretches that are equally good, the one with the fewest false
    alarms.
    """
    alike, different = int(same.sum()), int((~same).sum())
    if not alike or not different:
        return None
    edges = np.unique(far)
    within = far[None] <= edges[:, None]
    youden = (within & same).sum(axis=1) / alike - (within & ~same).sum(axis=1) / different
    youden = np.concatenate([[0.0], youden])  # a limit below all
    place = int(np.flatnonzero(youden >= youden.max() - 1e-12)[0])
    bounds = np.concatenate([[-np.inf], edges, [np.inf]])
    return float(bounds[place]), float(bounds[place + 1])


def _middle(low: float, high: float) -> float:
    """Return a limit in a stretch: its middle, or the end that is finite."""
    if np.isfinite(low) and np.isfinite(high):
        return (low + high) / 2
    return low if np.isfinite(low) else float(np.nextafter(high, -np.inf))


def _drawn(parts: Sequence[tuple[ObservedGroup, int, NDArray[np.intp]]], far: Floats) -> tuple[Floats, Floats]:
    """Return areas and best limits of the bootstrap samples, NaN where a sample has none."""
    drawn = [group.drawn for group, _, _ in parts]
    whole = [one for one in drawn if one is not None]
    if len(whole) < len(drawn) or not whole:
        return np.empty(0), np.empty(0)
    count = min(len(one.differs) for one in whole)
    same = np.concatenate(
        [~one.differs[:count, photograph][:, rest] for one, (_, photograph, rest) in zip(whole, parts, strict=True)],
        axis=1,
    )
    known: dict[bytes, tuple[float, float]] = {}
    out = np.empty((count, 2))
    for number, row in enumerate(same):
        key = np.packbits(row).tobytes()
        if key not in known:
            area, best = _area(far, row), best_limits(far, row)
            known[key] = (np.nan, np.nan) if area is None or best is None else (area, _middle(*best))
        out[number] = known[key]
    return out[:, 0], out[:, 1]


def _ends(drawn: Floats, observers: int, level: float) -> tuple[float | None, float | None]:
    sound = np.sort(drawn[np.isfinite(drawn)])
    if not len(drawn) or len(sound) < LEAST_DRAWS * len(drawn):
        return None, None
    return widened_percentiles(sound, observers, level)


def _curve(far: Floats, same: Flags, sign: float) -> tuple[tuple[float, float, float], ...]:
    points = [(-sign * np.inf, 0.0, 0.0)]
    for edge in np.unique(far):
        within = far <= edge
        points.append((sign * float(edge), float(within[~same].mean()), float(within[same].mean())))
    return tuple(points)
