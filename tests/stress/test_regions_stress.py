"""Regions at the edges: 36 megapixels, ten thousand cells, outlines and colours at random, charts from anywhere."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from devices.chart import COLORCHECKER, WAYS, patch_quadrangles
from devices.colour import XYZ_from_xyY
from devices.readings import colorchecker_xyY
from stimuli.comparison import Evidence, Region, compare_regions, judge, place_regions, read_regions
from stimuli.comparison.areas import AreaMean, crosses_itself, inside, window
from stimuli.comparison.by_region import check_charts
from stimuli.comparison.regions import Chart
from stimuli.comparison.regions_file import MOST_AREAS
from stimuli.comparison.table import region_table
from stimuli.errors import StimulusError
from tests.stress.sheet import WHITE, Sheet

pytestmark = pytest.mark.stress


def test_nearly_as_many_cells_as_a_file_may_have_of_thirty_six_megapixels(tmp_path: Path) -> None:
    path = tmp_path / "regions.yaml"
    path.write_text("schema_version: 1\nregions:\n  - {kind: plate}\n  - {kind: grid, rows: 100, columns: 99}\n")
    regions = read_regions(path)
    placed = place_regions(regions, Sheet.shape)
    tracemalloc.start()
    table = compare_regions(Sheet(1.0), Sheet(1.03), placed, regions, white_XYZ=WHITE).table
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert MOST_AREAS - 100 < len(table.rows) == 9901
    assert sum(row.photo.pixels for row in table.rows[1:]) == table.rows[0].photo.pixels == 4912 * 7360
    assert table.factor is not None
    assert table.factor.mean_ratio == pytest.approx(1 / 1.03, rel=1e-6)
    assert len(judge(Evidence(regions=table)).having("noted")) == 1
    assert peak < 6e8


def test_random_outlines_never_lose_or_share_a_pixel() -> None:
    """A picture cut along random lines: the parts together have every pixel once."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        height, width = (int(side) for side in rng.integers(3, 200, 2))
        cuts = np.sort(rng.uniform(0, width, (4, 5)), axis=1)
        tops, bottoms = np.c_[np.zeros(4), cuts, np.full(4, width)][:2]
        seen = np.zeros((height, width), dtype=int)
        for left in range(6):
            outline = np.array(
                [[tops[left], 0], [tops[left + 1], 0], [bottoms[left + 1], height], [bottoms[left], height]]
            )
            at = window(outline, (height, width))
            seen[at] += inside(outline, *at)
        assert np.all(seen == 1)


def test_large_polygons() -> None:
    angle = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    radius = 2000.0 + 400.0 * (-1.0) ** np.arange(1000)
    star = np.asarray(
        np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius[:, None] * 0.75 + 2000, dtype=np.float64
    )
    assert not crosses_itself(star)
    at = window(star, (4000, 4000))
    area = 0.5 * abs(np.sum(star[:, 0] * np.roll(star[:, 1], -1) - star[:, 1] * np.roll(star[:, 0], -1)))
    # Along the outline, every pixel is either in or out.
    assert inside(star, *at).sum() == pytest.approx(area, rel=1e-3)
    star[[3, 500]] = star[[500, 3]]
    assert crosses_itself(star)


def test_any_colours_give_plain_numbers_or_a_reason() -> None:
    rng = np.random.default_rng(1)
    regions = [Region(str(n), "cell", np.zeros((4, 2)), np.zeros((4, 2)), "g") for n in range(5000)]
    sides = [
        [
            AreaMean(100, colour * size, np.ones(3), np.eye(3) * size**2 * 1e-6, float(full))
            for colour, size, full in zip(
                rng.normal(0.3, 0.5, (5000, 3)), 10.0 ** rng.uniform(-12, 12, 5000), rng.random(5000) < 0.1, strict=True
            )
        ]
        for _ in range(2)
    ]
    table = region_table(regions, sides[0], sides[1], WHITE, safe_luminance_cd_m2=(1e-6, 1e6))
    for row in table.compared:
        assert row.luminance_ratio is not None
        assert row.photo.luminance_cd_m2 > 0 < row.rendering.luminance_cd_m2
        numbers = [row.delta_x, row.delta_y, row.delta_xy, row.luminance_ratio, row.delta_e, row.S_L, row.S_C, row.S_H]
        assert np.all(np.isfinite(numbers))
    assert len(table.compared) + len(table.excluded) == 5000
    judge(Evidence(regions=table))


def test_charts_from_anywhere_any_way_round() -> None:
    """Random perspectives, cameras and noise: the way round is told each time, never a wrong one."""
    rng = np.random.default_rng(2)
    colours = XYZ_from_xyY(colorchecker_xyY()[1]) * 100
    ways = list(WAYS)
    for number in range(60):
        corners = np.array([[60.0, 60.0], [540.0, 60.0], [540.0, 400.0], [60.0, 400.0]]) + rng.uniform(-45, 45, (4, 2))
        camera = np.eye(3) + rng.normal(0, 0.12, (3, 3))
        picture = np.full((460, 600, 3), 15.0)
        for quadrangle, colour in zip(patch_quadrangles(corners, COLORCHECKER, 1.0), colours, strict=True):
            at = window(quadrangle, picture.shape)
            picture[at][inside(quadrangle, *at)] = colour @ camera.T
        picture *= 1 + 0.1 * rng.standard_normal(picture.shape[:2] + (1,))
        way = ways[number % len(ways)]
        given = np.empty_like(corners)
        given[list(WAYS[way])] = corners
        chart = Chart("chart", given, given, 0.5)
        if way:
            with pytest.raises(StimulusError, match=f"lies {way} in the photograph"):
                check_charts(picture, [chart], "photograph")
        else:
            assert check_charts(picture, [chart], "photograph") == ()
