"""Power by simulation: run time against error, a block of studies at a time beside the same studies one by one.

    python benchmarks/power.py

The error is the root mean square, over the 45 pairs of ten stimuli with the thesis's scores and 30 observers, of the
power, against 40,000 studies from another seed: with observers who do not differ and the model's covariance; and,
against 10,000, as a report analyses observers who differ by 0.7 nats, a block at a time and by `estimate_scores`
itself. Of the smallest difference that a design finds in 80 % of studies, the error is how far from 80 % the share of
studies is that find it, from other seeds: many in blocks, and some analysed by `estimate_scores`. The last rows have no
error: they time whole jobs, in this process and in two.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from documents.arrays import Floats

sys.path.insert(0, str(Path(__file__).parent))
from curves import program, row, seconds, sized, times_faster
from promises import Promise, worst
from simulated_studies import Design

from analysis.choices import TARGET
from analysis.classes.classes import classify
from analysis.comparisons.comparisons import Answer, from_answers
from analysis.report.estimate import estimate_scores
from analysis.scaling.fitting import fit
from analysis.scaling.laws import probabilities
from analysis.simulation import TYPICAL_SD, Plan, SmallestDifference, smallest_difference
from extensions.power import differing_pairs, simulate_power, spread_theta

Row = dict[str, object]

TITLE = "Power by simulation: time against error"
# Medina 2016, Table 4.4.
PRINTED = np.array([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])
OBSERVERS, SIZES = 30, tuple(range(10, 61, 5))
REFERENCE, REFERENCE_SEED = sized(40_000, 100), 1
OBSERVER_SD, FEWER = 0.7, sized(10_000, 50)
SMALLEST = "smallest difference"
ARRANGED, TRIED = sized(((6, 15), (6, 30), (10, 15), (10, 30)), ((4, 20),)), np.geomspace(0.6, 4.6, 16)
ARRANGEMENTS: dict[str, tuple[Callable[[int], Floats], bool]] = {
    "all others midway": (lambda n: np.r_[0.5, -0.5, np.zeros(n - 2)], False),
    "one above all others": (lambda n: np.r_[1.0, np.zeros(n - 1)], False),
    "two groups that are equal inside": (lambda n: (np.arange(n) < n // 2).astype(np.float64), False),
    "equal steps: neighbours": (lambda n: -np.arange(n, dtype=np.float64), True),
}
DESIGNS = sized(((6, 15), (6, 30), (10, 10)), ((4, 20),))  # stimuli and observers, all pairs once


def plan(theta: Floats, **fields: Any) -> Plan:
    """Return a plan of all pairs, each once."""
    theta = theta - theta.mean()
    names = tuple(f"item {item}" for item in range(len(theta)))
    return Plan(
        names, theta, np.ones(len(theta) * (len(theta) - 1) // 2, dtype=np.int64), differing_pairs(theta), **fields
    )


def one_by_one(design: Plan, observers: int, replicates: int) -> Floats:
    """Return the chance that each pair separates, study after study: the plain way."""
    random = np.random.default_rng(5)
    n, p = len(design.theta), probabilities(design.theta)
    first, second = design.pairs
    times = np.zeros(len(first))
    for _ in range(replicates):
        wins = np.zeros((n, n))
        for one, other in zip(first.tolist(), second.tolist(), strict=True):
            won = random.binomial(observers, p[one, other])
            wins[one, other], wins[other, one] = won, observers - won
        estimate = fit(wins)
        if estimate.separated:
            estimate = fit(wins, method="firth")
        classes = classify(estimate.theta, estimate.covariance, alpha=design.alpha, adjust=design.adjust)
        ahead = np.sign(estimate.theta[first] - estimate.theta[second])
        right = ahead == np.sign(design.theta[first] - design.theta[second])
        times += (classes.p[first, second] <= design.alpha) & right
    return times / replicates


def by_report(design: Plan, observers: int, replicates: int) -> Floats:
    """Return the chance that each pair separates, each study simulated and analysed as the report does."""
    first, second = design.pairs
    times = np.zeros(len(first))
    for counts in Design(design.typical, observers, design.observer_sd).studies(replicates, seed=5):
        answers = [
            Answer(design.items[one], design.items[other], count, str(person))
            for (person, one, other), count in np.ndenumerate(counts)
            if count
        ]
        comparisons = from_answers(answers, design.items)
        found = estimate_scores(comparisons, alpha=design.alpha, adjust=design.adjust, draw=False).scores
        assert found.classes is not None
        ahead = np.sign(found.fit.theta[first] - found.fit.theta[second])
        right = ahead == np.sign(design.theta[first] - design.theta[second])
        times += (found.classes.pair_p <= design.alpha) & right
    return times / replicates


def run() -> dict[str, Any]:
    """Measure and return the rows and the ratio."""
    many = sized(200, 10)
    design = plan(np.log(PRINTED), covariance="model")
    truth = simulate_power(design, [OBSERVERS], replicates=REFERENCE, seed=REFERENCE_SEED, workers=1).separates[0]
    ratio = times_faster(
        lambda: simulate_power(design, [OBSERVERS], replicates=many, workers=1),
        lambda: one_by_one(design, OBSERVERS, many),
        rounds=5,
    )
    smallest = [row for n, observers in DESIGNS for row in _smallest(n, observers)]
    rows = [*_curves(design, truth), *_as_the_report(), *smallest, *_by_arrangement(sized(400, 10)), *_jobs(design)]
    off = worst(rows, series=f"{SMALLEST}, as check has it")
    # Three standard errors of 200 studies, of which the difference is, and of those that judge it.
    promises = [
        Promise("1000 studies in blocks beside one by one", ratio, None, "ratio", "at least", "×"),
        Promise("share of studies that find the smallest difference, off 80 %", off, 0.09, "share"),
    ]
    return {"title": TITLE, "rows": rows, "promises": promises}


def _curves(design: Plan, truth: Floats) -> Iterator[Row]:
    for replicates in sized((100, 300, 1000, 3000, 10_000), (100,)):
        estimate = simulate_power(design, [OBSERVERS], replicates=replicates, workers=1)
        reported = float(np.sqrt((estimate.separates_error**2).mean()))
        time = seconds(lambda r=replicates: simulate_power(design, [OBSERVERS], replicates=r, workers=1), repeats=3)
        note = f"reported standard error: {reported:.2g}"
        yield row("in blocks", f"{replicates} studies", time, _error(estimate.separates[0], truth), note)
    for replicates in sized((30, 100, 300), (10,)):
        began = perf_counter()
        slow_estimate = one_by_one(design, OBSERVERS, replicates)
        time = perf_counter() - began
        yield row("one by one", f"{replicates} studies", time, _error(slow_estimate, truth))


def _as_the_report() -> Iterator[Row]:
    design = plan(np.log(PRINTED), observer_sd=OBSERVER_SD, scores_of="average")
    truth = simulate_power(design, [OBSERVERS], replicates=FEWER, seed=REFERENCE_SEED, workers=1).separates[0]
    for replicates in sized((100, 300, 1000), (50,)):
        estimate = simulate_power(design, [OBSERVERS], replicates=replicates, workers=1)
        reported = float(np.sqrt((estimate.separates_error**2).mean()))
        time = seconds(lambda r=replicates: simulate_power(design, [OBSERVERS], replicates=r, workers=1), repeats=3)
        note = f"reported standard error: {reported:.2g}"
        yield row("as the report, in blocks", f"{replicates} studies", time, _error(estimate.separates[0], truth), note)
    for replicates in sized((30, 100), (3,)):
        began = perf_counter()
        slow_estimate = by_report(design, OBSERVERS, replicates)
        time = perf_counter() - began
        yield row("as the report, one by one", f"{replicates} studies", time, _error(slow_estimate, truth))


def _smallest(n: int, observers: int) -> Iterator[Row]:
    """The smallest difference that a design finds, beside studies simulated at it."""
    began = perf_counter()
    found = smallest_difference(np.ones(n * (n - 1) // 2, dtype=np.int64), observers)
    time = perf_counter() - began
    assert found is not None
    assert found.nats is not None
    job = f"{n} stimuli, {observers} observers"
    many, some = sized(4000, 100), sized(300, 3)
    design = plan(found.nats / 2 * np.r_[1.0, -1.0, np.zeros(n - 2)], observer_sd=TYPICAL_SD, scores_of="average")
    began = perf_counter()
    power = simulate_power(design, [observers], replicates=many, seed=REFERENCE_SEED, workers=1)
    direct, error = float(power.separates[0, 0]), float(power.separates_error[0, 0])
    in_blocks = perf_counter() - began
    began = perf_counter()
    share = float(by_report(design, observers, some)[0])
    one_by_one_s = perf_counter() - began
    yield row(f"{SMALLEST}, as check has it", job, time, abs(direct - found.target), _found(found, direct))
    yield row(f"studies at it, {many} in blocks", job, in_blocks, error, "its standard error")
    off = f"by the report's own analysis: {100 * share:.0f} %"
    yield row(f"studies at it, {some} one by one", job, one_by_one_s, abs(share - found.target), off)


def _by_arrangement(studies: int) -> Iterator[Row]:
    """The difference that 80 % of studies find, where the stimuli lie otherwise than `smallest_difference` has them."""
    for (n, observers), (name, (theta, neighbours)) in product(ARRANGED, ARRANGEMENTS.items()):
        unit = theta(n)
        first, second = np.triu_indices(n, 1)
        apart = np.abs(unit[first] - unit[second])
        asked = apart == (apart.min() if neighbours else apart.max())
        began, last, found = perf_counter(), (0.0, 0.0), float("nan")
        for nats in TRIED:
            design = plan(nats * unit, observer_sd=TYPICAL_SD, scores_of="average")
            chance = simulate_power(design, [observers], replicates=studies, workers=1).separates[0][asked].mean()
            if chance >= TARGET:
                found = float(np.interp(TARGET, (last[1], chance), (last[0], nats)))
                break
            last = nats, float(chance)
        most = "" if np.isfinite(found) else f", {100 * last[1]:.0f} % at most"
        job, time = f"{n} stimuli, {observers} observers, {name}", perf_counter() - began
        yield row(f"{SMALLEST} by arrangement, {studies} studies", job, time, None, f"{found:.2f} nats{most}")


def _found(found: SmallestDifference, share: float) -> str:
    return f"{found.nats:.3g} nats, standard error {found.error_nats:.1g}: {100 * share:.1f} % of studies find it"


def _jobs(design: Plan) -> Iterator[Row]:
    theta = np.log(PRINTED)
    whole = "10 to 60 observers by 5, 1000 studies each"
    jobs = {
        f"ten stimuli, {whole}": (design, SIZES, 1000),
        f"ten stimuli, observers differ, as the report, {whole}": (
            plan(theta, observer_sd=OBSERVER_SD, scores_of="average"),
            SIZES,
            1000,
        ),
        "ten stimuli, 30 observers, bootstrap intervals, 200 studies": (
            plan(theta, interval="bootstrap", covariance="model"),
            (30,),
            200,
        ),
        "60 stimuli, 30 observers, 1000 studies": (plan(spread_theta(60, 3), covariance="model"), (30,), 1000),
    }
    for job, (wanted, sizes, replicates) in [*jobs.items()][:: sized(1, 10)]:
        replicates = sized(replicates, 20)
        for workers in sized((1, 2), (1,)):
            began = perf_counter()
            simulate_power(wanted, sizes, replicates=replicates, workers=workers)
            where = "this process" if workers == 1 else "two processes, their start included"
            yield row(job, where, perf_counter() - began, None)


def _error(estimate: Floats, truth: Floats) -> float:
    return float(np.sqrt(((estimate - truth) ** 2).mean()))


if __name__ == "__main__":
    program("power", run)
