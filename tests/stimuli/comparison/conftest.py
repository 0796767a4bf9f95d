"""A ColorChecker on a grey table, as a photograph and as its rendering; regions files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.chart import COLORCHECKER, patch_quadrangles
from devices.colour import XYZ_from_xyY
from devices.readings import colorchecker_xyY
from documents.arrays import Floats
from stimuli.comparison import read_regions
from stimuli.comparison.areas import inside, window
from stimuli.comparison.regions_file import RegionsFile

CORNERS = [[40.0, 30.0], [330.0, 44.0], [318.0, 240.0], [28.0, 220.0]]
SHAPE = (270, 360, 3)

Write = Callable[..., RegionsFile]
Draw = Callable[..., NDArray[np.float64]]


@pytest.fixture
def regions_of(tmp_path: Path) -> Write:
    """Write a regions file of some entries, and read it."""

    def write(*entries: str, **keys: object) -> RegionsFile:
        lines = ["schema_version: 1", *(f"{key}: {value}" for key, value in keys.items()), "regions:"]
        path = tmp_path / "regions.yaml"
        path.write_text("\n".join([*lines, *(f"  - {entry}" for entry in entries)]) + "\n", encoding="utf-8")
        return read_regions(path)

    return write


@pytest.fixture
def chart_picture() -> Draw:
    """Draw the chart in XYZ, its white at 90 cd/m², between four corners."""

    def draw(corners: object = CORNERS, noise: float = 0.0, seed: int = 1) -> NDArray[np.float64]:
        picture = np.full(SHAPE, 20.0)
        colours = XYZ_from_xyY(colorchecker_xyY()[1]) * 100
        for quadrangle, colour in zip(patch_quadrangles(as_floats(corners), COLORCHECKER, 1.0), colours, strict=True):
            at = window(quadrangle, SHAPE)
            picture[at][inside(quadrangle, *at)] = colour
        rng = np.random.default_rng(seed)
        return np.asarray(picture * (1.0 + noise * rng.standard_normal((*SHAPE[:2], 1))))

    return draw


def as_floats(corners: object) -> Floats:
    return np.asarray(corners, dtype=np.float64)
