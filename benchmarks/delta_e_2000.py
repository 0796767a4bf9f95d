"""CIEDE2000 on a million colours: run time against error, colour-science beside it in the same run."""

from __future__ import annotations

from functools import partial

import numpy as np
from curves import seconds, times_faster, write

from devices.colour import ciede2000

COLOURS = 1_000_000
BLOCKS = (256, 2048, 8192, 65536, COLOURS)


def run() -> dict[str, object]:
    """Time all on the same colours; the error is the largest difference from colour-science in float64."""
    import colour

    rng = np.random.default_rng(0)
    first, second = (rng.uniform([0, -100, -100], [100, 100, 100], (COLOURS, 3)) for _ in range(2))
    first32, second32 = first.astype(np.float32), second.astype(np.float32)
    oracle = np.asarray(colour.delta_E(first, second, method="CIE 2000"))
    theirs = partial(colour.delta_E, first, second, method="CIE 2000")
    rows: list[dict[str, object]] = [
        {"series": "colour-science", "parameter": "float64", "seconds": seconds(theirs, repeats=3), "error": 0.0}
    ]
    usual = ciede2000._BLOCK
    try:
        for block in BLOCKS:
            ciede2000._BLOCK = block
            for one, other, stored in ((first, second, "float64"), (first32, second32, "float32")):
                ours = partial(ciede2000.delta_e_2000, one, other)
                error = float(np.abs(ours() - oracle).max())
                rows.append(
                    {
                        "series": f"cyclopean, colours stored as {stored}",
                        "parameter": f"{block:,} at a time" + (" (as shipped)" if block == usual else ""),
                        "seconds": seconds(ours, repeats=3),
                        "error": error,
                        "note": f"{times_faster(ours, theirs, rounds=3):.1f} × as fast as colour-science",
                    }
                )
    finally:
        ciede2000._BLOCK = usual
    with_terms = partial(ciede2000.delta_e_2000_parts, first, second)
    error = float(np.abs(with_terms().delta_e - oracle).max())
    taken = seconds(with_terms, repeats=3)
    rows.append({"series": "cyclopean, with all terms", "parameter": "float64", "seconds": taken, "error": error})
    return {"title": f"CIEDE2000 of {COLOURS:,} pairs of colours", "rows": rows}


if __name__ == "__main__":
    result = run()
    write("delta_e_2000", str(result["title"]), result["rows"])
