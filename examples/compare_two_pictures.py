"""Compare a photograph with its rendering: region by region, with a verdict.

    python examples/compare_two_pictures.py

Both pictures are made here; with files of your own, name them and a regions file instead.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import cyclopean

root = Path(__file__).parents[1]
rng = np.random.default_rng(7)
photograph = rng.uniform(10, 40, (180, 240, 3))
renderings = {"one that is the photograph": photograph, "one a tenth too bright": photograph * 1.1}

with TemporaryDirectory() as folder:
    photo_file, rendering_file = Path(folder, "photograph.exr"), Path(folder, "rendering.exr")
    cyclopean.write_picture(photo_file, photograph)
    for name, rendering in renderings.items():
        cyclopean.write_picture(rendering_file, rendering)
        result = cyclopean.compare(photo_file, rendering_file, root / "configs/regions/plate.yaml")
        print(f"{name}: {result.value.verdict.decision}")
        print(result.to_frame()[["eye", "name", "delta_e"]].round(2).to_string(index=False))

white = [30.0, 31.0, 33.0]
print(f"two greys differ by ΔE00 {float(cyclopean.delta_e([12, 12.5, 13], [12, 12.2, 13], white)):.2f}")
