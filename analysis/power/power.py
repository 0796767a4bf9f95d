"""Power: what studies with so many observers would find, by simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.power.blocks import Tally, blocks_of, simulate
from analysis.power.compute import Done, compute
from analysis.power.plan import Plan, check
from documents import Finding

Floats = NDArray[np.float64]

MOST_OBSERVERS = 100_000
REPLICATES, SEED = 1000, 2016


@dataclass(frozen=True, slots=True, eq=False)
class Power:
    """What K numbers of observers come to, for n items and P pairs i < j in the order of ``numpy.triu_indices``.

    Each value has a Monte-Carlo standard error of its own, in a field that ends with ``_error``.

    Attributes
    ----------
    plan, replicates, seed
        What was simulated, how often per number of observers, and from which seed.
    observers
        The K numbers of observers, ascending.
    separates
        Shape (K, P): chance (0 to 1) that a pair comes out significantly different, the way it was assumed to.
    reversed
        Shape (K, P): chance that it comes out significantly different the other way round.
    recovery
        Shape (K,): chance that the classes are exactly the right ones.
    alike
        Shape (K,): mean share of pairs that share a class, or do not, as they should.
    width
        Shape (K, n): mean width of the interval of log10 score of each item; ``mean_width``, shape (K,): of all.
    separated, unfitted
        Shape (K,): share of the studies that needed Firth's fit, and of those without any fit, which are left out.
    """

    plan: Plan
    replicates: int
    seed: int
    observers: tuple[int, ...]
    separates: Floats
    separates_error: Floats
    reversed: Floats
    recovery: Floats
    recovery_error: Floats
    alike: Floats
    alike_error: Floats
    width: Floats
    width_error: Floats
    mean_width: Floats
    mean_width_error: Floats
    separated: Floats
    unfitted: Floats

    @property
    def pair_names(self) -> tuple[tuple[str, str], ...]:
        """The names of each pair's items."""
        first, second = self.plan.pairs
        items = self.plan.items
        return tuple((items[i], items[j]) for i, j in zip(first.tolist(), second.tolist(), strict=True))

    def to_json(self) -> dict[str, Any]:
        """Return the plan and, for each number of observers, every value with its Monte-Carlo standard error."""
        plan = self.plan
        return {
            "items": [
                {"name": name, "theta": theta} for name, theta in zip(plan.items, plan.theta.tolist(), strict=True)
            ],
            "observer_sd": plan.observer_sd,
            "lapse_rate": plan.lapse_rate,
            "alpha": plan.alpha,
            "adjust": plan.adjust,
            "covariance": plan.covariance,
            "interval": plan.interval,
            "level": plan.level,
            "replicates": self.replicates,
            "seed": self.seed,
            "sizes": [self._size(index) for index in range(len(self.observers))],
        }

    def _size(self, index: int) -> dict[str, Any]:
        pairs = zip(
            self.pair_names,
            self.plan.differs.tolist(),
            self.separates[index].tolist(),
            self.separates_error[index].tolist(),
            self.reversed[index].tolist(),
            strict=True,
        )
        widths = zip(self.plan.items, self.width[index].tolist(), self.width_error[index].tolist(), strict=True)
        return {
            "observers": self.observers[index],
            "class_recovery": float(self.recovery[index]),
            "class_recovery_error": float(self.recovery_error[index]),
            "pairs_alike": float(self.alike[index]),
            "pairs_alike_error": float(self.alike_error[index]),
            "log10_width": _finite(self.mean_width[index]),
            "log10_width_error": _finite(self.mean_width_error[index]),
            "separated": float(self.separated[index]),
            "unfitted": float(self.unfitted[index]),
            "items": [
                {"name": name, "log10_width": _finite(width), "log10_width_error": _finite(error)}
                for name, width, error in widths
            ],
            "pairs": [
                {"items": list(names), "should_differ": should, "separates": p, "separates_error": e, "reversed": r}
                for names, should, p, e, r in pairs
            ],
        }


def power(
    plan: Plan,
    observers: Sequence[int],
    *,
    replicates: int = REPLICATES,
    seed: int = SEED,
    scheduler: str | None = None,
    workers: int | None = None,
    done: Done | None = None,
) -> Power:
    """Simulate ``replicates`` studies with each number of ``observers``.

    The numbers depend on the plan and the seed alone: not on ``scheduler`` or ``workers`` (see
    `analysis.power.compute.compute`), and for one number of observers not on which others are asked for.

    Raises
    ------
    ResultsError
        If the plan or a number is out of range, or no study of some size has a fit.
    ComputeError
        As `analysis.power.compute.compute`.
    """
    check(plan)
    sizes = sorted(set(observers))
    fewest = 2 if plan.covariance == "sandwich" or plan.interval == "bootstrap" else 1
    if not sizes or sizes[0] < fewest or sizes[-1] > MOST_OBSERVERS:
        given = ", ".join(str(size) for size in sizes) or "none"
        remedy = f"give numbers from {fewest} to {MOST_OBSERVERS}"
        raise ResultsError(Finding(f"the numbers of observers are {given}", remedy=remedy))
    if replicates < 2:
        raise ResultsError(Finding(f"{replicates} replicates were asked for", remedy="ask for 1000"))
    blocks = blocks_of(plan, sizes, replicates, seed)
    tallies = compute(simulate, blocks, scheduler=scheduler, workers=workers, done=done)
    by_size = [
        reduce(add, [tally for block, tally in zip(blocks, tallies, strict=True) if block.observers == size])
        for size in sizes
    ]
    for size, tally in zip(sizes, by_size, strict=True):
        if tally.replicates - tally.unfitted < 2:
            raise ResultsError(Finding(f"studies with {size} observers have no fit", remedy="try more observers"))
    return _power(plan, replicates, seed, tuple(sizes), by_size)


def _power(plan: Plan, replicates: int, seed: int, sizes: tuple[int, ...], tallies: Sequence[Tally]) -> Power:
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
    """Return √(p (1 − p) / count), with p drawn in by one study each way: never 0, even for none or all."""
    p = (times + 1) / (count + 2)
    return np.asarray(np.sqrt(p * (1 - p) / (count + 3)))


def _error_of_mean(total: Floats, squares: Floats, count: Floats) -> Floats:
    variance = (squares - total**2 / count) / (count - 1)
    return np.asarray(np.sqrt(np.maximum(variance, 0) / count))


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
