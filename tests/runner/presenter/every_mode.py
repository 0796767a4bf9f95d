"""Draw one picture in every mode, offscreen, and save the codes: also run by itself, where the driver has no doubles.

python every_mode.py OUTPUT.npz [everything]
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from devices.compensation import Correction
from devices.display import Crosstalk, DisplayModel, EyeModels, GainMap, Plvc, TableCurve, ToneCurve
from runner import Picture, Scene
from runner.presenter import MODES, Presenter, find_mode, open_surface
from stimuli.pictures import StereoImage

SIZE_PX = (128, 96)
PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])
BLACK = np.array([0.05, 0.06, 0.08])
WITH_ALL = ("side-by-side-half", "checkerboard")
Codes = NDArray[np.uint8] | NDArray[np.uint16]


def additive(gamma: float, share: float = 1.0) -> DisplayModel:
    """A display of ``share`` of the light, of a GOGO curve."""
    red, green, blue = (ToneCurve(0.98, 0.02, gamma + step, 0.001) for step in (0.0, -0.1, 0.1))
    return DisplayModel(share * BLACK, share * PRIMARIES, (red, green, blue))


def plvc(share: float = 1.0) -> DisplayModel:
    """A display whose channels act on each other."""
    rng = np.random.default_rng(1)
    x = np.linspace(0.0, 1.0, 17)
    red, green, blue = (TableCurve(tuple(x), tuple(x**gamma)) for gamma in (1.8, 2.2, 2.4))
    own = PRIMARIES.T[:, np.newaxis] * (1.0 + 0.05 * rng.uniform(-1, 1, (3, 4, 3)))
    mixtures = 0.02 * rng.uniform(-1, 1, (10, 3)) * PRIMARIES.sum(axis=1)
    return Plvc(share * BLACK, share * PRIMARIES, (red, green, blue), share * own, share * mixtures)


def draw(everything: bool) -> tuple[dict[str, Codes], str]:
    """Return what every mode shows, by mode, display and buffer, and what the codes were computed in.

    ``everything`` corrects also where channels act on each other, a pass that takes long to compile.
    """
    width, height = SIZE_PX
    rng = np.random.default_rng(3)
    light = rng.uniform(0.0, 1.1, (2, height, width, 3)) ** 2.0
    picture = StereoImage(*(BLACK + each @ PRIMARIES.T for each in light.astype(np.float32)))
    picture = StereoImage(picture.left.astype(np.float32), picture.right.astype(np.float32))
    displays = {"additive": EyeModels(additive(2.2), additive(2.4, 0.9)), "plvc": EyeModels(plvc(), plvc(0.9))}
    gains = GainMap(np.array([[90.0, 95.0], [100.0, 97.0]]), SIZE_PX, "corners", "minimum")
    corrections = {"": None, "corrected": Correction(Crosstalk(0.02 * np.eye(3), 0.01 * np.eye(3)), gains)}
    found: dict[str, Codes] = {}
    with open_surface("egl", SIZE_PX, windows=2) as surface:
        for name in MODES:
            mode = find_mode(name)
            if mode.needs_stereo:
                continue  # tests/quad
            for display, models in displays.items():
                for corrected, correction in corrections.items():
                    if name not in WITH_ALL and (display == "plvc" or correction):
                        continue  # the same passes as in these
                    if display == "plvc" and correction and not everything:
                        continue
                    if name == "flat":
                        models, correction = EyeModels(models.left, models.left), None
                    shown = StereoImage.flat(picture.left) if name == "flat" else picture
                    with Presenter(
                        surface, mode, models, {"one": shown}.__getitem__, correction=correction
                    ) as presenter:
                        presenter.show(Scene((Picture("one"),)))
                        for buffer, codes in presenter.capture().items():
                            found[f"{name} {display} {corrected} {buffer}"] = codes
        arithmetic = surface.facts.arithmetic
    return found, arithmetic


def main(output_file: str, *words: str) -> None:
    """Draw, save, and print what was drawn in."""
    found, arithmetic = draw("everything" in words)
    np.savez(output_file, **found)  # type: ignore[arg-type]  # numpy's stub takes names for its own arguments
    print(arithmetic)


if __name__ == "__main__":
    main(*sys.argv[1:])
