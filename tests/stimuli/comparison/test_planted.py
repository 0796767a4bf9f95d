"""Differences that were planted are found, named and measured: of colour, place, blur and sparkle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from devices.camera import CameraModel, Exposure, write_camera
from documents.arrays import Floats32
from stimuli.comparison import CompareOptions, Comparison, compare_pictures
from stimuli.comparison.registering import align
from stimuli.comparison.sharpness import blur_between
from stimuli.comparison.sparkles import SparkleArea
from stimuli.develop import CameraImage, write_camera_exr
from stimuli.measures import ViewingConditions
from stimuli.pictures import RowFile
from tests.kept import known
from tests.stimuli.comparison.scenes import (
    CHART,
    PATCHES,
    PLATE,
    RIG,
    SIZE,
    Cyclopean,
    chart,
    coloured,
    compared,
    few,
    said,
    spots,
    written,
)


# Differences that were planted come back: found, named and measured.
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


# A rendering that is the photograph but blurred: found where it lies, and failed for its blur.
def blurred(picture: Floats32, sd_px: float) -> Floats32:
    return coloured(gaussian_filter(picture[..., 1].astype(np.float64), sd_px))


def noisy(picture: Floats32, share: float, seed: int = 3) -> Floats32:
    return np.asarray(picture * (1 + share * np.random.default_rng(seed).standard_normal(picture.shape)), np.float32)


@pytest.mark.parametrize("sd_px", [2.0, 8.0])
def test_a_blur_is_measured_by_its_size_and_way(sd_px: float) -> None:
    photo = spots(size=(400, 300), count=2500)
    soft = noisy(blurred(photo, sd_px), 0.01)[..., 1]
    assert blur_between(photo[..., 1], soft) == pytest.approx(sd_px, rel=0.06)
    assert blur_between(soft, photo[..., 1]) == pytest.approx(-sd_px, rel=0.06)


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_noise_or_other_flakes_are_no_blur(share: float) -> None:
    photo, other = spots(size=(400, 300), count=2500), spots(size=(400, 300), count=2500, seed=9)
    assert blur_between(noisy(photo, share)[..., 1], photo[..., 1]) == 0.0
    assert blur_between(noisy(photo, share)[..., 1], other[..., 1]) == 0.0


@pytest.mark.parametrize(
    ("sd_px", "way"),
    [(2.0, "rendering"), pytest.param(8.0, "photograph", marks=pytest.mark.nightly)],
)
def test_a_blurred_picture_is_registered(sd_px: float, way: str) -> None:
    photo, moved = spots(size=(400, 300), count=2500), spots(3.3, -1.7, size=(400, 300), count=2500)
    pair = (photo, blurred(moved, sd_px)) if way == "rendering" else (blurred(photo, sd_px), moved)
    found = align(RowFile.of(pair[0]), RowFile.of(pair[1]), "auto")
    assert found.shift_px == pytest.approx((3.3, -1.7), abs=0.005 * sd_px**2)
    assert known(found.residual_px) < 0.15
    assert abs(found.blur_px) == pytest.approx(sd_px, rel=0.06)


def test_a_blurred_rendering_fails_for_its_blur(tmp_path: Path) -> None:
    photo = few()
    files = [written(tmp_path / name, one) for name, one in (("a.exr", photo), ("b.exr", blurred(photo, 4.0)))]
    result = compare_pictures(files[0], files[1], PLATE)
    assert result.verdict.decision == "not validated"
    assert any("sparkle density" in reason.sentence for reason in result.verdict.having("fails"))
    assert any("blurrier" in note and "4.0 px" in note for note in result.notes)
    same = compare_pictures(files[0], files[0], PLATE)
    assert same.verdict.decision == "validated"
    assert not any("blurrier" in note for note in same.notes)


@pytest.mark.nightly
@pytest.mark.parametrize("moved", [0.0, 0.4])
def test_pixels_of_a_blurred_plate_count(tmp_path: Path, moved: float) -> None:
    """Few of its sparkles lie on one of the photograph's, and its flakes are the same all the same."""
    photo, other = spots(size=SIZE, count=3300), spots(moved, size=SIZE, count=3300, seed=9)
    soft = blurred(spots(moved, size=SIZE, count=3300), 2.0)
    for name, picture in (("photo", photo), ("soft", soft), ("other", other)):
        written(tmp_path / f"{name}.exr", picture)
    options = CompareOptions(viewing=ViewingConditions(40.0))
    area, reasons = _plate(compare_pictures(tmp_path / "photo.exr", tmp_path / "soft.exr", PLATE, options))
    assert area.matched is None
    assert len(area.rendering.peaks) > 50
    assert area.correlation is not None
    assert area.correlation > 0.9
    assert not area.other_flakes
    assert any("as the eye resolves them" in reason for reason in reasons)
    options = CompareOptions(viewing=ViewingConditions(40.0), register="none")
    area, reasons = _plate(compare_pictures(tmp_path / "photo.exr", tmp_path / "other.exr", PLATE, options))
    assert abs(known(area.correlation)) < 0.1
    assert area.other_flakes
    assert not any("as the eye resolves them" in reason for reason in reasons)


def _plate(result: Comparison) -> tuple[SparkleArea, list[str]]:
    (area,) = result.eyes["both"].sparkle
    return area, [reason.sentence for reason in result.verdict.having("fails")]


# Plates of one paint: as many sparkles elsewhere, and one mean luminance.


def painted(seed: int) -> Floats32:
    plate = spots(size=(450, 300), count=2500, seed=seed, amplitude=400.0)
    return np.asarray(plate * (4.5 / plate[..., 1].mean(dtype=np.float64)), np.float32)


@pytest.mark.nightly
def test_another_plate_of_the_same_paint(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """Other flakes of one density differ by chance, and single pixels by where the flakes lie."""
    files = [written(tmp_path / f"{seed}.exr", painted(seed)) for seed in (9, 10)]
    found = compared(cyclopean, *files, "--regions", PLATE, "--register", "none", "--rig", RIG, expect=None)
    assert said(found, "fails") == []
    assert any("flakes lie elsewhere" in line for line in said(found, "noted"))
    assert found["eyes"]["both"]["registration"]["residual_px"] is None
    assert found["eyes"]["both"]["as_seen"]["mean"] > 1.4  # and yet it is told


@pytest.mark.nightly
def test_single_pixels_count_where_flakes_do_not(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """A plate of other flakes beside a table: the table's pixels are judged, and the plate's are not."""
    pictures = []
    for seed, stain in ((9, 1.0), (10, 1.3)):
        picture = painted(seed)
        picture[:, :60] = [4.4, 4.5, 3.7]
        picture[:100, :60] *= np.float32(stain)
        picture[100:120, :60] /= np.float32(stain)
        pictures.append(written(tmp_path / f"{seed}.exr", picture))
    height, width, _ = picture.shape
    regions = tmp_path / "r.yaml"
    plate = f"{{kind: plate, corners: [[60, 0], [{width}, 0], [{width}, {height}], [60, {height}]]}}"
    table = f"{{kind: rectangle, name: table, box: [0, 0, 60, {height}]}}"
    regions.write_text(f"schema_version: 1\nregions:\n  - {plate}\n  - {table}\n", encoding="utf-8")
    words = (*pictures, "--regions", regions, "--register", "none", "--rig", RIG)
    found = compared(cyclopean, *words, expect=1)
    one = found["eyes"]["both"]
    assert one["per_pixel"]["pixels"] == 60 * height
    assert any("single pixels of 'plate' are left out" in line for line in one["said"])
    assert any(line.startswith("pixels differ by") for line in said(found, "fails"))
