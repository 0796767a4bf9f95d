"""How often intervals contain the truth, tests report a false difference and find a true one, and the time of each.

    python benchmarks/interval_coverage.py [STUDIES]

Time is for all values of one study with 1000 replicates; the draws, which the kinds share, are counted in each. The
error is the distance of the share of 95 % intervals that contain the truth from 0.95.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from curves import in_two_processes, numbers, program, row, seconds, sized
from promises import Promise
from simulated_studies import Coverage, Decisions, Design, coverage, decisions

from analysis.bootstrap.confidence_intervals import KINDS, Kind, intervals
from analysis.bootstrap.replicates import NAMES, resample_counts
from analysis.choices import CovarianceChoice
from analysis.scaling.laws import Model

Row = dict[str, object]

TITLE = "95 % intervals: time against distance of their coverage from 0.95"
# Medina 2016, Table 4.4.
PRINTED = np.array([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])
THETA = np.log(PRINTED) - np.log(PRINTED).mean()
FAR = THETA + 2.5 * (np.arange(10) == np.argmax(THETA))
DESIGNS = {
    "30 observers, alike": Design(THETA, 30),
    "30 observers, each their own (0.7 nats)": Design(THETA, 30, 0.7),
    "15 observers, alike": Design(THETA, 15),
    "15 observers, each their own (0.7 nats)": Design(THETA, 15, 0.7),
    "15 observers, each their own (1 nat), strengths 2.5 x as far apart": Design(2.5 * THETA, 15, 1.0),
    "15 observers, alike, one item far above": Design(FAR - FAR.mean(), 15),
}
HALVES = np.r_[np.ones(5), -np.ones(5)] / 2
OBSERVERS = sized((5, 10, 15, 30), (5,))
POPULATIONS: dict[str, dict[str, Any]] = {
    "alike": {},
    "each their own (0.7 nats)": {"observer_sd": 0.7},
    "each their own (1.5 nats)": {"observer_sd": 1.5},
    "divided about two items (1.5 nats)": {"observer_sd": np.r_[1.5, 1.5, np.zeros(8)]},
    "two camps, 1 nat either way": {"camps": 2 * HALVES},
    "two camps, 0.5 nats either way": {"camps": HALVES},
}
PAIRS: dict[str, Any] = {"all pairs": 1.0, "20 to 100 % of the pairs": (0.2, 1.0)}
# Scales whose ends are up to 10 nats apart: (step in nats, items).
LADDERS = sized(((0.25, 6), (0.5, 6), (1.0, 6), (2.0, 6), (4.0, 3)), ((2.0, 4),))
CLIMBERS = sized((5, 8, 10, 15, 30), (5,))
LADDER_POPULATIONS = ("alike", "each their own (0.7 nats)", "each their own (1.5 nats)", "two camps, 1 nat either way")
# Law, its parameter, and what being shown first adds; 0 without an order effect.
BY_LAW: tuple[tuple[Model, float, float], ...] = (
    ("thurstone", 0.0, 0.0),
    ("bradley-terry", 0.0, 0.5),
    ("davidson", 0.0, 0.0),
    ("rao-kupper", 0.4, 0.0),
)
COVARIANCES: tuple[CovarianceChoice, ...] = ("auto", "model", "scaled", "sandwich")


def run(studies: int = sized(300, 4)) -> dict[str, Any]:
    """Simulate and return the title and the rows.

    There are a tenth as many studies where a bootstrap is drawn, and a thirtieth for the studentised one.
    """
    times = _times()
    quick: list[Kind] = [kind for kind in KINDS if kind != "studentised"]
    rows: list[Row] = []
    for name, design in [*DESIGNS.items()][: sized(None, 1)]:
        rows += _covered(
            name, coverage(design, quick, NAMES, studies=max(2, studies // 10), replicates=sized(1000, 100)), times
        )
        slow = coverage(
            design, ["studentised"], ["difference"], studies=max(2, studies // 30), replicates=sized(1000, 100)
        )
        rows += _covered(name, slow, times)
    decided, climbed = [*_decided(studies)], [*_climbed(studies)]
    rows += [*decided, *climbed, *_at_the_edge(studies), *_by_law(studies)]
    return {"title": TITLE, "rows": rows, "promises": _promises(decided, climbed)}


def _promises(decided: list[Row], climbed: list[Row]) -> list[Promise]:
    """Return what is promised of the default, over all its populations and designs; see `_beyond`."""
    default: list[Any] = [row for row in decided if row["series"] == "classes, holm, auto"]
    false = max(_beyond(row["false_difference"], row["studies"]) for row in default)
    least = min(1 - _beyond(1 - row["covered"], row["studies"]) for row in default)
    most = max(_beyond(row["covered"], row["studies"]) for row in default)
    beyond = "two standard errors off the worst of all designs"
    return [
        Promise(f"share of studies with a false difference, {beyond}", false, 0.055, "share"),
        Promise(f"share of 95 % intervals that contain the truth, {beyond}", least, 0.93, "share", "at least"),
        Promise(f"the largest such share, {beyond}", most, 0.97, "share"),
        Promise(
            "true differences found by signs less those by the default, worst ladder", _behind(climbed), 0, "share"
        ),
    ]


def _behind(climbed: list[Row]) -> float:
    """Return how much larger a share of true differences the signs of answers find than the default, at most."""
    rows: list[Any] = [row for row in climbed if row["separated"] is not None]
    return float(max(row["direct"] - row["separated"] for row in rows))


def _beyond(share: float, studies: int) -> float:
    """Return what a share of simulated studies is beyond doubt: itself, less two standard errors of so many studies."""
    return float(max(0.0, share - 2 * np.sqrt(share * (1 - share) / studies)))


def _decided(studies: int) -> Iterator[Row]:
    """Yield what classes and intervals of each covariance did, over observers, populations and designs."""
    cells: list[tuple[str, str, Design, CovarianceChoice, int]] = []
    few = max(2, studies // 4)
    for people in OBSERVERS:
        for population, fields in [*POPULATIONS.items()][: sized(None, 1)]:
            for pairs, share in PAIRS.items():
                equal = Design(np.zeros(10), people, share=share, **fields)
                name = f"10 equal items, {people} observers, {population}, {pairs}"
                kinds = COVARIANCES if share == 1.0 else COVARIANCES[:1]
                cells += [(kind, name, equal, kind, studies if kind == "auto" else few) for kind in kinds]
            apart = Design(THETA, people, **fields)
            name = f"10 items of Table 4.4, {people} observers, {population}"
            cells += [(kind, name, apart, kind, few) for kind in COVARIANCES]
        name = f"10 items half as far apart as in Table 4.4, {people} observers, alike"
        cells += [(kind, name, Design(THETA / 2, people), kind, studies) for kind in COVARIANCES]
    for (kind, name, _, _, many), found in zip(cells, in_two_processes(_decide, cells), strict=True):
        yield _decision(kind, name, found, many)


def _climbed(studies: int) -> Iterator[Row]:
    """Yield what the default did on ladders of equal steps, where many answers are all the same way."""
    cells: list[tuple[str, str, Design, CovarianceChoice, int]] = []
    for (step, items), people, population in product(LADDERS, CLIMBERS, LADDER_POPULATIONS[: sized(None, 1)]):
        theta = -step * (np.arange(items) - (items - 1) / 2)
        fields = dict(POPULATIONS[population])
        if "camps" in fields:
            fields["camps"] = np.where(np.arange(items) < items // 2, 1.0, -1.0)
        for pairs, share in PAIRS.items():
            if share != 1.0 and (people not in (5, 10, 30) or population not in LADDER_POPULATIONS[::3]):
                continue
            name = f"{items} items {step:g} nats apart, {people} observers, {population}, {pairs}"
            cells.append(("auto", name, Design(theta, people, share=share, **fields), "auto", studies))
    for (kind, name, _, _, many), found in zip(cells, in_two_processes(_decide, cells), strict=True):
        yield _decision(kind, name, found, many) | {"series": "ladders, holm, auto"}


def _at_the_edge(studies: int) -> Iterator[Row]:
    """Yield false differences of three equal items between two that nearly all answers put above and below them."""
    cells: list[tuple[str, str, Design, CovarianceChoice, int]] = []
    for kind, people, step in product(("auto", "scaled"), CLIMBERS, sized((2.0, 4.0), (2.0,))):
        theta = step * np.array([1.0, 0, 0, 0, -1.0])
        for population in LADDER_POPULATIONS[: sized(3, 1) : 2]:
            name = f"3 equal items between two {step:g} nats away, {people} observers, {population}"
            cells.append((kind, name, Design(theta, people, **POPULATIONS[population]), kind, studies))
    for (kind, name, _, _, many), found in zip(cells, in_two_processes(_decide, cells), strict=True):
        yield _decision(kind, name, found, many) | {"series": f"edges, holm, {kind}"}


def _by_law(studies: int) -> Iterator[Row]:
    """Yield what tests by other laws and with an order effect did, of six items up to two nats apart."""
    cells: list[tuple[str, str, Design, CovarianceChoice, int]] = []
    halves = np.where(np.arange(6) < 3, 1.0, -1.0)
    populations: dict[str, dict[str, Any]] = {"alike": {}, "1.5 nats": {"observer_sd": 1.5}, "camps": {"camps": halves}}
    for (law, k, order), people, step in product(BY_LAW, sized((5, 10, 30), (5,)), sized((0.0, 1.0, 2.0), (0.0,))):
        nat = 0.6 if law == "thurstone" else 1.0
        theta = -step * nat * (np.arange(6) - 2.5)
        for population, fields in [*populations.items()][: sized(None, 1)]:
            own = {name: nat * value for name, value in fields.items()}
            name = f"6 items {step:g} nats apart, {people} observers, {population}, {law}{' with order' * (order > 0)}"
            design = Design(theta, people, law=law, k=k, order=order or None, **own)
            cells.append(("auto", name, design, "auto", studies))
    for (kind, name, _, _, many), found in zip(cells, in_two_processes(_decide, cells), strict=True):
        yield _decision(kind, name, found, many) | {"series": "laws, holm, auto"}


def _decide(cell: tuple[str, str, Design, CovarianceChoice, int]) -> Decisions:
    _, _, design, kind, many = cell
    return decisions(design, studies=many, covariance=kind)


def _decision(kind: str, name: str, found: Decisions, studies: int) -> Row:
    none_true = np.isnan(found.separated)
    true_ones = f", {100 * found.separated:.1f} % of true ones come out, by signs {100 * found.direct:.1f} %"
    true_ones = "" if none_true else true_ones
    scores = "" if np.isnan(found.log10_scores) else f", {100 * found.log10_scores:.1f} % of log scores"
    return row(
        f"classes, holm, {kind}",
        name,
        None,
        abs(found.differences - 0.95),
        note=f"{studies} studies: {100 * found.false_difference:.1f} ± {100 * found.standard_error:.1f} % report a "
        f"false difference{true_ones}; 95 % intervals contain "
        f"{100 * found.differences:.1f} % of differences ({100 * found.too_far:.1f} % lie farther from 0, "
        f"{100 * found.too_near:.1f} % nearer)" + scores,
        studies=studies,
        false_difference=found.false_difference,
        separated=None if none_true else found.separated,
        direct=None if none_true else found.direct,
        too_far=found.too_far,
        too_near=found.too_near,
        covered=found.differences,
        covered_log10_scores=found.log10_scores if scores else None,
    )


def _times() -> dict[str, float]:
    by_observer = next(DESIGNS["30 observers, alike"].studies(1, 1))
    names = [str(place) for place in range(30)]
    drawn = resample_counts(by_observer, names[:10], names)
    draws = seconds(lambda: resample_counts(by_observer, names[:10], names), repeats=3)
    each = {kind: seconds(lambda kind=kind: intervals(drawn, kind=kind), repeats=3) for kind in KINDS}
    return {kind: time + (0 if kind in ("model", "sandwich") else draws) for kind, time in each.items()}


def _covered(name: str, each: list[Coverage], times: dict[str, float]) -> Iterator[Row]:
    for found in each:
        note = f"{100 * found.covered:.1f} ± {100 * found.standard_error:.1f} % hold the truth, worst value"
        note += f" {100 * found.worst:.1f} %, {100 * found.too_high:.1f} % above, {100 * found.too_low:.1f} % below"
        yield row(
            f"{found.kind}, {found.quantity}",
            name,
            times[found.kind],
            abs(found.covered - 0.95),
            note=f"{note}; median width {found.width:.3g}",
            covered=found.covered,
        )


if __name__ == "__main__":
    program("interval_coverage", lambda: run(*numbers()))
