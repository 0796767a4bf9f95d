"""A block of replicates, the unit of work: simulated from a seed of its own, counted, and added up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.power.plan import Plan
from analysis.power.studies import run
from analysis.power.widths import widths

Floats = NDArray[np.float64]

MOST_REPLICATES = 250
MOST_NUMBERS = 4_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Block:
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
class Tally:
    """What became of some studies: counts, sums, and sums of squares.

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

    def __add__(self, other: Tally) -> Tally:
        return Tally(
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


def blocks_of(plan: Plan, sizes: Sequence[int], replicates: int, seed: int) -> list[Block]:
    """Part the work into blocks that fit into memory. How large they are depends on the plan and the sizes alone."""
    found = []
    common = plan.critical_z(2) if plan.adjust == "maxz" and plan.covariance == "model" else float("nan")
    for observers in sizes:
        per_study = max(len(plan.times), len(plan.items) ** 2) * (observers if plan.by_observer else 2)
        most = int(np.clip(MOST_NUMBERS // per_study, 1, MOST_REPLICATES))
        if plan.interval == "bootstrap":
            most = min(most, 10)
        critical = plan.critical_z(observers) if plan.adjust == "maxz" and plan.covariance == "sandwich" else common
        for index, start in enumerate(range(0, replicates, most)):
            found.append(Block(plan, observers, min(most, replicates - start), index, seed, critical))
    return found


def simulate(block: Block) -> Tally:
    """Simulate the studies of a block and count what became of them."""
    plan, random = block.plan, block.random()
    studies = run(plan, block.observers, block.replicates, random)
    fitted = np.asarray(np.isfinite(studies.theta).all(axis=1))
    studies = studies.only(fitted)
    first, second = plan.pairs
    significant = studies.significant(block.critical_z)
    assumed = np.sign(plan.theta[first] - plan.theta[second])
    found = np.sign(studies.theta[:, first] - studies.theta[:, second])
    as_assumed = (assumed == 0) | (found == assumed)
    right, wrong = significant & as_assumed, significant & ~as_assumed
    as_classes = np.where(plan.differs, right, ~significant)
    alike = as_classes.mean(axis=1)
    width = widths(studies, random)
    width = np.column_stack([width, width.mean(axis=1)])
    return Tally(
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
