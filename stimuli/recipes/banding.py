"""Where the steps between the codes of 8 bits will be seen as bands: in pictures that were brightened.

On a display whose white is the picture's, neighbouring greys of 8 bits differ by ΔE00 0.40 at most: what every screen
shows. Times a factor, the same codes lie further apart. A difference of 1 between patches is just noticeable; bands
share their whole edge, the arrangement in which least is overlooked, and half of it is where they are named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from devices.colour import delta_e_2000, xyz_to_lab
from stimuli.pictures.colour_spaces import NAMED_SPACES, named_encoding
from stimuli.recipes.values import Step

VISIBLE_DELTA_E = 0.5


def banding(before: Sequence[Step], after: Sequence[Step]) -> tuple[Step, ...]:
    """Return the step that names bands, or nothing: of 8 bits read ``before``, and brightened ``after``."""
    reads = [step for step in before if step["step"] == "read" and step.get("bits") == 8]
    factor = math.prod(float(step["luminance_scale"]) for step in after if "luminance_scale" in step)
    if not reads or factor <= 1.0:
        return ()
    space, white_cd_m2 = reads[0]["colour_space"], reads[0]["white_luminance_cd_m2"]
    # A profile's own curve is near sRGB's.
    encoding = named_encoding(next((name for name in NAMED_SPACES if name == space), "srgb"))
    luminance = encoding.tables(256)[:, 0] * factor
    lab = xyz_to_lab(luminance[luminance <= 1.0, None] * encoding.white, encoding.white)
    steps = delta_e_2000(lab[:-1], lab[1:])
    worst = int(np.argmax(steps))
    if steps[worst] <= VISIBLE_DELTA_E:
        return ()
    at_cd_m2 = float(luminance[worst]) * white_cd_m2
    sentence = (
        f"brightened {factor:.3g} times, codes of 8 bits are up to ΔE00 {steps[worst]:.2f} apart (at {at_cd_m2:.2g} "
        f"cd/m²), so that smooth shadings may show bands; start from 16 bits"
    )
    facts = {"luminance_factor": factor, "delta_e_00": float(steps[worst]), "luminance_cd_m2": at_cd_m2}
    return ({"step": "banding", **facts, "said": [sentence]},)
