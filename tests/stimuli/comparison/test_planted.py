"""Differences that were planted come back: found, named and measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.camera import CameraModel, Exposure, write_camera
from devices.colour import XYZ_from_xyY, xyY_from_XYZ
from stimuli.develop import CameraImage, write_camera_exr
from tests.stimuli.comparison.scenes import (
    CHART,
    PATCHES,
    PLATE,
    RIG,
    Cyclopean,
    chart,
    compared,
    few,
    patch_XYZ,
    said,
    spots,
    written,
)
from tests.stimuli.develop.dng import exposure_tags, write_dng


@pytest.fixture
def chart_file(tmp_path: Path) -> Path:
    (tmp_path / "chart.yaml").write_text(CHART, encoding="utf-8")
    return tmp_path / "chart.yaml"


def test_a_rendering_beside_itself_differs_by_nothing(tmp_path: Path, cyclopean: Cyclopean, chart_file: Path) -> None:
    for picture, regions in ((few(), PLATE), (chart(), chart_file)):
        file = written(tmp_path / "a.exr", picture)
        found = compared(cyclopean, file, file, "--regions", regions, "--rig", RIG)
        one = found["eyes"]["both"]
        assert found["decision"] == "validated"
        white = "the display's" if regions == PLATE else "that of the chart's white patch, 'chart 19 white 9.5'"
        assert one["said"][0].endswith(white)
        assert not one["registration"]["moved"]
        assert one["registration"]["residual_px"] == 0
        for sums in (one["per_pixel"], one["as_seen"]):
            assert sums["largest"] == sums["mean"] == 0
        for row in one["regions"]["rows"]:
            assert (row["delta_e"], row["delta_xy"], row["luminance_ratio"]) == (0, 0, 1)
        for area in one["sparkle"]:
            assert all(pair["relative"] == 0 for pair in area["pairs"])


def test_four_tenths_of_a_pixel(tmp_path: Path, cyclopean: Cyclopean) -> None:
    files = written(tmp_path / "a.exr", few()), written(tmp_path / "b.exr", few(dx=0.4))
    found = compared(cyclopean, *files, "--regions", PLATE, "--rig", RIG)
    lies = found["eyes"]["both"]["registration"]
    assert lies["shift_px"] == pytest.approx([0.4, 0.0], abs=0.02)
    assert lies["residual_px"] < 0.1
    assert any("(0.4" in line and "px beside" in line for line in said(found, "noted"))
    assert found["decision"] == "validated"
    told = cyclopean("compare", *files, "--regions", PLATE, "--register", "none", expect=2)
    assert "lie 0.4 px apart" in told.stderr
    assert told.stderr.count("\n") == 1


@pytest.mark.parametrize("angle_deg", [0.1, pytest.param(25.0, marks=pytest.mark.nightly)])
def test_a_turned_plate(tmp_path: Path, cyclopean: Cyclopean, angle_deg: float) -> None:
    regions = tmp_path / "middle.yaml"
    text = "schema_version: 1\nregions:\n  - {kind: plate, corners: [[60, 45], [180, 45], [180, 135], [60, 135]]}\n"
    regions.write_text(text, encoding="utf-8")
    files = written(tmp_path / "a.exr", spots()), written(tmp_path / "b.exr", spots(3.0, -2.0, angle_deg))
    found = compared(cyclopean, *files, "--regions", regions)
    lies = found["eyes"]["both"]["registration"]
    assert lies["rotation_deg"] == pytest.approx(angle_deg, abs=0.01)
    assert lies["shift_px"] == pytest.approx([3.0, -2.0], abs=0.02)
    assert lies["residual_px"] < 0.05
    assert any("turned by" in line for line in said(found, "noted"))
    assert found["eyes"]["both"]["per_pixel"]["mean"] < 0.3


@pytest.mark.nightly
def test_three_percent_of_luminance(tmp_path: Path, cyclopean: Cyclopean, chart_file: Path) -> None:
    one, two = written(tmp_path / "a.exr", chart()), written(tmp_path / "b.exr", chart(1.03 * patch_XYZ(), seed=6))
    found = compared(cyclopean, one, two, "--regions", chart_file)
    factor = found["eyes"]["both"]["regions"]["factor"]
    assert factor["mean_ratio"] == pytest.approx(1 / 1.03, abs=1e-3)
    assert factor["least_squares"] == pytest.approx(1 / 1.03, abs=1e-3)
    assert any(
        "the rendering 2.99 % brighter" in line or "the rendering 3 % brighter" in line for line in said(found, "noted")
    )
    undone = compared(cyclopean, one, two, "--regions", chart_file, "--luminance", "mean_ratio")
    table = undone["eyes"]["both"]["regions"]
    assert table["mean_delta_e"] < 0.1 < found["eyes"]["both"]["regions"]["mean_delta_e"]


@pytest.mark.nightly
def test_two_thousandths_of_chromaticity_in_one_region(tmp_path: Path, cyclopean: Cyclopean, chart_file: Path) -> None:
    XYZ = patch_XYZ()
    shifted = xyY_from_XYZ(XYZ[13]) + [0.0012, 0.0016, 0.0]
    XYZ[13] = XYZ_from_xyY(shifted)
    one, two = written(tmp_path / "a.exr", chart()), written(tmp_path / "b.exr", chart(XYZ, seed=6))
    found = compared(cyclopean, one, two, "--regions", chart_file)
    row = found["eyes"]["both"]["regions"]["rows"][13]
    assert row["name"] == f"chart 14 {PATCHES[13]}"
    assert (row["delta_x"], row["delta_y"]) == pytest.approx((0.0012, 0.0016), abs=1e-4)
    named = [line for line in said(found, "noted") if "shifted in chromaticity" in line]
    assert len(named) == 1
    assert row["name"] in named[0]


@pytest.mark.nightly
def test_five_percent_more_sparkle(tmp_path: Path, cyclopean: Cyclopean) -> None:
    one, two = (spots(size=(400, 300), count=n, amplitude=500.0, sd_px=0.8) for n in (1500, 1575))
    files = written(tmp_path / "a.exr", one), written(tmp_path / "b.exr", two)
    found = compared(cyclopean, *files, "--regions", PLATE)
    (area,) = found["eyes"]["both"]["sparkle"]
    density, width, contrast = area["pairs"]
    # Each has its own error, Poisson's; the difference that of those that one alone has.
    for side in ("photo", "rendering"):
        count = density[side] * area["pixels"] / 1e6
        assert density[f"{side}_se"] / density[side] == pytest.approx(count**-0.5, rel=1e-6)
    assert density["difference_se"] < 0.4 * density["photo_se"]
    assert density["relative"] == pytest.approx(0.05, abs=0.01)
    assert abs(width["relative"]) < 0.02
    assert abs(contrast["relative"]) < 0.02
    assert any(line.startswith("sparkle density on 'plate'") and "% more" in line for line in said(found, "noted"))


@pytest.mark.nightly
def test_a_region_too_small_to_be_seen(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """Squares of 6 px, lighter and darker by turns, cancel from five metres away; one by itself does not."""
    plate = spots()
    sign = (np.indices((180, 240)) // 6).sum(axis=0)
    files = (
        written(tmp_path / "a.exr", plate),
        written(tmp_path / "b.exr", plate * (1 + 0.1 * (-1.0) ** sign[..., None])),
    )
    regions = tmp_path / "r.yaml"
    box = "  - {kind: rectangle, name: square, box: [120, 60, 6, 6]}\n"
    regions.write_text(PLATE.read_text(encoding="utf-8") + box, encoding="utf-8")
    words = (*files, "--regions", regions, "--rig", RIG)
    far = compared(cyclopean, *words, "--distance-mm", 5000, expect=None)
    noted = [line for line in said(far, "noted") if line.startswith("region 'square' differs by")]
    assert len(noted) == 1
    assert "it cancels with what is beside" in noted[0]
    near = compared(cyclopean, *words, "--distance-mm", 300, expect=1)
    assert any(line.startswith("region 'square' differs by") for line in said(near, "fails"))


def test_a_saturated_patch(tmp_path: Path, cyclopean: Cyclopean, chart_file: Path) -> None:
    matrix = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, 5.0], [1.0, 10.0, 120.0]])
    exposure = Exposure(1 / 15, 8.0, 200.0)
    write_camera(CameraModel(matrix, np.zeros(3), np.zeros(3), exposure, (1.0, 200.0)), tmp_path / "camera.yaml")
    for name in ("a.exr", "b.exr"):
        rgb = chart() @ np.linalg.inv(matrix).T.astype(np.float32)
        full = np.zeros(rgb.shape, dtype=np.bool_)
        if name == "a.exr":
            full[chart()[..., 1] > 80] = True
            full[100:103, 66:69] = True  # a few pixels of patch 14
        write_camera_exr(tmp_path / name, CameraImage(rgb.astype(np.float32), full, exposure, name))
    chart_file.write_text(CHART + "most_saturated_share: 0.1\n", encoding="utf-8")
    words = (tmp_path / "a.exr", tmp_path / "b.exr", "--regions", chart_file, "--camera", tmp_path / "camera.yaml")
    found = compared(cyclopean, *words)
    table = found["eyes"]["both"]["regions"]
    gone = [row for row in table["rows"] if row["excluded"]]
    assert [row["name"] for row in gone] == [f"chart 19 {PATCHES[18]}"]
    assert "100 % of its pixels are saturated in the photograph" in gone[0]["excluded"]
    assert any("chart 19" in line and "does not count" in line for line in said(found, "noted"))
    assert table["factor"]["regions"] == 23
    inside = sum(row["photo"]["pixels"] for row in table["rows"])
    assert found["eyes"]["both"]["per_pixel"]["pixels"] == inside - gone[0]["photo"]["pixels"] - 9


@pytest.mark.nightly
def test_a_raw_photograph_at_another_exposure(tmp_path: Path, cyclopean: Cyclopean, chart_file: Path) -> None:
    """Half the characterised exposure: XYZ and the safe zone are scaled, and dark patches fall out of it."""
    matrix = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, 5.0], [1.0, 10.0, 120.0]])
    model = CameraModel(matrix, np.zeros(3), np.zeros(3), Exposure(1 / 15, 8.0, 200.0), (5.0, 60.0))
    write_camera(model, tmp_path / "camera.yaml")
    rgb = 0.5 * chart(noise=0.0) @ np.linalg.inv(matrix).T
    tags = exposure_tags((1, 30), (8, 1), 200)
    photo = write_dng(tmp_path / "a.dng", np.maximum(rgb, 0.0), black=(600,), white=15520, tags=tags)
    words = (photo, written(tmp_path / "b.exr", chart()), "--regions", chart_file, "--camera", tmp_path / "camera.yaml")
    found = compared(cyclopean, *words)
    assert found["photograph"]["holds"] == "camera-rgb"
    assert found["photograph"]["safe_luminance_cd_m2"] == pytest.approx([10.0, 120.0], rel=1e-3)
    table = found["eyes"]["both"]["regions"]
    dark = {row["name"] for row in table["rows"] if row["excluded"]}
    luminances = patch_XYZ()[:, 1]
    assert dark == {f"chart {n + 1} {PATCHES[n]}" for n in range(24) if luminances[n] < 10.0}
    assert table["mean_delta_e"] < 0.3
    assert table["factor"]["mean_ratio"] == pytest.approx(1.0, abs=5e-3)


@pytest.mark.nightly
def test_a_region_without_light_does_not_count(tmp_path: Path, cyclopean: Cyclopean, chart_file: Path) -> None:
    XYZ = patch_XYZ()
    XYZ[13] = 0.0
    files = written(tmp_path / "a.exr", chart()), written(tmp_path / "b.exr", chart(XYZ, seed=6))
    found = compared(cyclopean, *files, "--regions", chart_file)
    row = found["eyes"]["both"]["regions"]["rows"][13]
    assert row["excluded"] == ["it holds no light in the rendering"]
    assert row["luminance_ratio"] is None
    assert found["eyes"]["both"]["per_pixel"]["largest"] < 2.0
    dark = written(tmp_path / "c.exr", chart(np.zeros((24, 3))))
    other = tmp_path / "other.yaml"
    other.write_text(CHART.replace("inner: 0.6", "inner: 0.6, colours: other"), encoding="utf-8")
    told = cyclopean("compare", files[0], dark, "--regions", other, "--register", "none", expect=2)
    assert "no region is left to compare" in told.stderr
