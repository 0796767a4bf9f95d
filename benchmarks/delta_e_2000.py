"""CIEDE2000 on a million colours: run time against error, colour-science beside it in the same run."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from curves import program, seconds, sized, times_faster
from promises import Promise

from devices.colour import ciede2000
from devices.colour.ciede2000 import plain_terms
from documents import at_most_threads
from documents.arrays import Floats
from tests.devices.colour.plain import plain_delta_e

COLOURS = sized(1_000_000, 20_000)
BLOCKS = sized((2048, 8192, 32768, 131072), (2048, 32768))


def run() -> dict[str, object]:
    """Time all on the same colours; the error is the largest difference from colour-science in float64."""
    import colour

    rng = np.random.default_rng(0)
    first, second = (rng.uniform([0, -100, -100], [100, 100, 100], (COLOURS, 3)) for _ in range(2))
    first32, second32 = first.astype(np.float32), second.astype(np.float32)
    oracle = np.asarray(colour.delta_E(first, second, method="CIE 2000"))
    theirs = partial(colour.delta_E, first, second, method="CIE 2000")
    rows: list[dict[str, Any]] = [
        {"series": "colour-science", "parameter": "float64", "seconds": seconds(theirs, repeats=3), "error": 0.0}
    ]
    usual = ciede2000._BLOCK
    try:
        for block in BLOCKS:
            ciede2000._BLOCK = block
            for one, other, stored in ((first, second, "float64"), (first32, second32, "float32")):
                ours = partial(ciede2000.delta_e_2000, one, other)
                error = float(np.abs(ours() - oracle).max())
                for threads in (1, 2) if block == usual else (2,):
                    shipped = ", as shipped" if block == usual else ""
                    with at_most_threads(threads):
                        rows.append(
                            {
                                "series": f"cyclopean, colours stored as {stored}, threads: {threads}",
                                "parameter": f"{block:,} at a time{shipped}",
                                "seconds": seconds(ours, repeats=3),
                                "error": error,
                                "ratio": (ratio := times_faster(ours, theirs, rounds=sized(5, 1))),
                                "note": f"{ratio:.1f} × as fast as colour-science",
                            }
                        )
    finally:
        ciede2000._BLOCK = usual
    plain = partial(_plain, first, second)
    error = float(np.abs(plain() - oracle).max())
    ratio = times_faster(plain, theirs, rounds=3)
    rows.append(
        {
            "series": "the paper's equations in whole arrays",
            "parameter": "float64",
            "seconds": seconds(plain, repeats=3),
            "error": error,
            "ratio": ratio,
            "note": f"{ratio:.1f} × as fast as colour-science",
        }
    )
    with_terms = partial(ciede2000.delta_e_2000_parts, first, second)
    error = float(np.abs(with_terms().delta_e - oracle).max())
    taken = seconds(with_terms, repeats=3)
    rows.append({"series": "cyclopean, with all terms", "parameter": "float64", "seconds": taken, "error": error})
    shipped = next(row for row in rows if "shipped" in row["parameter"] and "float64, threads: 2" in row["series"])
    promises = [
        Promise("largest difference from colour-science", shipped["error"], 1e-9, "error", unit="ΔE00"),
        Promise("beside colour-science, a million pairs", shipped["ratio"], 6.0, "ratio", "at least", "×"),
    ]
    return {"title": f"CIEDE2000 of {COLOURS:,} pairs of colours", "rows": rows, "promises": promises}


def _plain(first: Floats, second: Floats) -> Floats:
    """The slow twin, a few colours at a time."""
    out = np.empty(len(first))
    for start in range(0, len(out), 8192):
        part = slice(start, start + 8192)
        planes = (np.ascontiguousarray(colours[part].T) for colours in (first, second))
        out[part] = plain_delta_e(*plain_terms(*planes))
    return out


if __name__ == "__main__":
    program("delta_e_2000", run)
