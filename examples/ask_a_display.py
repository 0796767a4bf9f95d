"""Ask a display what it shows: from codes to light, from light to codes, and which light it cannot show.

python examples/ask_a_display.py
"""

from pathlib import Path

import numpy as np

import cyclopean

root = Path(__file__).parents[1]
asus = cyclopean.display(root / "configs/displays/asus_vg248qe.yaml")
print(asus)
print(asus.to_frame()[["mode", "eye", "white_luminance_cd_m2"]].to_string(index=False))

left_eye = asus.value.models("quad-buffered").left
grey = np.array([0.5, 0.5, 0.5])
light = left_eye.xyz(grey)
print(f"code 0.5 through the glasses: XYZ {np.round(light, 3)} cd/m²")
print(f"and back: {np.round(left_eye.code(light), 6)}")

pictures = np.random.default_rng(1).uniform(0, 30, (100, 100, 3))
clipping = left_eye.clipping(pictures)
print(f"{clipping.any_channel} of {clipping.pixels} random pixels are outside the gamut")
