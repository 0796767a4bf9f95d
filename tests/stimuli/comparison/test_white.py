"""Whose luminance is white: what is given, a chart's white patch, the display's white, the brightest region."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from stimuli.comparison import compare_regions, place_regions
from stimuli.comparison.regions_file import RegionsFile

CHART = "{kind: colorchecker, corners: [[40, 30], [330, 44], [318, 240], [28, 220]]}"
LAMP = "{kind: rectangle, name: lamp, box: [1, 1, 20, 20]}"
PLATE = "{kind: rectangle, name: table, box: [335, 100, 20, 60]}"
Write = Callable[..., RegionsFile]


@pytest.fixture
def white(regions_of: Write, chart_picture: Any) -> Callable[..., tuple[float, str]]:
    """Compare a chart beside a lamp of 500 cd/m² with itself; return the white's luminance and what is said of it."""
    picture = chart_picture()
    picture[:25, :25] = 500.0

    def compare(*entries: str, display: float | None = None, full: Any = None, **keys: object) -> tuple[float, str]:
        regions = regions_of(*entries, **keys)
        placed = place_regions(regions, picture.shape)
        found = compare_regions(picture, picture, placed, regions, display_white_cd_m2=display, photo_saturated=full)
        return found.table.white_XYZ[1], found.notes[0]

    return compare


def test_a_charts_white_comes_before_the_displays_and_what_is_brighter(white: Any) -> None:
    luminance, said = white(CHART, LAMP, display=600.0)
    assert 85 < luminance < 95
    assert said.endswith("'chart 19 white 9.5'")


def test_a_displays_white_comes_before_the_brightest_region(white: Any) -> None:
    assert white(PLATE, display=26.5) == (26.5, "white is icc-d50 at 26.5 cd/m², the display's")
    assert white(PLATE)[0] == 20.0
    # What outshines the display cannot be shown on it.
    assert white(PLATE, LAMP, display=26.5)[0] == 500.0


def test_what_is_given_comes_first(white: Any) -> None:
    assert white(CHART, LAMP, display=600.0, white_luminance_cd_m2=70)[0] == 70.0
    assert white(CHART, LAMP, display=600.0, white_region="lamp")[0] == 500.0


def test_a_saturated_patch_is_no_white(white: Any) -> None:
    full = np.zeros((270, 360), dtype=np.bool_)
    full[:, :80] = True  # the first column of patches, and the lamp
    luminance, said = white(CHART, full=full)
    assert luminance < 85
    assert "brightest region, 'chart 16 yellow'" in said
