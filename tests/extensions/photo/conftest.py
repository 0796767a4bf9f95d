"""Photographs of a chart, drawn in perspective by a camera of known matrix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from devices.camera import ReferenceColours
from devices.chart import COLORCHECKER, perspective, project
from devices.colour import XYZ_from_xyY
from devices.readings import colorchecker_xyY

M = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]])
NAMES, XYY = colorchecker_xyY()
XYZ = XYZ_from_xyY(XYY) * 100
RGB = XYZ @ np.linalg.inv(M).T
CORNERS = np.array([[120.0, 90.0], [620.0, 130.0], [590.0, 455.0], [95.0, 410.0]])


@pytest.fixture
def reference() -> ReferenceColours:
    """XYZ of the chart's 24 patches, its white at about 90 cd/m²."""
    return ReferenceColours(XYZ, NAMES, "reference.csv")


@pytest.fixture
def true_rgb() -> np.ndarray:
    """What the camera sees of each patch, (24, 3)."""
    return RGB


@pytest.fixture
def photograph(true_rgb: np.ndarray) -> Callable[..., np.ndarray]:
    """Draw the chart between four corners, on black card and a grey table."""

    def draw(
        corners: np.ndarray = CORNERS,
        size: tuple[int, int] = (540, 720),
        noise: float = 0.0,
        rgb: np.ndarray = true_rgb,
        gap: float = COLORCHECKER.gap,
    ) -> np.ndarray:
        to_chart: np.ndarray = np.asarray(
            np.linalg.inv(perspective(COLORCHECKER.outline(), np.asarray(corners, float)))
        )
        x, y = np.meshgrid(np.arange(size[1]) + 0.5, np.arange(size[0]) + 0.5)
        at = project(to_chart, np.stack([x, y], axis=-1))
        pitch = 1 + COLORCHECKER.gap
        # A gap other than the layout's leaves the patches' centres where they are.
        cell, within = np.divmod(at + 0.5 * COLORCHECKER.gap, pitch)
        on_patch = np.all(np.abs(within / pitch - 0.5) < 0.5 / (1 + gap), axis=-1)
        on_patch &= np.all((cell >= 0) & (cell < [6, 4]), axis=-1)
        width, height = COLORCHECKER.size
        on_card = np.all((at > -0.5) & (at < [width + 0.5, height + 0.5]), axis=-1)
        number = np.clip(cell[..., 1] * 6 + cell[..., 0], 0, 23).astype(int)
        here = np.where(on_card[..., None], [0.012, 0.016, 0.012], [0.09, 0.14, 0.1])
        picture = np.where(on_patch[..., None], rgb[number], here)
        picture = picture + noise * np.random.default_rng(5).standard_normal(picture.shape)
        return picture.astype(np.float32)

    return draw


def write_reference(path: Path) -> Path:
    """Write the chart's patches, X,Y,Z,name."""
    rows = [",".join([*(repr(float(v)) for v in one), name]) for one, name in zip(XYZ, NAMES, strict=True)]
    path.write_text("X,Y,Z,name\n" + "\n".join(rows) + "\n")
    return path
