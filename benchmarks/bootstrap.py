"""Run time against Monte Carlo error of bootstrap intervals: more draws, and scipy's bootstrap of the same fit beside.

    python benchmarks/bootstrap.py

The error is the root mean square distance of the ends of ten items' 95 % intervals of θ from those of 30,000 draws,
as a share of the intervals' mean width, over five seeds.
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from documents.arrays import Floats

sys.path.insert(0, str(Path(__file__).parent))
from curves import program, row, seconds, sized
from promises import Promise, times_as_fast, worst
from simulated_studies import Design

from analysis.bootstrap.confidence_intervals import Kind, intervals
from analysis.bootstrap.replicates import Replicates, resample_counts
from analysis.classes.multiplicity import ADJUSTMENTS
from analysis.scaling.fitting import fit

Row = dict[str, object]

TITLE = "Bootstrap over observers: time against Monte Carlo error"
# Medina 2016, Table 4.4.
PRINTED = np.array([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])
OBSERVERS = 30
NAMES = tuple(f"{number:02d}" for number in range(sized(100, 30)))
KINDS: tuple[Kind, ...] = ("expanded-bca", "bca", "percentile", "studentised")
MANY = sized(30_000, 1000)


def run() -> dict[str, Any]:
    """Measure and return the title and the rows."""
    (counts,) = Design(np.log(PRINTED), OBSERVERS, 0.7).studies(1, seed=7)
    rows = [*_ours(counts), *_scipy(counts), *_stability(counts), _large()]
    draws = f"{sized(1000, 40)} draws"
    ratio = times_as_fast([row for row in rows if row["parameter"] == draws], "bca", "scipy.stats.bootstrap, bca")
    promises = [
        Promise("1000 draws beside scipy.stats.bootstrap of the same fit", ratio, 5.0, "ratio", "at least", "×"),
        Promise(
            "scatter of the ends of an interval from 1000 draws, a share of its width",
            worst(rows, series="expanded-bca", parameter=draws),
            0.04,
            "share",
        ),
    ]
    return {"title": TITLE, "rows": rows, "promises": promises}


def _ours(counts: Floats) -> Iterator[Row]:
    exact = _drawn(counts, MANY, 1)
    for kind in KINDS:
        truth = _ends(exact, kind)
        for replicates in sized((100, 300, 1000, 3000, 10_000), (40,)):
            found = [_ends(_drawn(counts, replicates, seed), kind) for seed in range(sized(5, 1))]
            time = seconds(lambda r=replicates, k=kind: _ends(_drawn(counts, r, 0), k), repeats=3)
            yield row(kind, f"{replicates} draws", time, _error(found, truth))


def _scipy(counts: Floats) -> Iterator[Row]:
    """Bootstrap the same fit by `scipy.stats.bootstrap`, one draw at a time; its BCa, which is not widened."""
    people = np.arange(float(OBSERVERS))
    truth = _ends(_drawn(counts, MANY, 1), "bca")

    def theta(drawn: Floats) -> Floats:
        return fit(counts[drawn.astype(int)].sum(axis=0)).theta

    def ends(replicates: int, seed: int) -> Floats:
        found = stats.bootstrap((people,), theta, n_resamples=replicates, vectorized=False, rng=seed, method="BCa")
        return np.stack([found.confidence_interval.low, found.confidence_interval.high])

    for replicates in sized((100, 1000), (40,)):
        time = seconds(lambda r=replicates: ends(r, 0), repeats=1, at_least_s=0)
        found = [ends(replicates, seed) for seed in range(5 if 40 < replicates < 1000 else 1)]
        yield row("scipy.stats.bootstrap, bca", f"{replicates} draws", time, _error(found, truth), "the same fit")


def _stability(counts: Floats) -> Iterator[Row]:
    from analysis.bootstrap.stability import class_stability

    drawn = _drawn(counts, sized(1000, 50), 0)
    for adjust in ADJUSTMENTS:
        repeats = 1 if adjust == "maxz" else 3
        time = seconds(lambda adjust=adjust: class_stability(drawn, adjust=adjust), repeats=repeats, at_least_s=0)
        yield row("class stability", f"1000 draws, {adjust}", time, None, "draws not counted")


def _large() -> Row:
    (counts,) = Design(np.random.default_rng(1).normal(0, 0.7, len(NAMES)), OBSERVERS).studies(1, 1)
    time = seconds(lambda: resample_counts(counts, NAMES, NAMES[:OBSERVERS]), repeats=1, at_least_s=0)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return row(f"{len(NAMES)} items", "1000 draws", time, None, f"the process's peak memory {peak:.0f} MB")


def _drawn(counts: Floats, replicates: int, seed: int) -> Replicates:
    return resample_counts(counts, NAMES[: len(PRINTED)], NAMES[:OBSERVERS], replicates=replicates, seed=seed)


def _ends(drawn: Replicates, kind: Kind) -> Floats:
    found = intervals(drawn, kind=kind)
    return np.stack([found.low, found.high])


def _error(found: list[Floats], truth: Floats) -> float:
    width = float((truth[1] - truth[0]).mean())
    return float(np.sqrt(np.mean([(ends - truth) ** 2 for ends in found]))) / width


if __name__ == "__main__":
    program("bootstrap", run)
