"""Run on a GL with stereo visuals: draw a picture for each eye and save what both back buffers hold.

    LD_LIBRARY_PATH=DIR/lib FORCE_STEREO=1 python draw_each_eye.py INPUT.npz OUTPUT.npz

INPUT holds left and right XYZ and, per eye, black, primaries and the curves as (gain, offset, gamma, lift).
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
from numpy.lib.npyio import NpzFile

from devices.display import DisplayModel, EyeModels, ToneCurve
from runner import Picture, Scene
from runner.presenter import ModeOptions, Presenter, find_mode, open_surface
from runner.scene import Text
from stimuli.pictures import StereoImage


def read_model(given: NpzFile, eye: str) -> DisplayModel:
    """Return the display model of ``eye``."""
    red, green, blue = (ToneCurve(*curve) for curve in given[f"{eye}_curves"].tolist())
    return DisplayModel(given[f"{eye}_black"], given[f"{eye}_primaries"], (red, green, blue))


def main(input_file: str, output_file: str) -> None:
    """Draw and save."""
    with np.load(input_file) as given:
        picture = StereoImage(given["left"], given["right"])
        models = EyeModels(read_model(given, "left"), read_model(given, "right"))
    size_px = (picture.width_px, picture.height_px)
    words = Scene((Text("Which is closer?", (3, 5)),))
    with open_surface("window", size_px, stereo=True) as surface:
        facts = json.dumps(surface.facts.to_json())
        with Presenter(surface, find_mode("quad-buffered"), models, lambda _: picture) as presenter:
            presenter.show(Scene((Picture("ramps"),)))
            eyes = presenter.capture()
            presenter.show(words)
            captions = presenter.capture()
        both: dict[str, Any] = {}
        for name in ("side-by-side", "row-interleaved", "checkerboard"):
            with Presenter(surface, find_mode(name), models, lambda _: picture) as presenter:
                presenter.show(Scene((Picture("ramps"), Text("Which is closer?"))))
                presenter.capture()
                both[f"both_{name}"] = np.stack([surface.read("left"), surface.read("right")])
        swapped = find_mode("quad-buffered", ModeOptions(swap_eyes=True, sync_line=True))
        with Presenter(surface, swapped, models, lambda _: picture) as presenter:
            presenter.show(Scene((Picture("ramps"),)))
            crossed = presenter.capture()
    np.savez(
        output_file,
        left=eyes["left"],
        right=eyes["right"],
        words_left=captions["left"],
        words_right=captions["right"],
        swapped_left=crossed["left"],
        swapped_right=crossed["right"],
        **both,
        facts=facts,
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
