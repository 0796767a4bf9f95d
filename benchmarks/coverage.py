"""How often intervals contain the truth and tests report a false difference, and the time that each kind takes.

    python benchmarks/coverage.py [STUDIES]

Time is for all values of one study with 1000 replicates; the draws, which the kinds share, are counted in each. The
error is the distance of the share of 95 % intervals that contain the truth from 0.95.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from curves import OUT, seconds, write
from simulated_studies import Coverage, Design, coverage, family_error

from analysis.bootstrap.confidence_intervals import KINDS, Kind, intervals
from analysis.bootstrap.replicates import NAMES, resample_counts
from analysis.classes.multiplicity import Adjust

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
QUICK: tuple[tuple[Adjust, str], ...] = (
    ("maxz", "model"),
    ("holm", "model"),
    ("maxz", "sandwich"),
    ("holm", "sandwich"),
    ("maxz", "sandwich, normal law"),
)
SLOW: tuple[tuple[Adjust, str], ...] = (("maxz", "bootstrap"), ("holm", "bootstrap"))


def run(studies: int = 300) -> dict[str, Any]:
    """Simulate and return the title and the rows.

    There are ten times as many studies where no bootstrap is drawn, and a third for the studentised one.
    """
    times = _times()
    quick: list[Kind] = [kind for kind in KINDS if kind != "studentised"]
    rows: list[Row] = []
    for name, design in DESIGNS.items():
        rows += _covered(name, coverage(design, quick, NAMES, studies=studies), times)
        slow = coverage(design, ["studentised"], ["difference"], studies=max(2, studies // 3))
        rows += _covered(name, slow, times)
    return {
        "name": "coverage",
        "title": TITLE,
        "rows": [*rows, *_families(QUICK, 10 * studies), *_families(SLOW, studies)],
    }


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
        yield {
            "series": f"{found.kind}, {found.quantity}",
            "parameter": name,
            "seconds": times[found.kind],
            "error": abs(found.covered - 0.95),
            "note": f"{note}; median width {found.width:.3g}",
            "covered": found.covered,
        }


def _families(families: tuple[tuple[Adjust, str], ...], studies: int) -> Iterator[Row]:
    for name, observer_sd in (("alike", 0.0), ("each their own (0.7 nats)", 0.7)):
        design = Design(np.zeros(10), 30, observer_sd)
        for (adjust, source), share in family_error(design, families, studies=studies).items():
            yield {
                "series": f"classes, {adjust}, {source}",
                "parameter": f"10 equal items, 30 observers, {name}",
                "seconds": None,
                "error": abs(share - 0.05),
                "note": f"{100 * share:.1f} % of {studies} studies find a difference",
                "family_error": share,
            }


def main() -> None:
    """Simulate and write the three files."""
    result = run(*(int(argument) for argument in sys.argv[1:2]))
    write(result["name"], TITLE, result["rows"], OUT)
    print(f"written to {OUT}")


if __name__ == "__main__":
    main()
