"""Simulated studies by the block, with several numbers of observers.

The unit of work is a block of replicates: simulated from its own seed, counted, and summed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.errors import ResultsError
from analysis.simulation.plan import Plan, check
from analysis.simulation.studies import run, widths
from documents import Finding
from documents.arrays import Floats

MOST_REPLICATES = 250
MOST_NUMBERS = 4_000_000
MOST_OBSERVERS = 100_000


@dataclass(frozen=True, slots=True, eq=False)
class StudyBatch:
    """``replicates`` studies of ``plan`` by ``observers`` each: number ``index`` of the blocks of that size."""

    plan: Plan
    observers: int
    replicates: int
    index: int
    seed: int
    critical_z: float

    def random(self) -> np.random.Generator:
        """Return the block's own random numbers: those of the seed, the number of observers and the index."""
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.observers, self.index)))


@dataclass(frozen=True, slots=True, eq=False)
class StudyTally:
    """Results of some studies: counts, sums, and sums of squares.

    Attributes
    ----------
    replicates, unfitted, separated
        How many studies there were, how many of them have no fit and are in none of the sums below, and how many were
        fitted by Firth's because an item won or lost all.
    right, wrong
        Shape (P,): in how many a pair differs the way it was assumed to (or at all, if it was assumed equal), and in
        how many the other way round.
    recovered
        In how many all pairs came out as the right classes have them.
    alike, alike_squares
        Sum of the share of pairs that did.
    width, width_squares
        Shape (n + 1,): sums of the width of each item's interval of log10 score, and last of their mean.
    """

    replicates: int
    unfitted: int
    separated: int
    right: Floats
    wrong: Floats
    recovered: int
    alike: float
    alike_squares: float
    width: Floats
    width_squares: Floats

    def __add__(self, other: StudyTally) -> StudyTally:
        return StudyTally(
            self.replicates + other.replicates,
            self.unfitted + other.unfitted,
            self.separated + other.separated,
            self.right + other.right,
            self.wrong + other.wrong,
            self.recovered + other.recovered,
            self.alike + other.alike,
            self.alike_squares + other.alike_squares,
            self.width + other.width,
            self.width_squares + other.width_squares,
        )


def blocks_of(plan: Plan, sizes: Sequence[int], replicates: int, seed: int) -> list[StudyBatch]:
    """Return blocks that fit into memory; their size depends on the plan and the numbers of observers alone.

    Parameters
    ----------
    plan
        The design, the assumed scores, and the tests.
    sizes
        Numbers of observers, ascending.
    replicates
        Number of simulated studies for each number of observers.
    seed
        Random seed.

    Raises
    ------
    ResultsError
        If the plan or a number is out of range.
    """
    check(plan)
    fewest = 2 if plan.interval == "bootstrap" else 1
    if not sizes or sizes[0] < fewest or sizes[-1] > MOST_OBSERVERS:
        given = ", ".join(str(size) for size in sizes) or "none"
        remedy = f"give numbers from {fewest} to {MOST_OBSERVERS}"
        raise ResultsError(Finding(f"the numbers of observers are {given}", remedy=remedy))
    if replicates < 2:
        raise ResultsError(Finding(f"{replicates} replicates were asked for", remedy="ask for 1000"))
    blocks = []
    critical_of: dict[int, float] = {}
    for observers in sizes:
        per_study = max(len(plan.differs), len(plan.items) ** 2) * (observers if plan.by_observer else 2)
        most = int(np.clip(MOST_NUMBERS // per_study, 1, MOST_REPLICATES))
        if plan.interval == "bootstrap":
            most = min(most, 10)
        # The model's law of the largest z is the same for any number of observers who compare the same pairs.
        alike = observers if plan.shared or plan.kind(observers) != "model" else 1
        if plan.adjust == "maxz" and alike not in critical_of:
            critical_of[alike] = plan.critical_z(alike)
        critical = critical_of.get(alike, float("nan"))
        for index, start in enumerate(range(0, replicates, most)):
            blocks.append(StudyBatch(plan, observers, min(most, replicates - start), index, seed, critical))
    return blocks


def simulate(block: StudyBatch) -> StudyTally:
    """Simulate the studies of a block and count their results."""
    plan, random = block.plan, block.random()
    studies = run(plan, block.observers, block.replicates, random)
    fitted = np.asarray(np.isfinite(studies.theta).all(axis=1))
    studies = studies.only(fitted)
    first, second = plan.pairs
    significant = studies.significant(block.critical_z)
    assumed = np.sign(plan.theta[first] - plan.theta[second])
    estimated = np.sign(studies.theta[:, first] - studies.theta[:, second])
    as_assumed = (assumed == 0) | (estimated == assumed)
    right, wrong = significant & as_assumed, significant & ~as_assumed
    as_classes = np.where(plan.differs, right, ~significant)
    alike = as_classes.mean(axis=1)
    width = widths(studies, random)
    width = np.column_stack([width, width.mean(axis=1)])
    return StudyTally(
        replicates=block.replicates,
        unfitted=int((~fitted).sum()),
        separated=int(studies.separated.sum()),
        right=right.sum(axis=0).astype(np.float64),
        wrong=wrong.sum(axis=0).astype(np.float64),
        recovered=int(as_classes.all(axis=1).sum()),
        alike=float(alike.sum()),
        alike_squares=float((alike**2).sum()),
        width=width.sum(axis=0),
        width_squares=(width**2).sum(axis=0),
    )


def summed(blocks: Sequence[StudyBatch], tallies: Iterable[StudyTally]) -> Mapping[int, StudyTally]:
    """Return the sum of the tallies of ``blocks`` for each number of observers.

    Raises
    ------
    ResultsError
        If fewer than two studies of some number of observers have a fit.
    """
    found: dict[int, StudyTally] = {}
    for block, tally in zip(blocks, tallies, strict=True):
        found[block.observers] = found[block.observers] + tally if block.observers in found else tally
    for size, tally in found.items():
        if tally.replicates - tally.unfitted < 2:
            raise ResultsError(Finding(f"studies with {size} observers have no fit", remedy="try more observers"))
    return found
