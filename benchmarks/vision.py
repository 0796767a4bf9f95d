"""Light as the eye takes it: cone contrasts, adaptation to another white, and contrast sensitivity.

Time of a picture's pixels, or of a curve, and the largest error against colour-science or a plain way in the same run.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from curves import program, seconds, sized
from numpy.typing import NDArray
from promises import Promise, worst

from devices.colour import white_point
from devices.colour_matching import dkl_from_xyz, lms_from_xyz, xyz_of_dkl
from devices.display import contrast_sensitivity
from stimuli.pictures import StereoImage
from stimuli.recipes.picture_steps import adapted
from stimuli.recipes.steps_spec import AdaptSpec

Floats = NDArray[np.floating]


def run() -> dict[str, object]:
    """Time each part and its peer."""
    from colour.adaptation import chromatic_adaptation_VonKries
    from colour.contrast import contrast_sensitivity_function_Barten1999, pupil_diameter_Barten1999
    from colour.contrast.barten1999 import retinal_illuminance_Barten1999, sigma_Barten1999

    grey = white_point("d65", 50.0)
    light = np.random.default_rng(1).uniform(0.5, 1.5, (*sized((768, 1024), (96, 128)), 3)).astype(
        np.float32
    ) * grey.astype(np.float32)
    image, spec = StereoImage.flat(light), AdaptSpec(from_white="a", to_white="d65")
    whites = white_point("a", 1.0), white_point("d65", 1.0)
    frequencies = np.geomspace(0.1, 60.0, 1000)

    def barten() -> Floats:
        pupil = pupil_diameter_Barten1999(100.0, 10.0, 10.0)
        blur = sigma_Barten1999(0.5 / 60, 0.08 / 60, pupil)
        trolands = retinal_illuminance_Barten1999(100.0, pupil, True)
        return np.asarray(contrast_sensitivity_function_Barten1999(frequencies, sigma=blur, X_0=10.0, E=trolands))

    def cones_one_by_one() -> Floats:
        long, middle, short = (light.astype(np.float64) @ row for row in lms_from_xyz())
        one, two, three = lms_from_xyz() @ grey
        share = one / (one + two)
        brighter = share * (long / one - 1) + (1 - share) * (middle / two - 1)
        red = np.hypot(share, 1 - share) * (long / one - middle / two)
        return np.stack([np.sqrt(3) * brighter, red, short / three - 1 - brighter], axis=-1)

    works: list[tuple[str, Callable[[], Floats], str, Callable[[], Floats]]] = [
        (
            "adapt by CAT16, 0.8 megapixels",
            lambda: adapted(image, spec)[0].left,
            "colour-science",
            lambda: chromatic_adaptation_VonKries(light.astype(np.float64), *whites, transform="CAT16"),
        ),
        ("DKL, 0.8 megapixels", lambda: dkl_from_xyz(light, grey), "cone by cone (NumPy)", cones_one_by_one),
        ("DKL and back", lambda: xyz_of_dkl(dkl_from_xyz(light, grey), grey), "nothing done", lambda: light),
        (
            "contrast sensitivity, 1000 frequencies",
            lambda: contrast_sensitivity(frequencies, 100.0),
            "colour-science",
            barten,
        ),
    ]
    rows: list[dict[str, object]] = []
    for what, ours, peer, theirs in works:
        found, expected = ours(), theirs()
        error = float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))
        rows.append({"series": "ours", "parameter": what, "seconds": seconds(ours, repeats=5), "error": error})
        rows.append({"series": peer, "parameter": what, "seconds": seconds(theirs, repeats=5), "error": error})
    promises = [Promise("largest relative difference from the peers", worst(rows), 1e-6, "error")]
    return {"promises": promises, "title": "Cone contrasts, adaptation and contrast sensitivity", "rows": rows}


if __name__ == "__main__":
    program("vision", run)
