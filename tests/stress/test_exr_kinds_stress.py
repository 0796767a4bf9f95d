"""OpenEXR of every kind to the edges: sizes, windows and regions at random, files cut and changed; kept JPEG too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import rgb_to_xyz_matrix
from stimuli.pictures import REC709, Region, read_exr
from tests.stimuli.pictures.exr_bytes import Part, decimated, floats, write_bytes

pytestmark = pytest.mark.stress

DECLARED = ("chromaticities", "chromaticities", floats(*REC709.ravel()))
WEIGHTS = rgb_to_xyz_matrix(*REC709)[1]


def chroma_of(grey: NDArray[Any], red: float, blue: float) -> tuple[dict[str, NDArray[Any]], dict[str, int]]:
    """Return channels of one chroma everywhere, at every second pixel, and their steps."""
    half = decimated(np.ones_like(grey))
    return {"Y": grey, "RY": half * np.float16(red), "BY": half * np.float16(blue)}, {"RY": 2, "BY": 2}


@pytest.mark.parametrize("height", [2, 4, 26, 28, 54, 56])
def test_chroma_of_every_size(tmp_path: Path, height: int) -> None:
    """Of one chroma everywhere nothing is left to interpolate: R = (RY + 1) Y, and green by luminance, to a half float.

    The interpolation's weights sum to 1.0002.
    """
    rng = np.random.default_rng(height)
    for width in (2, 4, 12, 26, 28, 30, 56, 100):
        grey = rng.uniform(0.5, 2, (height, width)).astype("<f2")
        channels, steps = chroma_of(grey, 0.3, -0.25)
        image = read_exr(write_bytes(tmp_path / "a.exr", Part(channels, [DECLARED], steps=steps)))
        luminance = grey.astype(np.float64)
        red, blue = luminance * (1 + float(np.float16(0.3))), luminance * (1 + float(np.float16(-0.25)))
        green = (luminance - WEIGHTS[0] * red - WEIGHTS[2] * blue) / WEIGHTS[1]
        expected = np.stack([red, green, blue], axis=-1) @ rgb_to_xyz_matrix(*REC709).T
        np.testing.assert_allclose(image.left, expected, rtol=3e-3)


def test_windows_and_regions_at_random(tmp_path: Path) -> None:
    """Two views, each stored in a window of its own, on one display window anywhere: against pixel after pixel."""
    rng = np.random.default_rng(5)
    for _ in range(150):
        x, y = (int(value) for value in rng.integers(-40, 40, 2))
        width, height = (int(value) for value in rng.integers(1, 20, 2))
        display = (x, y, x + width - 1, y + height - 1)
        parts, expected = [], np.zeros((2, height, width))
        for eye, name in enumerate((b"left", b"right")):
            inside = x + int(rng.integers(width)), y + int(rng.integers(height))
            left, top = (int(at - rng.integers(0, 12)) for at in inside)
            right, bottom = (int(at + rng.integers(0, 12)) for at in inside)
            grey = rng.uniform(1, 2, (bottom - top + 1, right - left + 1)).astype("<f4")
            attributes = [("view", "string", name), DECLARED]
            parts.append(Part({"Y": grey}, attributes, (left, top, right, bottom), display, decreasing=bool(eye)))
            for row in range(max(top, y), min(bottom, y + height - 1) + 1):
                for column in range(max(left, x), min(right, x + width - 1) + 1):
                    expected[eye, row - y, column - x] = grey[row - top, column - left]
        image = read_exr(write_bytes(tmp_path / "a.exr", *parts))
        found = np.stack([image.left[..., 1], image.right[..., 1]])
        np.testing.assert_allclose(found, expected, rtol=1e-6)
        at = Region(int(rng.integers(width)), int(rng.integers(height)), 1, 1)
        at = Region(
            at.left, at.top, int(rng.integers(1, width - at.left + 1)), int(rng.integers(1, height - at.top + 1))
        )
        part = read_exr(tmp_path / "a.exr", region=at)
        np.testing.assert_array_equal(part.left, image.left[at.top : at.bottom, at.left : at.right])
        np.testing.assert_array_equal(part.right, image.right[at.top : at.bottom, at.left : at.right])
