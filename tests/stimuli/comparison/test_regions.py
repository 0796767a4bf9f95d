"""Regions: outlines, files, means of areas, and the table that compares them."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.colour import XYZ_from_xyY, delta_e_2000, xyY_from_XYZ, xyz_to_lab
from documents import InputError
from stimuli.comparison import Evidence, PairedArea, RegionTable, areas, compare_regions, judge, place_regions
from stimuli.comparison.areas import AreaMean, area_means, crosses_itself, inside, window
from stimuli.comparison.by_region import ComparedRegions
from stimuli.comparison.regions import PlacedRegions, corner_pairs
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.table import region_table
from stimuli.comparison.verdict import Limits
from stimuli.errors import StimulusError
from stimuli.pictures import rows
from tests.kept import known

# Which pixels lie in an outline, and outlines that cross themselves.

Corner = tuple[float, float]
# Not on pixel centres, where rounding decides; sides that pass through one are left out of the comparison.
places = st.floats(-3, 23).map(lambda x: round(x, 3) + 0.0001)


def plain_inside(outline: np.ndarray, x: float, y: float) -> bool | None:
    """The textbook's ray: the sides crossed on the way to the left; None on a side."""
    crossed = False
    for (x1, y1), (x2, y2) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if (y1 <= y) != (y2 <= y):
            side = x1 + (y - y1) * (x2 - x1) / (y2 - y1)
            if abs(side - x) < 1e-9:
                return None
            crossed ^= bool(side <= x)
    return crossed


@given(st.lists(st.tuples(places, places), min_size=3, max_size=8))
@settings(max_examples=12, deadline=None)
def test_every_pixel_is_told_as_by_the_plain_ray(points: list[Corner]) -> None:
    outline = np.array(points)
    got = inside(outline, slice(0, 20), slice(0, 20))
    for y in range(20):
        for x in range(20):
            assert plain_inside(outline, x + 0.5, y + 0.5) in (got[y, x], None)


@given(st.floats(0.1, 19.9), st.floats(0.1, 19.9), st.floats(0.1, 19.9))
@settings(max_examples=60, deadline=None)
def test_areas_that_share_an_edge_share_no_pixel(top: float, bottom: float, across: float) -> None:
    whole = slice(0, 20), slice(0, 20)
    left = inside(np.array([[0, 0], [top, 0], [bottom, 20], [0, 20.0]]), *whole)
    right = inside(np.array([[top, 0], [20, 0], [20, 20], [bottom, 20.0]]), *whole)
    assert np.all(left ^ right)
    upper = inside(np.array([[0, 0], [20, 0], [20, across], [0, across]]), *whole)
    lower = inside(np.array([[0, across], [20, across], [20, 20], [0, 20.0]]), *whole)
    assert np.all(upper ^ lower)


@pytest.mark.parametrize(
    ("points", "crosses"),
    [
        ([(0, 0), (4, 0), (4, 4), (0, 4)], False),
        ([(0, 0), (4, 4), (4, 0), (0, 4)], True),
        ([(0, 0), (4, 0), (2, 1), (0, 4)], False),  # dented
        ([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)], True),  # touches a side with a corner
        ([(0, 0), (4, 0), (2, 0), (0, 4)], True),  # goes back on itself
        ([(0, 0), (4, 0), (2, 0)], True),
        ([(0, 0), (4, 0), (4, 4), (1, 4), (1, -1), (0, 3)], True),
    ],
)
def test_outlines_that_cross_themselves_are_told(points: list[Corner], crosses: bool) -> None:
    outline = np.array(points, dtype=np.float64)
    assert crosses_itself(outline) is crosses
    assert crosses_itself(outline[::-1].copy()) is crosses
    assert crosses_itself(np.roll(outline, 1, axis=0)) is crosses


@given(
    st.tuples(st.integers(0, 20), st.integers(0, 20), st.integers(1, 9)),
    st.tuples(st.integers(0, 20), st.integers(0, 20)),
)
@settings(max_examples=60, deadline=None)
def test_a_side_through_centres_is_rounded_alike_by_both(one: tuple[int, int, int], other: tuple[int, int]) -> None:
    whole = slice(0, 20), slice(0, 20)
    top, bottom = one[0] + one[1] / one[2] / 2, other[0] + other[1] / 20
    left = inside(np.array([[-1, 0], [top, 0], [bottom, 20], [-1, 20.0]]), *whole)
    right = inside(np.array([[top, 0], [41, 0], [41, 20], [bottom, 20.0]]), *whole)
    assert np.all(left ^ right)


def test_a_pixel_belongs_if_its_centre_does() -> None:
    square = np.array([[0.4, 0.6], [2.5, 0.6], [2.5, 2.6], [0.4, 2.6]])
    rows, columns = window(square, (10, 10, 3))
    assert (rows, columns) == (slice(0, 3), slice(0, 3))
    np.testing.assert_array_equal(inside(square, rows, columns), [[0, 0, 0], [1, 1, 0], [1, 1, 0]])


# Regions files onto pictures: where areas lie, and every fault with its place.

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
    pairs = known(corner_pairs(regions, SHAPE, (50, 50, 3)))
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
    assert known(finding.file).endswith("regions.yaml")
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


PAGE = Path(__file__).parents[3] / "docs/compare.md"


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


# Means of areas: against one call over the whole, how sure they are, what is refused.

TRIANGLE = np.array([[3.0, 2.0], [60.0, 20.0], [10.0, 70.0]])
SQUARE = np.array([[0.0, 0.0], [64.0, 0.0], [64.0, 64.0], [0.0, 64.0]])


def test_bands_give_the_means_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.random.default_rng(2).gamma(2.0, 5.0, (80, 70, 3)).astype(np.float32)
    full = picture[..., 0] > 20
    mask = inside(TRIANGLE, slice(0, 80), slice(0, 70))
    whole = area_means(picture, [("all", TRIANGLE)], full)[0]
    monkeypatch.setattr(rows, "BAND_PIXELS", 300)
    got = area_means(picture, [("all", TRIANGLE)], full)[0]
    values = picture[mask].astype(np.float64)
    for one in (whole, got):
        assert one.pixels == mask.sum()
        np.testing.assert_allclose(one.XYZ, values.mean(axis=0), rtol=1e-14)
        np.testing.assert_allclose(one.sd_XYZ, values.std(axis=0, ddof=1), rtol=1e-13)
        assert one.saturated_share == full[mask].mean()
    np.testing.assert_allclose(known(got.covariance_XYZ), known(whole.covariance_XYZ), rtol=1e-10)


@pytest.mark.parametrize("outline", [SQUARE + [2, 9], SQUARE[:, ::-1] * [0.9, 1.1] + [3, 5], TRIANGLE])
def test_sums_of_cells_are_those_of_their_pixels(outline: np.ndarray) -> None:
    """Rows come a few at a time, and cells begin and end within them."""
    picture = np.random.default_rng(3).gamma(2.0, 5.0, (80, 70, 3)).astype(np.float32)
    sums = areas._Sums(outline, picture.shape)
    for start in range(sums.rows.start, sums.rows.stop, 7):
        band = slice(start, min(start + 7, sums.rows.stop))
        sums.add(band, picture[band], None)
    mask = inside(outline, sums.rows, sums.columns)
    light = np.where(mask[..., None], picture[sums.rows, sums.columns], 0.0).astype(np.float64)
    side = sums.cell_px
    for row, column in np.ndindex(sums.cells):
        cell = slice(row * side, (row + 1) * side), slice(column * side, (column + 1) * side)
        assert sums.cell_pixels[row, column] == mask[cell].sum()
        np.testing.assert_allclose(sums.cell_sums[:, row, column], light[cell].sum(axis=(0, 1)), rtol=1e-13)


class Counted:
    """A picture that counts the rows it is asked for."""

    def __init__(self, rows: int) -> None:
        self.shape = (rows, 64, 3)
        self.read = 0

    def __getitem__(self, rows: slice, /) -> np.ndarray:
        self.read += rows.stop - rows.start
        return np.ones((rows.stop - rows.start, 64, 3))


def test_only_rows_with_regions_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "BAND_PIXELS", 64 * 10)
    picture = Counted(1000)
    two = [("one", SQUARE + [0, 105]), ("two", SQUARE + [0, 801])]
    area_means(picture, two)
    assert picture.read == 2 * 64


@pytest.mark.parametrize("blurred", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_standard_errors_are_those_of_repeated_pictures(blurred: bool) -> None:
    from scipy.ndimage import uniform_filter

    rng = np.random.default_rng(8)
    light = 10.0 + np.linspace(0, 8, 64)[:, None, None]
    means, told = [], []
    for _ in range(150):
        noise = rng.standard_normal((64, 64, 3))
        picture = light + (uniform_filter(noise, (3, 3, 0), mode="wrap") if blurred else noise)
        (area,) = area_means(picture, [("all", SQUARE)])
        means.append(area.XYZ)
        told.append(np.diag(known(area.covariance_XYZ)))
    # 450 means: their standard deviation is known to 3.3 %, three times that is allowed. Means over cells of 8 pixels
    # of noise blurred over 3 scatter less by (1+4+6·9+4+1) / (9·8) along each axis, and so is the error told.
    ratio = np.sqrt(np.mean(told)) / np.std(means, axis=0).mean()
    assert ratio == pytest.approx(64 / 72 if blurred else 1.0, abs=0.1)


def test_what_cannot_be_averaged_is_refused() -> None:
    picture = np.ones((80, 70, 3))
    picture[40, 12, 1] = np.nan
    picture[40:42, 13, 2] = np.inf
    outlines = [("all", TRIANGLE), ("tiny", np.array([[1.0, 1.0], [3.0, 1.0], [3.0, 3.0]]))]
    with pytest.raises(StimulusError) as caught:
        area_means(picture, outlines, least_pixels=25, what="photograph")
    first, second = caught.value.findings
    assert first.message == "the region 'all' holds 3 pixels of the photograph that are no numbers"
    assert "'tiny' holds" in second.message
    assert "fewer than 25" in second.message


def test_float32_light_is_summed_in_float64() -> None:
    picture = np.full((1024, 512, 3), 0.1, dtype=np.float32)
    picture[0, 0] = 3e4
    outline = np.array([[0.0, 0.0], [512.0, 0.0], [512.0, 1024.0], [0.0, 1024.0]])
    (area,) = area_means(picture, [("all", outline)])
    np.testing.assert_allclose(area.XYZ, picture.astype(np.float64).mean(axis=(0, 1)), rtol=1e-14)


def test_small_areas_have_no_standard_error() -> None:
    picture = np.random.default_rng(1).uniform(1, 2, (64, 64, 3))
    (area,) = area_means(picture, [("small", SQUARE / 8)])
    assert area.covariance_XYZ is None


# The region table: the thesis's Table 5.2, planted differences, and every reason to leave a region out.

Draw = Callable[..., NDArray[np.float64]]

TABLE_CHART = "{kind: colorchecker, corners: [[40, 30], [330, 44], [318, 240], [28, 220]]}"
WHITE = np.array([96.42, 100.0, 82.49])
TABLE_SQUARE = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])


def area(XYZ: object, saturated: float = 0.0) -> AreaMean:
    return AreaMean(100, np.asarray(XYZ, dtype=np.float64), np.zeros(3), None, saturated)


def named(name: str) -> PairedArea:
    return PairedArea(name, "patch", TABLE_SQUARE, TABLE_SQUARE, "chart")


@pytest.mark.shared_data
@pytest.mark.parametrize("shutter", ["1/8", "1/15"])
def test_table_5_2_follows_from_its_own_columns(shared_data: Path, shutter: str) -> None:
    with (shared_data / "reference/table_5_2_macbeth_xyY.csv").open(encoding="utf-8", newline="") as file:
        printed = [row for row in csv.DictReader(file) if row["shutter_s"] == shutter]
    photo, simulation = (
        [area(XYZ_from_xyY([float(row[f"{side}_{key}"]) for key in "xyY"])) for row in printed]
        for side in ("photo", "simulation")
    )
    table = region_table([named(row["patch"]) for row in printed], photo, simulation, WHITE, luminance="mean_ratio")
    assert len(table.compared) == 14
    for row, want in zip(table.rows, printed, strict=True):
        # Two columns and their difference are rounded to 0.01 each: half of it, three times.
        assert abs(row.delta_x) == pytest.approx(float(want["delta_x"]), abs=0.015 + 1e-9)
        assert abs(row.delta_y) == pytest.approx(float(want["delta_y"]), abs=0.015 + 1e-9)
        # A distance is off by no more than the length of both columns' roundings, and by its own.
        assert row.delta_xy == pytest.approx(float(want["delta_xy"]), abs=0.01 * np.sqrt(2) + 0.005 + 1e-9)
        assert row.luminance_ratio == pytest.approx(float(want["photo_Y"]) / float(want["simulation_Y"]))
    factor = known(table.factor)
    assert known(factor.pearson) > 0.9  # "their high correlation", Figures 5.9 and 5.10
    assert known(factor.r2_as_rendered) < 0 < known(factor.r2_mean_ratio)
    assert factor.mean_ratio == pytest.approx(np.mean([row.luminance_ratio or 0 for row in table.rows]))


def compared(photo: object, rendering: object, regions: RegionsFile, **more: object) -> ComparedRegions:
    one = np.asarray(photo)
    placed = place_regions(regions, one.shape)
    return compare_regions(one, np.asarray(rendering), placed, regions, **more)  # type: ignore[arg-type]  # keywords by name


def notes(table: RegionTable, limits_of: RegionsFile) -> list[str]:
    return [reason.sentence for reason in judge(Evidence(regions=table), limits_of.limits).having("noted")]


def test_three_percent_of_luminance_are_found_and_measured(chart_picture: Draw, regions_of: Write) -> None:
    regions = regions_of(TABLE_CHART)
    table = compared(chart_picture(noise=0.02), 1.03 * chart_picture(noise=0.02, seed=2), regions).table
    factor = known(table.factor)
    # About 600 pixels of 2 % noise in 24 patches, twice: 0.024 %.
    assert factor.mean_ratio == pytest.approx(1 / 1.03, abs=0.001)
    assert 1e-4 < known(factor.mean_ratio_se) < 5e-4
    (note,) = notes(table, regions)
    assert "luminances differ by a factor" in note
    assert "% brighter" in note
    assert all(row.luminance_ratio_se is not None for row in table.rows)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_chromaticity_shift_in_one_region_is_named(chart_picture: Draw, regions_of: Write, noise: float) -> None:
    regions = regions_of(TABLE_CHART)
    photo, rendering = chart_picture(noise=noise), chart_picture(noise=noise, seed=2)
    green = place_regions(regions, photo.shape).regions[13]
    at = window(green.photo_px, photo.shape)
    mask = inside(green.photo_px, *at)
    xyY = xyY_from_XYZ(rendering[at][mask])
    rendering[at][mask] = XYZ_from_xyY(xyY + [0.002, 0.0, 0.0])
    table = compared(photo, rendering, regions).table
    (note,) = notes(table, regions)
    assert "'chart 14 green' is shifted in chromaticity" in note
    row = table.rows[13]
    assert row.delta_x == pytest.approx(0.002, abs=2e-5)
    assert row.delta_xy == pytest.approx(0.002, abs=2e-5)


def test_a_region_of_other_luminance_is_named(chart_picture: Draw, regions_of: Write) -> None:
    regions = regions_of(TABLE_CHART)
    photo, rendering = chart_picture(), chart_picture()
    at = window(place_regions(regions, photo.shape).regions[0].photo_px, photo.shape)
    rendering[at] *= 1.05
    (note,) = notes(compared(photo, rendering, regions).table, regions)
    assert "'chart 1 dark skin'" in note


def test_one_saturated_patch_is_left_out_and_said(chart_picture: Draw, regions_of: Write) -> None:
    regions, photo = regions_of(TABLE_CHART), chart_picture()
    white = place_regions(regions, photo.shape).regions[18]
    at = window(white.photo_px, photo.shape)
    flags = np.zeros(photo.shape, dtype=np.bool_)
    flags[at][: (at[0].stop - at[0].start) // 2, :, 1] = True
    clipped = photo.copy()
    clipped[at] *= 0.8
    table = compared(clipped, photo, regions, photo_saturated=flags).table
    (row,) = table.excluded
    assert row.name == "chart 19 white 9.5"
    assert 0.4 < row.photo.saturated_share < 0.6
    assert "saturated in the photograph" in row.excluded[0]
    assert table.mean_delta_e == pytest.approx(0, abs=1e-9)
    (note,) = notes(table, regions)
    assert "'chart 19 white 9.5'" in note
    assert judge(Evidence(regions=table)).decision == "validated"


def test_the_cameras_safe_zone_counts(chart_picture: Draw, regions_of: Write) -> None:
    picture = chart_picture()
    table = compared(picture, picture, regions_of(TABLE_CHART), safe_luminance_cd_m2=(9.41, 50.0)).table
    for row in table.rows:
        outside = not 9.41 <= row.photo.luminance_cd_m2 <= 50.0
        assert bool(row.excluded) == outside
    reasons = {row.number: row.excluded[0] for row in table.excluded}
    assert "above the camera's safe zone" in reasons[19]
    assert "below" in reasons[24]


def test_scaling_is_undone_before_colours_are_compared(chart_picture: Draw, regions_of: Write) -> None:
    picture = chart_picture()
    for mode, want in (("absolute", False), ("mean_ratio", True), ("least_squares", True)):
        table = compared(1000 * picture, picture, regions_of(TABLE_CHART, luminance=mode)).table
        assert table.scaled_by == pytest.approx(1000 if want else 1)
        assert (table.mean_delta_e is not None and table.mean_delta_e < 1e-9) is want
        assert table.rows[3].luminance_ratio == pytest.approx(1000)


def test_colours_are_those_of_the_means() -> None:
    rng = np.random.default_rng(4)
    photo, rendering = rng.uniform(5, 80, (2, 6, 3))
    table = region_table(
        [named(str(n)) for n in range(6)], [area(c) for c in photo], [area(c) for c in rendering], WHITE
    )
    want = delta_e_2000(xyz_to_lab(photo, WHITE), xyz_to_lab(rendering, WHITE))
    np.testing.assert_allclose([row.delta_e for row in table.rows], want, rtol=1e-12)
    for row in table.rows:
        terms = np.array([row.delta_L / row.S_L, row.delta_C / row.S_C, row.delta_H / row.S_H])
        assert row.delta_e == pytest.approx(np.sqrt(terms @ terms + row.R_T * terms[1] * terms[2]))
        assert row.delta_xy == pytest.approx(np.hypot(row.delta_x, row.delta_y))


@pytest.mark.nightly
def test_table_standard_errors_are_those_of_repeated_pictures() -> None:
    rng = np.random.default_rng(5)
    spread = 0.01 * np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.0], [0.0, 0.0, 0.25]])
    photo, rendering = np.array([30.0, 32.0, 20.0]), np.array([33.0, 34.0, 25.0])
    keys = ("delta_x", "delta_y", "delta_xy", "luminance_ratio", "delta_e")
    noise = rng.multivariate_normal(np.zeros(3), spread, (2, 4000))
    noise[:, 0] = 0
    sides = [
        [AreaMean(100, colour + one, np.zeros(3), spread, 0.0) for one in draws]
        for colour, draws in zip((photo, rendering), noise, strict=True)
    ]
    rows = region_table([named("a")] * 4000, sides[0], sides[1], WHITE).rows
    got = [[getattr(row, key) for key in keys] for row in rows]
    told = [getattr(rows[0], f"{key}_se") for key in keys]
    # 4000 draws: a standard deviation to 1.1 %.
    np.testing.assert_allclose(told, np.std(got, axis=0), rtol=0.04)


def test_light_that_is_none_is_left_out_and_json_stays_plain() -> None:
    table = region_table([named("a")], [area([0, 0, 0])], [area([1, 2, 3])], WHITE)
    assert table.excluded[0].excluded == ("it holds no light in the photograph",)
    assert table.factor is None
    assert table.mean_delta_e is None
    json.dumps(table.to_json(), allow_nan=False)
    dark = region_table([named("a")], [area([1, 2, 3])], [area([0, 0, 0])], WHITE)
    assert dark.rows[0].excluded == ("it holds no light in the rendering",)
    json.dumps(dark.to_json(), allow_nan=False)


def test_pixels_that_are_no_numbers_are_refused_by_region(chart_picture: Draw, regions_of: Write) -> None:
    photo, rendering = chart_picture(), chart_picture()
    at = window(place_regions(regions_of(TABLE_CHART), photo.shape).regions[4].photo_px, photo.shape)
    rendering[at] = np.nan
    with pytest.raises(StimulusError, match="'chart 5 blue flower' holds "):
        compared(photo, rendering, regions_of(TABLE_CHART))


def test_where_all_is_saturated_nothing_is_left_but_the_reasons(chart_picture: Draw, regions_of: Write) -> None:
    picture = chart_picture()
    found = compared(picture, picture, regions_of(TABLE_CHART), photo_saturated=np.ones(picture.shape, dtype=np.bool_))
    assert found.table.compared == ()
    assert found.table.factor is None
    assert any("is not known" in sentence for sentence in found.notes)
    assert judge(Evidence(regions=found.table)).decision == "cannot say"


def test_progress_goes_through_both_pictures(chart_picture: Draw, regions_of: Write) -> None:
    done: list[tuple[int, int]] = []
    picture = chart_picture()
    compared(picture, picture, regions_of(TABLE_CHART), rows_done=lambda rows, of: done.append((rows, of)))
    assert done == [(270, 540), (540, 540)]


def test_a_difference_within_its_error_has_no_symmetric_error() -> None:
    same = [AreaMean(100, np.array([30.0, 32.0, 20.0]), np.zeros(3), np.eye(3), 0.0)]
    (row,) = region_table([named("a")], same, same, WHITE).rows
    assert (row.delta_e_se, row.delta_xy_se) == (None, None)
    assert row.delta_x_se is not None


def test_where_the_white_comes_from_is_said(chart_picture: Draw, regions_of: Write) -> None:
    picture = chart_picture()

    def said(**keys: object) -> tuple[str, float]:
        found = compared(picture, picture, regions_of(TABLE_CHART, **keys))
        return found.notes[0], found.table.white_XYZ[1]

    assert said(white_luminance_cd_m2=120) == ("white is icc-d50 at 120 cd/m², given", 120)
    sentence, luminance = said(white_region="chart 20 neutral 8", white="d65")
    assert sentence.startswith("white is d65 at ")
    assert luminance < said()[1]
    assert "'chart 19 white 9.5'" in said()[0]
    found = compared(picture, picture, regions_of(TABLE_CHART), white_XYZ=WHITE)
    assert found.notes == ()
    np.testing.assert_array_equal(found.table.white_XYZ, WHITE)


def test_a_chart_upside_down_in_one_picture_is_said(chart_picture: Draw, regions_of: Write) -> None:
    regions, upright = regions_of(TABLE_CHART), chart_picture()
    turned = chart_picture([[318.0, 240.0], [28.0, 220.0], [40.0, 30.0], [330.0, 44.0]])
    with pytest.raises(StimulusError, match="lies upside down in the rendering") as caught:
        compared(upright, turned, regions)
    assert caught.value.findings[0].file == regions.file
    with pytest.raises(StimulusError, match="lies upside down in the photograph"):
        compared(turned, upright, regions)
