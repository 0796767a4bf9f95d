"""CIEDE2000 on a million colours: run time against error, colour-science beside it in the same run."""

from __future__ import annotations

import numpy as np
from curves import seconds, write

from devices.colour import delta_e_2000

COLOURS = 1_000_000


def run() -> dict[str, object]:
    """Time both on the same colours; the error is the largest difference from colour-science."""
    import colour

    rng = np.random.default_rng(0)
    first, second = (rng.uniform([0, -100, -100], [100, 100, 100], (COLOURS, 3)) for _ in range(2))
    oracle = np.asarray(colour.delta_E(first, second, method="CIE 2000"))
    rows = [
        {
            "series": "colour-science",
            "parameter": "float64",
            "seconds": seconds(lambda: colour.delta_E(first, second, method="CIE 2000"), repeats=3),
            "error": 0.0,
        }
    ]
    for dtype in (np.float64, np.float32):
        one, other = first.astype(dtype), second.astype(dtype)
        taken = seconds(lambda one=one, other=other: delta_e_2000(one, other), repeats=3)
        error = float(np.abs(delta_e_2000(one, other) - oracle).max())
        ratio = rows[0]["seconds"] / taken
        rows.append(
            {
                "series": "cyclopean",
                "parameter": f"colours stored as {np.dtype(dtype).name}",
                "seconds": taken,
                "error": error,
                "note": f"{ratio:.1f} × as fast as colour-science",
            }
        )
    return {"title": f"CIEDE2000 of {COLOURS:,} pairs of colours", "rows": rows}


if __name__ == "__main__":
    result = run()
    write("delta_e_2000", str(result["title"]), result["rows"])
