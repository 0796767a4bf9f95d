"""Figures of regions: what they hold, for none, one and many."""

from __future__ import annotations

import numpy as np
import pytest

from runner.reports.comparison.figures import MOST_BARS, chromaticity_figure, delta_e_figure, luminance_figure
from stimuli.comparison import PairedArea, RegionTable
from stimuli.comparison.areas import AreaMean
from stimuli.comparison.table import region_table
from tests.choice import nightly

WHITE = np.array([96.42, 100.0, 82.49])
SQUARE = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])


def table(count: int, times: float = 1.03, saturated: float = 0.0) -> RegionTable:
    rng = np.random.default_rng(3)
    regions = [PairedArea(f"<region {place}>", "patch", SQUARE, SQUARE, "chart") for place in range(count)]
    colours = WHITE * rng.uniform(0.1, 0.9, (count, 3))
    photo = [AreaMean(400, colour, np.ones(3), np.eye(3) * 1e-4, saturated) for colour in colours]
    rendering = [AreaMean(400, times * colour + [0.1, 0, 0], np.ones(3), np.eye(3) * 1e-4, 0.0) for colour in colours]
    return region_table(regions, photo, rendering, WHITE)


@pytest.mark.parametrize(
    ("count", "saturated"), [(0, 0.0), (24, 1.0), *nightly((0, 1.0), (1, 0.0), (1, 1.0), (24, 0.0))]
)
def test_every_figure_stands_for_any_number_of_regions(count: int, saturated: float) -> None:
    one = table(count, saturated=saturated)
    for drawing in (luminance_figure(one, "L"), chromaticity_figure(one, "C"), delta_e_figure(one, 1.4, "E")):
        svg = drawing.svg
        assert svg.startswith("<svg")
        assert svg.rstrip().endswith("</svg>")
        assert "<region" not in svg


def test_what_the_figures_say() -> None:
    found = table(24, 1 / 1000)
    assert found.factor is not None
    luminances = luminance_figure(found, "L").svg
    assert f"rendering × {found.factor.mean_ratio:.4g}" in luminances
    assert "mathdefault" not in luminances
    assert "differences drawn" in chromaticity_figure(table(24), "C").svg
    assert "&lt;region 3&gt; (excluded)" in delta_e_figure(table(24, saturated=1.0), 1.4, "E").svg


@pytest.mark.nightly
def test_of_many_regions_those_that_differ_most_are_drawn() -> None:
    many = table(200)
    svg = delta_e_figure(many, 1.4, "E").svg
    order = sorted(range(200), key=lambda place: -many.rows[place].delta_e)
    drawn = [place for place in range(200) if f"&lt;region {place}&gt;" in svg]
    assert sorted(order[:MOST_BARS]) == drawn
