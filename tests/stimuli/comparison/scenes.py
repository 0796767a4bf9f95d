"""Pictures with known differences, and the command on them."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from devices.chart import COLORCHECKER, perspective, project
from devices.colour import XYZ_from_xyY
from devices.readings import colorchecker_xyY
from documents.arrays import Floats32
from stimuli.comparison.alignment import Alignment
from stimuli.pictures import StereoImage, write_exr

Cyclopean = Callable[..., CompletedProcess[str]]

ROOT = Path(__file__).parents[3]
PLATE = ROOT / "configs" / "regions" / "plate.yaml"
RIG = ROOT / "configs" / "rigs" / "asus_vg248qe_3dvision.yaml"
SIZE = (240, 180)
CORNERS = np.array([[20.0, 18.0], [222.0, 22.0], [218.0, 160.0], [16.0, 154.0]])
CHART = """\
schema_version: 1
regions:
  - {kind: colorchecker, name: chart, corners: [[20, 18], [222, 22], [218, 160], [16, 154]], inner: 0.6}
"""
PATCHES, _ = colorchecker_xyY()


@cache
def spots(
    dx: float = 0.0,
    dy: float = 0.0,
    angle_deg: float = 0.0,
    *,
    size: tuple[int, int] = SIZE,
    count: int = 900,
    seed: int = 0,
    gain: float = 1.0,
    amplitude: float = 300.0,
    sd_px: float = 0.9,
) -> Floats32:
    """Return a plate of Gaussian sparkles on 20 cd/m², XYZ (height, width, 3), moved and turned about its middle.

    More sparkles are the same ones and others. Angles are clockwise. The picture is kept, and to be read only.
    """
    rng = np.random.default_rng(seed)
    width, height = size
    places = rng.uniform([-30, -30], [width + 30, height + 30], (100_000, 2))[:count]
    light = amplitude * rng.lognormal(0.0, 0.6, 100_000)[:count]
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    at = (places - middle) @ np.array([[c, s], [-s, c]]) + middle + (dx, dy)
    plane = np.full((height, width), 20.0)
    for start in range(0, count, 2000):
        part = slice(start, start + 2000)
        across, down = (
            np.diff(ndtr((np.arange(length + 1) - 0.5 - at[part, axis, None]) / sd_px), axis=1)
            for axis, length in ((0, width), (1, height))
        )
        plane += (down * light[part, None]).T @ across
    picture = coloured(gain * plane)
    picture.setflags(write=False)
    return picture


few = partial(spots, size=(180, 135), count=506)  # the same plate cut smaller, where its size is not what is tested


def coloured(luminance: NDArray[np.floating]) -> Floats32:
    """Return a luminance in the colour of D50, XYZ."""
    return np.asarray(luminance[..., None] * np.array([0.964, 1.0, 0.825]), dtype=np.float32)


def patch_XYZ() -> NDArray[np.float64]:
    """Return the chart's patches (24, 3), white at about 90 cd/m²."""
    _, xyY = colorchecker_xyY()
    return np.asarray(XYZ_from_xyY(xyY) * 100)


def chart(
    XYZ: NDArray[np.float64] | None = None,
    corners: NDArray[np.float64] = CORNERS,
    size: tuple[int, int] = SIZE,
    noise: float = 0.002,
    seed: int = 5,
) -> Floats32:
    """Draw a chart of patches (24, 3) between its corners, without stairs at the edges, on a textured table."""
    XYZ = patch_XYZ() if XYZ is None else XYZ
    picture = _shares(tuple(np.ravel(corners).tolist()), size) @ np.vstack([XYZ, [2.0, 2.1, 1.7]])
    rough = np.random.default_rng(seed).standard_normal((size[1], size[0], 1))
    return np.asarray(picture * (1 + noise * rough), dtype=np.float32)


@cache
def _shares(corners: tuple[float, ...], size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the share of each pixel (height, width, 25) that each patch of a chart between corners covers, or none."""
    outline = perspective(COLORCHECKER.outline(), np.reshape(corners, (4, 2)))
    to_chart = np.asarray(np.linalg.inv(outline))
    fine = 4
    x, y = np.meshgrid((np.arange(size[0] * fine) + 0.5) / fine, (np.arange(size[1] * fine) + 0.5) / fine)
    at = project(to_chart, np.stack([x, y], axis=-1))
    cell, within = np.divmod(at, 1 + COLORCHECKER.gap)
    on_patch = np.all(within < 1, axis=-1) & np.all((cell >= 0) & (cell < [6, 4]), axis=-1)
    number = np.where(on_patch, cell[..., 1] * 6 + cell[..., 0], 24).astype(int)
    number = number.reshape(size[1], fine, size[0], fine)
    return np.stack([(number == patch).mean(axis=(1, 3)) for patch in range(25)], axis=-1)


def written(path: Path, left: Floats32, right: Floats32 | None = None) -> Path:
    """Write a picture, or a pair, as OpenEXR of XYZ."""
    write_exr(path, StereoImage.flat(left) if right is None else StereoImage(left, right))
    return path


def lies(
    residual_px: float | None,
    shift_px: tuple[float, float] = (0.0, 0.0),
    shift_se_px: tuple[float, float] | None = None,
    rotation_deg: float = 0.0,
) -> Alignment:
    """Return how a rendering lies; all but what is named says nothing."""
    return Alignment(np.eye(3), "shift", shift_px, shift_se_px, rotation_deg, None, 1.0, residual_px, 0, 0, moved=False)


def compared(cyclopean: Cyclopean, *words: object, expect: int | None = 0) -> dict[str, Any]:
    """Run the command with --json, which must end with ``expect``, and return what it prints."""
    told = cyclopean("compare", *words, "--json", expect=expect)
    found = json.loads(told.stdout)
    assert isinstance(found, dict)
    return found


def said(found: dict[str, Any], outcome: str) -> list[str]:
    """Return the sentences of the verdict's reasons of one outcome."""
    return [reason["said"] for reason in found["verdict"]["reasons"] if reason["outcome"] == outcome]
