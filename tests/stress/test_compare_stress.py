"""Comparisons and their regions at the edges: 36 megapixels, ten thousand cells, many shifts and turns."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from devices.chart import COLORCHECKER, WAYS, patch_quadrangles
from devices.colour import XYZ_from_xyY
from devices.readings import colorchecker_xyY
from documents import InputError
from stimuli.comparison import Evidence, PairedArea, compare_regions, judge, place_regions, read_regions
from stimuli.comparison.areas import AreaMean, crosses_itself, inside, window
from stimuli.comparison.by_region import check_charts
from stimuli.comparison.regions import Chart
from stimuli.comparison.regions_file import MOST_AREAS
from stimuli.comparison.registering import align
from stimuli.comparison.table import region_table
from stimuli.errors import StimulusError
from stimuli.pictures import RowFile
from tests.kept import known
from tests.stimuli.comparison.scenes import PLATE, RIG, spots, written
from tests.stress.memory import command_alone
from tests.stress.sheet import WHITE, Sheet

pytestmark = pytest.mark.stress


# Comparisons pressed to their edges: 36 megapixels within 2 GB, many shifts and turns, pictures at random.
def test_thirty_six_megapixels_in_two_gigabytes(tmp_path: Path) -> None:
    """A pair as large as a D800's pictures, with page, both maps and sparkle; shifted, every row is interpolated.

    The right picture is the left one three pixels aside.
    """
    shift_px = 0.4
    tile = spots(size=(736, 491), count=4000)
    moved = spots(shift_px, size=(736, 491), count=4000)
    files = []
    for name, one in (("a", tile), ("b", moved)):
        whole = np.tile(one, (10, 10, 1))
        # Tiles alone would fit at many shifts: light falls off, and a coarse pattern tells them apart.
        coarse = np.random.default_rng(4).uniform(0.6, 1.4, (10, 10))
        for row in range(10):
            for column in range(10):
                whole[row * 491 : (row + 1) * 491, column * 736 : (column + 1) * 736] *= np.float32(coarse[row, column])
        files.append(written(tmp_path / f"{name}.exr", whole, np.roll(whole, 3, axis=1)))
    del whole
    words = ["compare", *map(str, files), "--regions", str(PLATE), "--rig", str(RIG), "-o", "o.html", "--json"]
    said, _, peak_mb = command_alone(*words, cwd=tmp_path)
    assert peak_mb * 2**20 <= 2e9
    found = json.loads(said)
    assert len(found["eyes"]) == 2
    for eye in found["eyes"].values():
        assert eye["registration"]["shift_px"] == pytest.approx([shift_px, 0.0], abs=0.02)


@pytest.mark.parametrize("seed", range(40))
def test_any_shift_and_turn_is_found_or_refused(seed: int) -> None:
    """Never a wrong place: what comes back is right to a twentieth of a pixel, or an error says that it is unknown."""
    rng = np.random.default_rng(seed)
    dx, dy = rng.uniform(-40, 40, 2)
    angle = float(rng.choice([0.0, rng.uniform(-1, 1), rng.uniform(-45, 45)]))
    noise = float(rng.choice([0.0, 0.02, 0.2]))
    pair = [
        spots(seed=seed, size=(320, 260)),
        spots(dx, dy, angle, seed=seed, size=(320, 260), gain=rng.uniform(0.1, 9)),
    ]
    noisy = [np.maximum(one * (1 + noise * rng.standard_normal(one.shape)), 0).astype(np.float32) for one in pair]
    try:
        found = align(RowFile.of(noisy[0]), RowFile.of(noisy[1]), "auto")
    except InputError:
        assert noise > 0.1 or abs(angle) > 20 or np.hypot(dx, dy) > 30
        return
    allowed = 0.05 if noise < 0.1 else 0.2
    assert found.shift_px == pytest.approx((dx, dy), abs=allowed)
    assert found.rotation_deg == pytest.approx(angle, abs=0.05)
    assert known(found.residual_px) < (0.1 if noise < 0.1 else 0.25)


@pytest.mark.parametrize("seed", range(30))
def test_nothing_in_common_is_refused(seed: int) -> None:
    one, two = spots(seed=seed, size=(320, 260)), spots(seed=seed + 100, size=(320, 260))
    with pytest.raises(InputError):
        align(RowFile.of(one), RowFile.of(two), "auto")


# Regions at the edges: 36 megapixels, ten thousand cells, outlines and colours at random, charts from anywhere.
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
    assert known(table.factor).mean_ratio == pytest.approx(1 / 1.03, rel=1e-6)
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
    regions = [PairedArea(str(n), "cell", np.zeros((4, 2)), np.zeros((4, 2)), "g") for n in range(5000)]
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
