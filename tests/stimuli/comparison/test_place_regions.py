"""Regions files onto pictures: where areas lie, and every fault with its place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from documents import InputError
from stimuli.comparison import place_regions
from stimuli.comparison.areas import inside, window
from stimuli.comparison.regions import PlacedRegions, corner_pairs
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.verdict import Limits
from stimuli.errors import StimulusError

Write = Callable[..., RegionsFile]
SHAPE = (100, 200, 3)
CHART = "{kind: colorchecker, corners: [[10, 10], [180, 12], [178, 95], [12, 90]]}"


def pixels(placed: PlacedRegions, name: str) -> int:
    (region,) = [one for one in placed.regions if one.name == name]
    return int(inside(region.photo_px, *window(region.photo_px, SHAPE)).sum())


def test_every_kind_finds_its_place(regions_of: Write) -> None:
    regions = regions_of(
        CHART,
        "{kind: rectangle, name: box, box: [10, 20, 30, 40]}",
        "{kind: polygon, name: corner, points: [[0, 0], [20, 0], [0, 20]]}",
        "{kind: plate}",
        "{kind: plate, name: rimless, inner: 0.5}",
        "{kind: grid, name: g, rows: 2, columns: 4}",
    )
    placed = place_regions(regions, SHAPE)
    assert len(placed.regions) == 24 + 1 + 1 + 1 + 1 + 8
    assert pixels(placed, "box") == 30 * 40
    assert pixels(placed, "corner") == 20 * 19 / 2 or pixels(placed, "corner") == 20 * 21 / 2
    assert pixels(placed, "plate") == 100 * 200
    assert pixels(placed, "rimless") == 50 * 100
    assert pixels(placed, "g row 2 column 4") == 50 * 50
    assert [one.number for one in placed.regions[:24]] == list(range(1, 25))
    assert placed.regions[13].name == "chart 14 green"
    assert {one.name for one in placed.regions if one.sparkle} == {"plate", "rimless"}
    assert [chart.entry for chart in placed.charts] == ["chart"]
    assert all(one.rendering_px is one.photo_px for one in placed.regions if one.kind in ("rectangle", "polygon"))


def test_inner_shares_shrink_a_patch_about_its_centre(regions_of: Write) -> None:
    square = "corners: [[0, 0], [138, 0], [138, 90], [0, 90]]"
    half, whole = (
        place_regions(regions_of(f"{{kind: colorchecker, {square}, inner: {inner}}}"), SHAPE).regions[7].photo_px
        for inner in (0.5, 1.0)
    )
    np.testing.assert_allclose(half.mean(axis=0), whole.mean(axis=0))
    np.testing.assert_allclose(np.ptp(half, axis=0), np.ptp(whole, axis=0) / 2)


def test_shares_are_of_each_picture(regions_of: Write) -> None:
    regions = regions_of("{kind: rectangle, name: box, box: [0.1, 0.2, 0.3, 0.4]}", units="share")
    (box,) = place_regions(regions, SHAPE, (50, 400, 3)).regions
    np.testing.assert_allclose(box.photo_px[[0, 2]], [[20, 20], [80, 60]])
    np.testing.assert_allclose(box.rendering_px[[0, 2]], [[40, 10], [160, 30]])


def test_the_rendering_may_have_corners_of_its_own(regions_of: Write) -> None:
    regions = regions_of(
        "{kind: plate, corners: [[10, 10], [90, 10], [90, 90], [10, 90]],"
        " rendering_corners: [[1, 2], [41, 2], [41, 42], [1, 42]]}"
    )
    (apart,) = place_regions(regions, SHAPE, (50, 50, 3)).regions
    np.testing.assert_allclose(apart.rendering_px[0], [1, 2])
    (on_one_grid,) = place_regions(regions, SHAPE).regions
    np.testing.assert_allclose(on_one_grid.rendering_px, on_one_grid.photo_px)
    pairs = corner_pairs(regions, SHAPE, (50, 50, 3))
    assert pairs is not None
    np.testing.assert_allclose(pairs[0][2], [90, 90])
    np.testing.assert_allclose(pairs[1][2], [41, 42])
    assert corner_pairs(regions_of("{kind: plate}"), SHAPE, SHAPE) is None


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (
            "{kind: rectangle, name: box, box: [190, 20, 30, 40]}",
            "'box' reaches .* the photograph has 200 × 100",
        ),
        ("{kind: rectangle, name: box, box: [-1, 20, 30, 40]}", "reaches from"),
        ("{kind: polygon, name: bow, points: [[0, 0], [9, 9], [9, 0], [0, 9]]}", "'bow' crosses itself"),
        ("{kind: plate, corners: [[0, 0], [9, 9], [9, 0], [0, 9]]}", "crosses itself .*top left, top right"),
        ("{kind: plate, corners: [[0, 0], [9, 0], [2, 2], [0, 9]]}", "no convex quadrangle"),
        ("{kind: plate, name: chart 14 green}", "two regions 'chart 14 green'"),
    ],
)
def test_faults_in_outlines_are_told_at_their_line(regions_of: Write, entry: str, words: str) -> None:
    with pytest.raises(StimulusError, match=words) as caught:
        place_regions(regions_of(CHART, entry), SHAPE)
    (finding,) = caught.value.findings
    assert finding.file is not None
    assert finding.file.endswith("regions.yaml")
    assert finding.line == 4


def test_all_faults_are_told_at_once(regions_of: Write) -> None:
    bad = [f"{{kind: rectangle, name: box{n}, box: [190, 20, 30, 40]}}" for n in range(3)]
    with pytest.raises(StimulusError) as caught:
        place_regions(regions_of(*bad, white_region="nobody"), SHAPE)
    assert len(caught.value.findings) == 4
    assert "no region 'nobody'" in str(caught.value)


def test_limits_come_from_the_file(regions_of: Write) -> None:
    limits = regions_of("{kind: plate}", limits="{delta_e: 1.0, sparkle_relative: 0.03}").limits
    assert (limits.delta_e, limits.sparkle_relative, limits.sparkle_z) == (1.0, 0.03, 2.58)
    with pytest.raises(InputError, match=r"limits\.delta_e"):
        regions_of("{kind: plate}", limits="{delta_e: 0}")
    assert regions_of("{kind: plate}", limits="{delta_e: null}").limits == Limits()


PAGE = Path(__file__).parents[3] / "docs/regions.md"


def test_the_page_and_the_file_know_every_limit() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for name in Limits.model_fields:
        assert f"`{name}`" in page


def test_a_region_outside_the_rendering_is_told(regions_of: Write) -> None:
    regions = regions_of("{kind: rectangle, name: box, box: [90, 20, 30, 40]}")
    with pytest.raises(StimulusError, match="the rendering has 100 × 100"):
        place_regions(regions, SHAPE, (100, 100, 3))


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{kind: rectangel, name: a, box: [0, 0, 1, 1]}", "did you mean 'rectangle'"),
        ("{kind: rectangle, name: a, box: [0, 0, 1, 0]}", "a number above 0"),
        ("{kind: plate, inner: 1.5}", "above 0, 1 at most"),
        ("{kind: plate, colour: red}", "unknown key"),
        ("{kind: polygon, name: a, points: [[0, 0], [1, 1]]}", "holds 2 entries"),
        ("{kind: plate, corners: [[0, 0], [.nan, 0], [2, 2], [0, 9]]}", "finite"),
        ("{kind: grid, rows: 1000, columns: 1}", "100"),
    ],
)
def test_what_a_file_may_not_hold(regions_of: Write, entry: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        regions_of(entry)
