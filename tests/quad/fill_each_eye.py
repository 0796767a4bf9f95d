"""Run on a GL with stereo visuals: fill each eye's buffer with codes and print whether every pixel has just those."""

from __future__ import annotations

import itertools
import json

import numpy as np

from runner.measuring.code_screen import CodeScreen, EyeCodes
from runner.presenter import find_mode, open_surface

CODES = ((0, 0, 0), (1, 128, 254), (255, 255, 255), (77, 3, 200))


def share(codes: tuple[int, int, int]) -> tuple[float, float, float]:
    """Return codes 0..255 as 0..1."""
    return codes[0] / 255, codes[1] / 255, codes[2] / 255


def main() -> None:
    """Fill and compare, in the stereo mode, and in one whose picture must stand in both buffers."""
    wrong = {}
    with open_surface("window", (320, 240), stereo=True) as surface:
        for mode in ("quad-buffered", "row-interleaved", "flat"):
            with CodeScreen(surface, find_mode(mode)) as screen:
                pixels = 0
                for left, right in itertools.product(CODES, CODES):
                    if screen.shared and left != right:
                        continue
                    screen.show(EyeCodes(share(left), share(right)))
                    pixels += int(np.any(screen.seen_by("left") != left, axis=-1).sum())
                    pixels += int(np.any(screen.seen_by("right") != right, axis=-1).sum())
                    if mode != "quad-buffered":
                        pixels += int(np.any(surface.read("left") != surface.read("right"), axis=-1).sum())
                wrong[mode] = pixels
        print(json.dumps({"stereo": surface.stereo, "wrong": wrong}))


if __name__ == "__main__":
    main()
