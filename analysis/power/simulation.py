"""The power of studies by simulation, with several numbers of observers.

The unit of work is a block of replicates: simulated from its own seed, counted, and summed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np

from analysis.choices import REPLICATES, SEED
from analysis.errors import ResultsError
from analysis.power.compute import Done, compute
from analysis.power.plan import Plan, check
from analysis.power.results import Power
from analysis.power.studies import run, widths
from documents import Finding, one_blas_thread
from documents.arrays import Floats

MOST_REPLICATES = 250
MOST_NUMBERS = 4_000_000


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
    """Return blocks that fit into memory; their size depends on the plan and the numbers of observers alone."""
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


MOST_OBSERVERS = 100_000


@one_blas_thread()
def simulate_power(
    plan: Plan,
    observers: Sequence[int],
    *,
    replicates: int = REPLICATES,
    seed: int = SEED,
    scheduler: str | None = None,
    workers: int | None = None,
    done: Done | None = None,
    note: Callable[[str], None] | None = None,
) -> Power:
    """Simulate studies with each number of ``observers``.

    The results depend on the plan and the seed alone: not on ``scheduler`` or ``workers`` (see
    `analysis.power.compute.compute`), nor on which other numbers of observers are simulated.

    Parameters
    ----------
    plan
        The design, the assumed scores, and the tests.
    observers
        Numbers of observers to simulate.
    replicates
        Number of simulated studies for each number of observers.
    seed
        Random seed.
    scheduler, workers, done, note
        As for `analysis.power.compute.compute`.

    Returns
    -------
    The power with each number of observers, with Monte-Carlo standard errors.

    Raises
    ------
    ResultsError
        If the plan or a number is out of range, or no study of some size has a fit.
    ComputeError
        As `analysis.power.compute.compute`.

    Examples
    --------
    >>> from analysis.power import differing_pairs
    >>> theta = np.array([1.0, 0.0, -1.0])
    >>> plan = Plan(("a", "b", "c"), theta, times=np.ones(3, dtype=int), differs=differing_pairs(theta))
    >>> power = simulate_power(plan, [10, 40], replicates=200, workers=1)
    >>> power.pair_names[1], bool((power.separates[1] > power.separates[0]).all())
    (('a', 'c'), True)
    """
    check(plan)
    sizes = sorted(set(observers))
    fewest = 2 if plan.interval == "bootstrap" else 1
    if not sizes or sizes[0] < fewest or sizes[-1] > MOST_OBSERVERS:
        given = ", ".join(str(size) for size in sizes) or "none"
        remedy = f"give numbers from {fewest} to {MOST_OBSERVERS}"
        raise ResultsError(Finding(f"the numbers of observers are {given}", remedy=remedy))
    if replicates < 2:
        raise ResultsError(Finding(f"{replicates} replicates were asked for", remedy="ask for 1000"))
    blocks = blocks_of(plan, sizes, replicates, seed)
    tallies = compute(simulate, blocks, scheduler=scheduler, workers=workers, done=done, note=note)
    by_size = [
        reduce(add, [tally for block, tally in zip(blocks, tallies, strict=True) if block.observers == size])
        for size in sizes
    ]
    for size, tally in zip(sizes, by_size, strict=True):
        if tally.replicates - tally.unfitted < 2:
            raise ResultsError(Finding(f"studies with {size} observers have no fit", remedy="try more observers"))
    return _power(plan, replicates, seed, tuple(sizes), by_size)


def _power(plan: Plan, replicates: int, seed: int, sizes: tuple[int, ...], tallies: Sequence[StudyTally]) -> Power:
    fitted = np.array([[tally.replicates - tally.unfitted] for tally in tallies], dtype=np.float64)
    count = fitted[:, 0]
    right = np.array([tally.right for tally in tallies])
    recovered = np.array([tally.recovered for tally in tallies], dtype=np.float64)
    alike, alike_squares = (np.array([getattr(t, name) for t in tallies]) for name in ("alike", "alike_squares"))
    width, width_squares = (np.array([getattr(t, name) for t in tallies]) for name in ("width", "width_squares"))
    widths, width_errors = width / fitted, _error_of_mean(width, width_squares, fitted)
    return Power(
        plan=plan,
        replicates=replicates,
        seed=seed,
        observers=sizes,
        separates=right / fitted,
        separates_error=_error_of_share(right, fitted),
        reversed=np.array([tally.wrong for tally in tallies]) / fitted,
        recovery=recovered / count,
        recovery_error=_error_of_share(recovered, count),
        alike=alike / count,
        alike_error=_error_of_mean(alike, alike_squares, count),
        width=widths[:, :-1],
        width_error=width_errors[:, :-1],
        mean_width=widths[:, -1],
        mean_width_error=width_errors[:, -1],
        separated=np.array([tally.separated for tally in tallies]) / count,
        unfitted=np.array([tally.unfitted / tally.replicates for tally in tallies]),
    )


def _error_of_share(times: Floats, count: Floats) -> Floats:
    """Return √(p (1 − p) / count), with a success and a failure added: never 0, even for none or all."""
    p = (times + 1) / (count + 2)
    return np.asarray(np.sqrt(p * (1 - p) / (count + 3)))


def _error_of_mean(total: Floats, squares: Floats, count: Floats) -> Floats:
    variance = (squares - total**2 / count) / (count - 1)
    return np.asarray(np.sqrt(np.maximum(variance, 0) / count))
