"""What observers are judged by: time against error of the laws of chance, and of fits without each observer.

    python benchmarks/observers.py

The error of a law is that of the chance nearest to 0.05, relative to the exact one; that of the fits is the largest
difference in θ (nats) from fitting one by one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import product
from math import comb
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats

sys.path.insert(0, str(Path(__file__).parent))
from curves import program, row, seconds, sized
from promises import Promise, worst

from analysis.bootstrap.fits import fit_each
from analysis.observers import concordance
from analysis.observers.consistency import circular_triads, triad_chances
from analysis.observers.tails import from_moments
from analysis.scaling.fitting import fit

Row = dict[str, object]

TITLE = "Observers: time against error"
LEVEL = 0.05


def run() -> dict[str, Any]:
    """Measure and return the title and the rows."""
    rows = [*_triads(6), *_triads(10), *_agreement(), *_strangers(), *_left_out()]
    promises = [
        Promise("fits without each observer, batched, error in θ", worst(rows, series="batched"), 1e-10, "error"),
        Promise("verdicts renamed wrongly", worst(rows, series="by rows"), 0, "count", "exactly"),
    ]
    return {"title": TITLE, "rows": rows, "promises": promises}


def _triads(n: int) -> Iterator[Row]:
    case, triads = f"circular triads, n = {n}", comb(n, 3)
    exact = np.cumsum(triad_chances(n))
    at = int(np.abs(exact - LEVEL).argmin())
    chance = float(exact[at])
    time = seconds(lambda: triad_chances.__wrapped__(n))
    yield row(f"{case}: tournaments by their scores", "exact", time, 0.0, "all chances at once, kept for the session")
    if comb(n, 2) <= 15:
        time = seconds(lambda: _one_by_one(n, at), repeats=3)
        yield row(f"{case}: every tournament", "exact", time, abs(_one_by_one(n, at) / chance - 1))
    third = -3 * triads * (n - 4) / 32

    def by_moments() -> float:
        return from_moments(at, 0.5, triads / 4, 3 * triads / 16, third).p

    yield row(f"{case}: χ²", "", seconds(by_moments), abs(by_moments() / chance - 1))
    for draws in sized((1_000, 10_000, 100_000), (1_000,)):
        random = np.random.default_rng(n)
        tossed = np.array([_tossed(n, at, draws, random) for _ in range(10)])
        time = seconds(lambda draws=draws, random=random: _tossed(n, at, draws, random), repeats=3)
        error = float(np.sqrt(np.mean((tossed / chance - 1) ** 2)))
        yield row(f"{case}: simulated", f"{draws} draws", time, error, "root mean square of ten runs")


def _one_by_one(n: int, at: int) -> float:
    signs = np.array(list(product((-1, 1), repeat=comb(n, 2))), dtype=np.int8)
    return float((_counts(n, signs) <= at).mean())


def _tossed(n: int, at: int, draws: int, random: np.random.Generator) -> float:
    signs = random.choice(np.array([-1, 1], dtype=np.int8), (draws, comb(n, 2)))
    return float((_counts(n, signs) <= at).mean())


def _counts(n: int, signs: NDArray[np.int8]) -> Floats:
    first, second = np.triu_indices(n, 1)
    tossed = np.zeros((len(signs), n, n), dtype=np.int8)
    tossed[:, first, second] = signs
    return np.rint(circular_triads(tossed - tossed.transpose(0, 2, 1), ~np.eye(n, dtype=np.bool_)))


def _agreement() -> Iterator[Row]:
    case, k = "agreement u, n = 10, 30 observers", np.full(45, 30)
    exact = np.cumsum(concordance.disagreement_chances(k))
    at = int(np.abs(exact - LEVEL).argmin())
    yield row(f"{case}: exact", "", seconds(lambda: concordance.disagreement_chances(k)), 0.0)
    together = float((k * (k - 1)).sum())

    def by_moments() -> float:
        return from_moments(at, 0.5, together / 4, together / 8, -together * 28 / 8).p

    yield row(f"{case}: χ²", "", seconds(by_moments), abs(by_moments() / float(exact[at]) - 1))


def _strangers() -> Iterator[Row]:
    for n, shuffles in sized(((10, 10_000), (70, 204), (200, 25)), ((10, 100), (70, 3))):
        random = np.random.default_rng(n)
        above = np.triu(random.choice(np.array([-1, 1], dtype=np.int8), (n, n)), 1)
        verdict: NDArray[np.int8] = above - above.T
        order = random.permuted(np.tile(np.arange(n), (shuffles, 1)), axis=1)

        def by_rows(verdict: NDArray[np.int8] = verdict, order: NDArray[np.intp] = order) -> NDArray[np.int8]:
            return concordance._renamed(verdict, order)

        def by_numbers(verdict: NDArray[np.int8] = verdict, order: NDArray[np.intp] = order) -> NDArray[np.int8]:
            renamed: NDArray[np.int8] = verdict[order[:, :, None], order[:, None, :]]
            return renamed

        case, error = f"a million verdicts renamed, n = {n}", float(np.abs(by_rows() - by_numbers()).max())
        yield row(f"{case}: by rows", "", seconds(by_rows), error)
        yield row(f"{case}: number by number", "", seconds(by_numbers), 0.0)


def _left_out() -> Iterator[Row]:
    for n in sized((10, 50), (10,)):
        random = np.random.default_rng(n)
        theta = random.normal(0, 0.7, n)
        p = 1 / (1 + np.exp(theta[None, :] - theta[:, None]))
        upper = np.triu(random.random((30, n, n)) < p, 1)
        own = (upper | np.tril(~upper.transpose(0, 2, 1), -1)).astype(float)
        rest = own.sum(axis=0) - own
        slow = np.array([fit(counts, method="firth").theta for counts in rest])
        error = float(np.abs(fit_each(rest, "firth").theta - slow).max())
        case = f"fits without each of 30 observers, n = {n}"
        yield row(f"{case}: batched", "", seconds(lambda rest=rest: fit_each(rest, "firth")), error)
        time = seconds(lambda rest=rest: [fit(counts, method="firth") for counts in rest], repeats=3)
        yield row(f"{case}: one by one", "", time, 0.0)


if __name__ == "__main__":
    program("observers", run)
