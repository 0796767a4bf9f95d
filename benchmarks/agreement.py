"""Measures and observers: how often intervals contain the truth, how often noise is said to agree, and the time.

    python benchmarks/agreement.py [STUDIES]

Each simulated study has observers of strengths of their own (0.5 nats about the common ones) who compare all pairs of n
stimuli once, and a measure whose true correlation with what endless such observers would say is known. The error is the
distance of the share of 95 % intervals that contain the truth from 0.95, or of a test's false alarms from 0.05. Beside
ours are percentiles and BCa of the same bootstrap, and SciPy's intervals, which take the stimuli for a sample.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from documents.arrays import Floats

sys.path.insert(0, str(Path(__file__).parent))
from curves import in_two_processes, numbers, program, row, seconds, sized
from promises import Promise, times_as_fast, worst
from simulated_studies import Design, as_comparisons

from analysis.bootstrap import tails
from extensions.agreement import KINDS, ObservedGroup, Predicted, agree, correlation, correlation_interval
from extensions.agreement.observed import of_comparisons

Row = dict[str, object]

TITLE = "Measures and observers: time against distance of the coverage from 0.95"
OBSERVERS = sized((5, 10, 15, 30), (5,))
STIMULI = sized((4, 6, 10), (4,))
TRUTHS = sized((0.0, 0.8, 0.95, 1.0), (0.8,))
OBSERVER_SD = 0.5
STIMULUS_SETS = 4
SPREAD = 1.0  # standard deviation of the stimuli's strengths, in nats


def run(studies: int = sized(8, 2)) -> dict[str, Any]:
    """Simulate, and return the title and the rows."""
    cells = [(people, n, truth, studies) for people in OBSERVERS for n in STIMULI for truth in TRUTHS]
    rows = [*_times()]
    for cell, found in zip(cells, in_two_processes(_covered, cells), strict=True):
        rows += _coverage_rows(cell, found)
    groups = [(people, studies) for people in OBSERVERS]
    for people, found in zip(OBSERVERS, in_two_processes(_decided, groups), strict=True):
        rows += _decision_rows(people, found, studies)
    at_once = [times_as_fast(rows, f"1000 correlations at once, {k}", f"SciPy, one by one, {k}") for k in KINDS]
    promises = [
        Promise("1000 correlations at once against SciPy", worst(rows, series="correlations at once"), 1e-12, "error"),
        Promise("1000 correlations beside SciPy's, one by one", min(at_once), 50.0, "ratio", "at least", "×"),
    ]
    return {"title": TITLE, "rows": rows, "promises": promises}


def simulated(
    people: int, n: int, truth: float, seed: int, stimuli: int | None = None
) -> tuple[ObservedGroup, Floats, Floats]:
    """Return a study's group, its measure (larger for better), and what endless observers would say.

    Studies of one ``stimuli`` differ in their observers alone; without it, each has stimuli of its own.
    """
    random = np.random.default_rng([seed if stimuli is None else stimuli, n])
    theta = random.normal(size=n)
    theta = SPREAD * (theta - theta.mean()) / theta.std()
    design = Design(theta, people, OBSERVER_SD)
    said = design.truth()
    along = (said - said.mean()) / np.linalg.norm(said - said.mean())
    other = random.normal(size=n)
    other -= other.mean()
    other -= (other @ along) * along
    measure = truth * along + np.sqrt(1 - truth**2) * other / np.linalg.norm(other)
    counts = next(design.studies(1, seed))
    group = of_comparisons("", as_comparisons(counts), OPTIONS)
    assert not isinstance(group, str)
    return group, measure, said


OPTIONS: Any = {"alpha": 0.05, "adjust": "holm", "covariance": "auto", "chosen": False}


def _percentiles(group: ObservedGroup, measure: Floats, kind: Any) -> tuple[float, float]:
    assert group.drawn is not None
    tail = np.array([tails.widened(0.025, group.observers)])
    values = np.sort(correlation(group.drawn.scores, measure, kind))[:, None]
    return float(tails.lower(values, tail, 0)[0]), float(tails.upper(values, 1 - tail, 0)[0])


def _bias_corrected(group: ObservedGroup, measure: Floats, kind: Any) -> tuple[float, float]:
    """Percentiles corrected for bias, without acceleration: nothing here leaves observers out one by one."""
    assert group.drawn is not None
    values = correlation(group.drawn.scores, measure, kind)
    estimate = float(correlation(group.scores, measure, kind))
    share = np.array([np.clip((values < estimate).mean(), 0.5 / len(values), 1 - 0.5 / len(values))])
    tail = tails.widened(0.025, group.observers)
    ends = [tails.bias_corrected(level, share, np.zeros(1)) for level in (tail, 1 - tail)]
    ordered = np.sort(values)[:, None]
    return float(tails.lower(ordered, ends[0], 0)[0]), float(tails.upper(ordered, ends[1], 0)[0])


def _inverted(group: ObservedGroup, measure: Floats, kind: Any) -> tuple[float, float]:
    assert group.drawn is not None
    return correlation_interval(group.scores, group.drawn.errors, group.observers, measure, kind)


def _scipy_z(group: ObservedGroup, measure: Floats, kind: Any) -> tuple[float, float]:
    ends = stats.pearsonr(group.scores, measure).confidence_interval(0.95)
    return float(ends.low), float(ends.high)


def _scipy_bootstrap(group: ObservedGroup, measure: Floats, kind: Any) -> tuple[float, float]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a draw with one stimulus alone
        drawn = stats.bootstrap(
            (group.scores, measure),
            lambda x, y, axis=-1: stats.pearsonr(x, y, axis=axis).statistic,
            paired=True,
            vectorized=True,
            n_resamples=1000,
            method="percentile",
            rng=1,
        )
    return float(drawn.confidence_interval.low), float(drawn.confidence_interval.high)


WAYS: dict[str, tuple[Any, tuple[str, ...]]] = {
    "inverted test (ours)": (_inverted, KINDS),
    "percentile": (_percentiles, KINDS),
    "bias-corrected": (_bias_corrected, KINDS),
    "SciPy pearsonr, Fisher z over stimuli": (_scipy_z, ("pearson",)),
    "SciPy bootstrap over stimuli": (_scipy_bootstrap, ("pearson",)),
}


def _covered(cell: tuple[int, int, float, int]) -> dict[tuple[str, str], Floats]:
    """Return for each way and correlation, of each study: below, above, width."""
    people, n, truth, studies = cell
    found: dict[tuple[str, str], list[tuple[float, float, float]]] = {}
    for seed in range(studies):
        group, measure, said = simulated(people, n, truth, seed)
        for way, (interval, kinds) in WAYS.items():
            for kind in kinds:
                true = float(correlation(said, measure, kind))  # type: ignore[arg-type]
                low, high = interval(group, measure, kind)
                found.setdefault((way, kind), []).append((low > true + 1e-9, high < true - 1e-9, high - low))
    return {key: np.array(rows, dtype=np.float64) for key, rows in found.items()}


def _coverage_rows(cell: tuple[int, int, float, int], found: dict[tuple[str, str], Floats]) -> Iterator[Row]:
    people, n, truth, studies = cell
    for (way, kind), rows in found.items():
        sound = np.isfinite(rows[:, 2])
        above, below = (100 * np.where(sound, rows[:, side], 0.0).mean() for side in (0, 1))
        covered = float(sound.mean()) - (above + below) / 100
        width = float(np.median(rows[sound, 2])) if sound.any() else np.inf
        none = "" if sound.all() else f", {100 * (1 - sound.mean()):.0f} % have no interval"
        yield row(
            f"{way}, {kind}",
            f"{people} observers, {n} stimuli, true r {truth:g}",
            None,
            abs(covered - 0.95),
            note=f"{studies} studies: {100 * covered:.0f} % contain the truth, {above:.0f} % lie above and "
            f"{below:.0f} % below it{none}; median width {width:.2f}",
            covered=covered,
        )


def _decided(cell: tuple[int, int]) -> dict[str, Floats]:
    """Return, of each study of nine stimuli and a photograph, what was said of noise and of a perfect measure."""
    people, studies = cell
    found: dict[str, list[Any]] = {"noise": [], "perfect": [], "pairs": [], "area": [], "limit": []}
    for seed in range(studies):
        stimuli = seed % STIMULUS_SETS
        group, measure, said = simulated(people, 10, 0.8, seed, stimuli)
        best = group.stimuli[int(np.argmax(said))]
        noise = np.random.default_rng(seed).normal(size=10)
        values = (("noise", noise), ("perfect", said), ("near", measure))
        predicted = [Predicted(name, name, "", "higher", (value,)) for name, value in values]
        for one in predicted[:2]:
            found[one.name].append(agree([group], [best], [one]).measures[0].decision == "agrees")
        near = agree([group], [best], [predicted[2]]).measures[0].whole
        pairs, limits = near.accuracy, near.calibration
        if pairs.share is not None and pairs.low is not None:
            found["pairs"].append((stimuli, pairs.share, pairs.low, pairs.high))
        if limits is not None and limits.area is not None and limits.area_low is not None:
            found["area"].append((stimuli, limits.area, limits.area_low, limits.area_high))
            found["limit"].append((stimuli, limits.best, limits.best_low, limits.best_high))
    return {name: np.array(rows, dtype=np.float64) for name, rows in found.items()}


def _decision_rows(people: int, found: dict[str, Floats], studies: int) -> Iterator[Row]:
    parameter = f"{people} observers, 9 stimuli and a photograph"
    for name, wanted in (("noise", 0.05), ("perfect", 1.0)):
        share = float(found[name].mean())
        yield row(
            f"{name} said to agree",
            parameter,
            None,
            abs(share - wanted),
            note=f"{studies} studies: {100 * share:.1f} %",
            share=share,
        )
    for name, words in (
        ("pairs", "share of pairs in order"),
        ("area", "area under the curve"),
        ("limit", "limit that agrees best"),
    ):
        rows = found[name]
        if len(rows) < 2:
            continue
        # Of each set of stimuli, what its studies have on average.
        truth = np.array([rows[rows[:, 0] == stimuli, 1].mean() for stimuli in rows[:, 0]])
        covered = float(((rows[:, 2] <= truth + 1e-9) & (truth <= rows[:, 3] + 1e-9)).mean())
        yield row(
            f"percentile, {words}",
            parameter,
            None,
            abs(covered - 0.95),
            note=f"{len(rows)} of {studies} studies have one: {100 * covered:.0f} % contain the mean of such",
            covered=covered,
        )


def _times() -> Iterator[Row]:
    group, measure, _ = simulated(15, 10, 0.8, 1)
    assert group.drawn is not None
    for way, (interval, kinds) in WAYS.items():
        for kind in kinds:
            yield row(
                f"{way}, {kind}",
                "time of one interval: 15 observers, 10 stimuli, 1000 draws",
                seconds(lambda interval=interval, kind=kind: interval(group, measure, kind), repeats=3),
                note="",
            )
    scores = np.random.default_rng(1).normal(size=(sized(1000, 20), 10))
    peers = {"pearson": stats.pearsonr, "spearman": stats.spearmanr, "kendall": stats.kendalltau}
    for kind, peer in peers.items():
        yield from _one_by_one(scores, measure, kind, peer)


def _one_by_one(scores: Floats, measure: Floats, kind: Any, peer: Any) -> Iterator[Row]:
    def ours() -> Floats:
        return correlation(scores, measure, kind)

    def theirs() -> Floats:
        return np.array([peer(row, measure)[0] for row in scores])

    error = float(np.abs(ours() - theirs()).max())
    for series, work in ((f"1000 correlations at once, {kind}", ours), (f"SciPy, one by one, {kind}", theirs)):
        yield row(series, "10 stimuli", seconds(work, repeats=3), error, note="largest difference between the two")


if __name__ == "__main__":
    program("agreement", lambda: run(*numbers()))
