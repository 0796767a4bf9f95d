"""What clipping costs a picture: reckoned in blocks, those within the gamut skipped; at once; or found as kept.

A picture of 1344 × 1000 pixels on the thesis's display, of which none, a hundredth (in one place, as highlights lie, or
scattered) or all of the pixels are beyond the gamut. The error is of the mean ΔE00 against all pixels at once. What is
found is read from a file, checked, and compared by all that it depends on.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from curves import Row, seconds, times_faster, write
from numpy.typing import NDArray

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.clipping import clip_cost
from devices.display.display_file import read_display
from devices.display.model import DisplayModel
from runner.session.clipping_costs import CostCache

Floats = NDArray[np.float64]
TITLE = "What clipping costs a picture, 1344 × 1000 pixels"
DISPLAY = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
HEIGHT, WIDTH = 1000, 1344


def pictures(model: DisplayModel) -> dict[str, NDArray[np.float32]]:
    """Return XYZ in cd/m², by how much of it is clipped."""
    rng = np.random.default_rng(7)
    inside = rng.uniform(0.02, 0.9, (HEIGHT, WIDTH, 3))
    place, scattered = inside.copy(), inside.copy()
    place[450:550, 600:735] *= 3.0
    scattered[rng.random((HEIGHT, WIDTH)) < 0.01] *= 3.0
    asked = {"none": inside, "1 % in one place": place, "1 % scattered": scattered, "all": inside + 1.0}
    return {
        name: (model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T).astype(np.float32)
        for name, light in asked.items()
    }


def at_once(model: DisplayModel, xyz_cd_m2: NDArray[np.float32]) -> float:
    """Return the mean ΔE00, all pixels in one go, those that were clipped compared."""
    asked = xyz_cd_m2.reshape(-1, 3).astype(np.float64)
    linear = model.linear(asked)
    lowest, highest = model.limits
    changed = ((linear < lowest) | (linear > highest)).any(axis=1)
    model.clipping(asked)
    shown, white = model.xyz(model.code(asked[changed])), model.white_XYZ_cd_m2
    difference = delta_e_2000(xyz_to_lab(np.maximum(asked[changed], 0.0), white), xyz_to_lab(shown, white))
    return float(difference.sum() / len(asked))


def run() -> dict[str, object]:
    """Time the three ways with each picture."""
    model = read_display(DISPLAY).models("side-by-side").left
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, picture in pictures(model).items():
            cache, depends_on = CostCache(Path(folder)), {"picture": name, "display": "0" * 64, "mode": "side-by-side"}
            cost = clip_cost(model, picture)
            cache.keep(depends_on, cost.to_json())
            error = abs(cost.delta_e_00_mean - at_once(model, picture))
            ways = {
                "in blocks": lambda picture=picture: clip_cost(model, picture),
                "all pixels at once": lambda picture=picture: at_once(model, picture),
                "found": lambda cache=cache, depends_on=depends_on: cache.find(depends_on),
            }
            faster = times_faster(ways["in blocks"], ways["all pixels at once"], rounds=5)
            notes = {"in blocks": f"{faster:.1f} × as fast as at once"}
            for way, work in ways.items():
                row = {"series": way, "parameter": f"{name} clipped", "seconds": seconds(work, repeats=3)}
                rows.append({**row, "error": error if way == "in blocks" else 0.0, "note": notes.get(way, "")})
    return {"title": TITLE, "rows": rows}


if __name__ == "__main__":
    result = run()
    write("clip_cost", str(result["title"]), result["rows"])  # type: ignore[arg-type]  # rows
