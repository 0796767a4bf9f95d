"""Cameras of known matrix that saw a chart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from devices.camera import Correspondences
from devices.colour import XYZ_from_xyY
from devices.readings import colorchecker_xyY

M = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]])


@pytest.fixture
def matrix() -> np.ndarray:
    """The true matrix (3, 3), in cd/m² for full scale."""
    return M


@pytest.fixture
def seen() -> Callable[..., Correspondences]:
    """A chart of 24 patches, white at about 90 cd/m², as a camera of `matrix` sees it."""

    def see(
        offset: tuple[float, float, float] = (0, 0, 0),
        noise: float = 0.0,
        seed: int = 1,
        times: dict[str, float] | None = None,
        rows: object = slice(None),
    ) -> Correspondences:
        names, xyY = colorchecker_xyY()
        XYZ = XYZ_from_xyY(xyY) * 100
        rgb = (XYZ - np.array(offset)) @ np.linalg.inv(M).T
        rgb *= 1 + noise * np.random.default_rng(seed).standard_normal(rgb.shape)
        for name, factor in (times or {}).items():
            rgb[names.index(name)] *= factor
        clipped = np.clip(rgb, None, 1.0)
        kept = np.arange(24)[rows]  # type: ignore[call-overload]  # a slice or numbers
        return Correspondences(
            clipped[kept], XYZ[kept], tuple(names[i] for i in kept), (rgb >= 0.995)[kept], "chart.csv"
        )

    return see
