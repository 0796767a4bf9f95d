"""The region table: the thesis's Table 5.2, planted differences, and every reason to leave a region out."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import XYZ_from_xyY, delta_e_2000, xyY_from_XYZ, xyz_to_lab
from stimuli.comparison import Evidence, Region, RegionTable, compare_regions, judge, place_regions
from stimuli.comparison.areas import AreaMean, inside, window
from stimuli.comparison.by_region import ComparedRegions
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.table import region_table
from stimuli.errors import StimulusError

Draw = Callable[..., NDArray[np.float64]]
Write = Callable[..., RegionsFile]
CHART = "{kind: colorchecker, corners: [[40, 30], [330, 44], [318, 240], [28, 220]]}"
WHITE = np.array([96.42, 100.0, 82.49])
SQUARE = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])


def area(XYZ: object, saturated: float = 0.0) -> AreaMean:
    return AreaMean(100, np.asarray(XYZ, dtype=np.float64), np.zeros(3), None, saturated)


def named(name: str) -> Region:
    return Region(name, "patch", SQUARE, SQUARE, "chart")


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
    factor = table.factor
    assert factor is not None
    assert factor.pearson is not None
    assert factor.pearson > 0.9  # "their high correlation", Figures 5.9 and 5.10
    assert factor.r2_as_rendered is not None
    assert factor.r2_mean_ratio is not None
    assert factor.r2_as_rendered < 0 < factor.r2_mean_ratio
    assert factor.mean_ratio == pytest.approx(np.mean([row.luminance_ratio or 0 for row in table.rows]))


def compared(photo: object, rendering: object, regions: RegionsFile, **more: object) -> ComparedRegions:
    one = np.asarray(photo)
    placed = place_regions(regions, one.shape)
    return compare_regions(one, np.asarray(rendering), placed, regions, **more)  # type: ignore[arg-type]  # keywords by name


def notes(table: RegionTable, limits_of: RegionsFile) -> list[str]:
    return [reason.sentence for reason in judge(Evidence(regions=table), limits_of.limits).having("noted")]


def test_three_percent_of_luminance_are_found_and_measured(chart_picture: Draw, regions_of: Write) -> None:
    regions = regions_of(CHART)
    table = compared(chart_picture(noise=0.02), 1.03 * chart_picture(noise=0.02, seed=2), regions).table
    factor = table.factor
    assert factor is not None
    assert factor.mean_ratio_se is not None
    # About 600 pixels of 2 % noise in 24 patches, twice: 0.024 %.
    assert factor.mean_ratio == pytest.approx(1 / 1.03, abs=0.001)
    assert 1e-4 < factor.mean_ratio_se < 5e-4
    (note,) = notes(table, regions)
    assert "luminances differ by a factor" in note
    assert "% brighter" in note
    assert all(row.luminance_ratio_se is not None for row in table.rows)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_chromaticity_shift_in_one_region_is_named(chart_picture: Draw, regions_of: Write, noise: float) -> None:
    regions = regions_of(CHART)
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
    regions = regions_of(CHART)
    photo, rendering = chart_picture(), chart_picture()
    at = window(place_regions(regions, photo.shape).regions[0].photo_px, photo.shape)
    rendering[at] *= 1.05
    (note,) = notes(compared(photo, rendering, regions).table, regions)
    assert "'chart 1 dark skin'" in note


def test_one_saturated_patch_is_left_out_and_said(chart_picture: Draw, regions_of: Write) -> None:
    regions, photo = regions_of(CHART), chart_picture()
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
    table = compared(picture, picture, regions_of(CHART), safe_luminance_cd_m2=(9.41, 50.0)).table
    for row in table.rows:
        outside = not 9.41 <= row.photo.luminance_cd_m2 <= 50.0
        assert bool(row.excluded) == outside
    reasons = {row.number: row.excluded[0] for row in table.excluded}
    assert "above the camera's safe zone" in reasons[19]
    assert "below" in reasons[24]


def test_scaling_is_undone_before_colours_are_compared(chart_picture: Draw, regions_of: Write) -> None:
    picture = chart_picture()
    for mode, want in (("absolute", False), ("mean_ratio", True), ("least_squares", True)):
        table = compared(1000 * picture, picture, regions_of(CHART, luminance=mode)).table
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
def test_standard_errors_are_those_of_repeated_pictures() -> None:
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
    at = window(place_regions(regions_of(CHART), photo.shape).regions[4].photo_px, photo.shape)
    rendering[at] = np.nan
    with pytest.raises(StimulusError, match="'chart 5 blue flower' holds "):
        compared(photo, rendering, regions_of(CHART))


def test_where_all_is_saturated_nothing_is_left_but_the_reasons(chart_picture: Draw, regions_of: Write) -> None:
    picture = chart_picture()
    found = compared(picture, picture, regions_of(CHART), photo_saturated=np.ones(picture.shape, dtype=np.bool_))
    assert found.table.compared == ()
    assert found.table.factor is None
    assert any("is not known" in sentence for sentence in found.notes)
    assert judge(Evidence(regions=found.table)).decision == "cannot say"


def test_progress_goes_through_both_pictures(chart_picture: Draw, regions_of: Write) -> None:
    done: list[tuple[int, int]] = []
    picture = chart_picture()
    compared(picture, picture, regions_of(CHART), rows_done=lambda rows, of: done.append((rows, of)))
    assert done == [(270, 540), (540, 540)]


def test_a_picture_does_not_differ_from_itself(chart_picture: Draw, regions_of: Write) -> None:
    regions, picture = regions_of(CHART, "{kind: plate}"), chart_picture(noise=0.02)
    table = compared(picture, picture, regions).table
    for row in table.rows:
        assert (row.delta_x, row.delta_y, row.delta_e, row.luminance_ratio) == (0, 0, 0, 1)
    verdict = judge(Evidence(regions=table), regions.limits)
    assert verdict.decision == "validated"
    assert {reason.outcome for reason in verdict.reasons} == {"passes"}


def test_a_difference_within_its_error_has_no_symmetric_error() -> None:
    same = [AreaMean(100, np.array([30.0, 32.0, 20.0]), np.zeros(3), np.eye(3), 0.0)]
    (row,) = region_table([named("a")], same, same, WHITE).rows
    assert (row.delta_e_se, row.delta_xy_se) == (None, None)
    assert row.delta_x_se is not None


def test_where_the_white_comes_from_is_said(chart_picture: Draw, regions_of: Write) -> None:
    picture = chart_picture()

    def said(**keys: object) -> tuple[str, float]:
        found = compared(picture, picture, regions_of(CHART, **keys))
        return found.notes[0], found.table.white_XYZ[1]

    assert said(white_luminance_cd_m2=120) == ("white is icc-d50 at 120 cd/m², given", 120)
    sentence, luminance = said(white_region="chart 20 neutral 8", white="d65")
    assert sentence.startswith("white is d65 at ")
    assert luminance < said()[1]
    assert "'chart 19 white 9.5'" in said()[0]
    found = compared(picture, picture, regions_of(CHART), white_XYZ=WHITE)
    assert found.notes == ()
    np.testing.assert_array_equal(found.table.white_XYZ, WHITE)


def test_a_chart_upside_down_in_one_picture_is_said(chart_picture: Draw, regions_of: Write) -> None:
    regions, upright = regions_of(CHART), chart_picture()
    turned = chart_picture([[318.0, 240.0], [28.0, 220.0], [40.0, 30.0], [330.0, 44.0]])
    with pytest.raises(StimulusError, match="lies upside down in the rendering") as caught:
        compared(upright, turned, regions)
    assert caught.value.findings[0].file == regions.file
    with pytest.raises(StimulusError, match="lies upside down in the photograph"):
        compared(turned, upright, regions)
