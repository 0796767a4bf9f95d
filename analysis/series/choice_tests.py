"""Tests of choices: do they differ between series, and are neighbouring pictures chosen equally often?

All tests permute whole observers: an observer who chose from five paints is one independent unit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from analysis.classes.conclusions import Conclusion, concluded
from analysis.classes.multiplicity import holm
from analysis.series.choices import Choices
from analysis.series.paired_tests import DRAWS, cochran, p_by_flips, quadratic_form, stuart_maxwell
from documents.arrays import Floats
from documents.text import JsonResult


@dataclass(frozen=True, slots=True)
class KindsTest(JsonResult):
    """Whether choices from series of two kinds fall on the same levels.

    ``statistic`` is Stuart and Maxwell's [Stuart1955] with observers in the place of answers; ``p`` is of the
    permutation test that exchanges the two kinds within observers, ``p_holm`` adjusted for all pairs of kinds.
    ``shift`` is the mean position (from 0) of the choices from ``one`` minus that from ``other``.
    """

    one: str
    other: str
    observers: int
    statistic: float
    df: int
    p: float
    p_holm: float
    shift: float

    @property
    def conclusion(self) -> Conclusion:
        """Whether choices from the two kinds are distinguished; the estimate is the shift, in places of the series."""
        found = concluded(f"choices: {self.one} − {self.other}", self.p_holm, None)
        return replace(found, estimate=self.shift, unit="places")


@dataclass(frozen=True, slots=True)
class LevelTest(JsonResult):
    """Whether one level is chosen equally often from all kinds of series: Cochran's Q [Cochran1950].

    ``shares`` are by kind. ``p`` is of the permutation test that exchanges kinds within observers, ``p_holm`` adjusted
    for all levels; None where no observer or every observer chose that level.
    """

    level: float
    shares: tuple[float, ...]
    statistic: float | None
    p: float | None
    p_holm: float | None


@dataclass(frozen=True, slots=True)
class NeighboursTest(JsonResult):
    """Whether two neighbouring levels of one kind of series are chosen equally often.

    ``one`` and ``other`` are the levels, ``chosen`` how often each was chosen. ``p`` is of the permutation test that
    exchanges the two within observers, ``p_holm`` adjusted for all neighbours of the kind.
    """

    kind: str
    one: float
    other: float
    chosen: tuple[int, int]
    p: float
    p_holm: float


def choice_counts(choices: Choices) -> Floats:
    """Return how often each observer chose each level from each kind, shape (observers, kinds, levels).

    A paint counts for an observer who chose from it in all kinds, so that kinds are compared on the same paints;
    repeats are averaged.
    """
    plan = choices.design
    levels = {level: number for number, level in enumerate(plan.levels())}
    kinds = {kind: number for number, kind in enumerate(plan.kinds)}
    paints = {paint: number for number, paint in enumerate(plan.paints)}
    counts = np.zeros((len(choices.observers), len(paints), len(kinds), len(levels)))
    for choice in choices.choices:
        series = plan.series[choice.series]
        cell = choice.observer, paints[series.paint], kinds[series.kind], levels[series.levels[choice.index]]
        counts[cell] += 1
    answers = counts.sum(axis=3, keepdims=True)
    counts = np.divide(counts, answers, out=np.zeros_like(counts), where=answers > 0)
    whole = (answers > 0).all(axis=2, keepdims=True)
    return np.asarray((counts * whole).sum(axis=1))


def kinds_tests(choices: Choices, draws: int = DRAWS) -> tuple[KindsTest, ...]:
    """Compare each two kinds of series by the levels chosen; no tests where their levels differ."""
    plan = choices.design
    counts = choice_counts(choices)
    counts = counts[counts.sum(axis=(1, 2)) > 0]
    if len({plan.levels(kind) for kind in plan.kinds}) != 1 or len(counts) < 2:
        return ()
    tests = []
    places = np.arange(counts.shape[2])
    for a, b in combinations(range(len(plan.kinds)), 2):
        differences = counts[:, a] - counts[:, b]
        statistic, df = stuart_maxwell(differences)
        p = p_by_flips(differences, quadratic_form(differences), draws)
        shift = float((differences.sum(axis=0) * places).sum() / counts[:, a].sum())
        tests.append((plan.kinds[a], plan.kinds[b], len(counts), statistic, df, p, shift))
    adjusted = holm(np.array([test[5] for test in tests])) if tests else np.zeros(0)
    return tuple(KindsTest(*test[:6], float(q), test[6]) for test, q in zip(tests, adjusted, strict=True))


def level_tests(choices: Choices) -> tuple[LevelTest, ...]:
    """Compare all kinds of series by how often each level is chosen."""
    plan = choices.design
    counts = choice_counts(choices)
    counts = counts[counts.sum(axis=(1, 2)) > 0]
    if len(plan.kinds) < 2 or len({plan.levels(kind) for kind in plan.kinds}) != 1 or len(counts) < 2:
        return ()
    tests = []
    answers = counts[:, 0].sum()
    for number, level in enumerate(plan.levels()):
        rows = counts[:, :, number]
        statistic, p = cochran(rows)
        tests.append((level, tuple((rows.sum(axis=0) / answers).tolist()), statistic, p))
    tested = [number for number, test in enumerate(tests) if test[3] is not None]
    adjusted = dict(zip(tested, holm(np.array([tests[number][3] for number in tested], np.float64)), strict=True))
    return tuple(
        LevelTest(*test, float(adjusted[number]) if number in adjusted else None) for number, test in enumerate(tests)
    )


def neighbours_tests(choices: Choices) -> tuple[NeighboursTest, ...]:
    """Compare each level with the next, within each kind of series.

    Equal shares do not show that two levels look the same: they may lie on either side of the best level. Unequal
    shares show that observers can discriminate them.
    """
    plan = choices.design
    results: list[NeighboursTest] = []
    for kind in plan.kinds:
        levels = plan.levels(kind)
        counts = np.zeros((len(choices.observers), len(levels)))
        for choice in choices.choices:
            series = plan.series[choice.series]
            if series.kind == kind:
                counts[choice.observer, levels.index(series.levels[choice.index])] += 1
        tests = []
        for low, _ in pairwise(range(len(levels))):
            difference = counts[:, low + 1] - counts[:, low]
            tests.append(p_by_flips(difference[:, None], lambda sums: np.abs(sums[:, 0])))
        total = counts.sum(axis=0).astype(int).tolist()
        for low, (p, q) in enumerate(zip(tests, holm(np.array(tests)), strict=True)):
            chosen = total[low], total[low + 1]
            results.append(NeighboursTest(kind, levels[low], levels[low + 1], chosen, p, float(q)))
    return tuple(results)
