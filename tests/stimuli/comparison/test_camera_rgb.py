"""Regions in the camera's own RGB, as thesis Section 5.5 compares them, and charts that lie another way round."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.camera import CameraModel, Exposure, write_camera
from devices.chart import WAYS
from devices.colour_matching import DEFAULT_OBSERVER, colorimetric_observer
from documents.arrays import Floats, Floats32
from stimuli.comparison import RegionsSpec, compare_regions, place_regions, read_regions
from stimuli.comparison.areas import area_means
from stimuli.comparison.by_region import ComparedRegions, check_charts
from stimuli.comparison.regions import Chart
from stimuli.comparison.regions_file import RegionsFile
from stimuli.errors import StimulusError
from stimuli.pictures import rows
from tests.kept import known
from tests.stimuli.comparison.scenes import CHART, CORNERS, PLATE, Cyclopean, chart, compared, patch_XYZ, written
from tests.stimuli.spectral.pictures import save_exr

# Regions in the camera's own RGB, as thesis Section 5.5 compares them.

MATRIX = np.array([[180.0, 60.0, 30.0], [80.0, 190.0, -20.0], [10.0, -30.0, 210.0]])
EXPOSURE = Exposure(1 / 15, 8.0, 800.0)
CAMERA = CameraModel(MATRIX, np.zeros(3), np.zeros(3), EXPOSURE, name="Made up")
RGB = np.asarray(CAMERA.rgb(patch_XYZ()), dtype=np.float64)


@pytest.fixture(scope="module")
def regions_yaml(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("regions") / "chart.yaml"
    file.write_text(CHART)
    return file


def in_regions(
    photo: Floats32, rendering: Floats32, file: Path, camera: CameraModel | None = CAMERA, **options: object
) -> ComparedRegions:
    regions = read_regions(file)
    if options:
        assert isinstance(regions.spec, RegionsSpec)
        regions = replace(regions, spec=regions.spec.model_copy(update=options))
    placed = place_regions(regions, photo.shape)
    return compare_regions(photo, rendering, placed, regions, white_XYZ=[96.4, 100, 82.5], camera=camera)


def rgb_of(rows: Sequence[object], name: str) -> Floats:
    return np.array([getattr(row, name) for row in rows])


def test_the_rgb_that_was_photographed_comes_back(regions_yaml: Path) -> None:
    light = chart(noise=0.0)
    found = known(in_regions(light, light, regions_yaml).camera_rgb)
    # float32 pixels of up to 90 cd/m² have six digits.
    np.testing.assert_allclose(rgb_of(found.rows, "photo_rgb"), RGB, atol=1e-6)
    assert rgb_of(found.rows, "delta_rgb").tolist() == [[0, 0, 0]] * 24
    assert found.mean_ratio_rgb == (1, 1, 1)
    assert found.rms_delta_rgb == (0, 0, 0)
    assert found.title == "Camera RGB of Made up at 1/15 s, f/8, ISO 800"


def test_a_channel_that_is_off_shows_there_alone(regions_yaml: Path) -> None:
    """Five per cent more of red in the sensor is a difference in all of XYZ, and in one of RGB."""
    more_red = np.asarray(CAMERA.xyz(RGB * [1.05, 1, 1]), dtype=np.float64)
    compared_regions = in_regions(chart(noise=0.0), chart(more_red, noise=0.0), regions_yaml)
    found = known(compared_regions.camera_rgb)
    delta = rgb_of(found.rows, "delta_rgb")
    np.testing.assert_allclose(delta, RGB * [0.05, 0, 0], atol=2e-6)
    assert found.mean_ratio_rgb == pytest.approx((1 / 1.05, 1, 1), abs=1e-4)
    # r rises and g falls, most where both are in the light.
    assert (rgb_of(found.rows, "delta_r") > 0).all()
    assert (rgb_of(found.rows, "delta_g") < 0).all()
    rows = compared_regions.table.rows
    XYZ = np.array([row.rendering.XYZ for row in rows]) / np.array([row.photo.XYZ for row in rows])
    assert (np.abs(XYZ - 1).max(axis=0) > 2e-3).all()


def test_a_factor_of_luminance_is_undone_in_rgb_as_in_XYZ(regions_yaml: Path) -> None:
    light = chart(noise=0.0)
    found = in_regions(light, np.asarray(light * 0.25, np.float32), regions_yaml, luminance="mean_ratio").camera_rgb
    assert found is not None
    assert found.scaled_by == pytest.approx(4, rel=1e-5)
    assert np.abs(rgb_of(found.rows, "delta_rgb")).max() < 1e-5


def test_without_a_camera_or_for_another_observer_there_is_none(regions_yaml: Path) -> None:
    light = chart(noise=0.0)
    assert in_regions(light, light, regions_yaml, None).camera_rgb is None
    found = in_regions(light, light, regions_yaml, replace(CAMERA, observer="CIE 2015 10"))
    assert found.camera_rgb is None
    assert found.notes[-1].startswith("camera RGB is left out: ")


@pytest.mark.nightly
def test_a_spectral_rendering_is_taken_by_the_sensor(cyclopean: Cyclopean, tmp_path: Path) -> None:
    """Two lights that the sensor distinguishes and the observer does not: XYZ by the observer are one, RGB are two."""
    waves = np.arange(400.0, 721.0, 20.0)
    sensor = np.exp(-0.5 * ((waves[:, None] - [600.0, 530.0, 460.0]) / 25) ** 2)
    seen = colorimetric_observer(DEFAULT_OBSERVER).functions_at(waves)
    # What the observer cannot see at all: a spectrum without its part in the span of the matching functions.
    wiggle = np.sin(waves / 12)
    unseen = wiggle - seen @ np.linalg.lstsq(seen, wiggle, rcond=None)[0]
    even = np.full(len(waves), 0.02)
    metamer = even + 0.015 * unseen / np.abs(unseen).max()
    files = []
    for name, spectrum in (("photo", even), ("rendering", metamer)):
        rough = 1 + 0.01 * np.random.default_rng(3).standard_normal((180, 240, 1))
        save_exr(tmp_path / f"{name}.exr", (rough * spectrum).astype(np.float32), waves)
        files.append(tmp_path / f"{name}.exr")
    rows = "\n".join(f"{wave:g},{r:.9g},{g:.9g},{b:.9g}" for wave, (r, g, b) in zip(waves, sensor, strict=True))
    (tmp_path / "sensor.csv").write_text(f"wavelength_nm,red,green,blue\n{rows}\n")
    write_camera(CAMERA, tmp_path / "camera.yaml")
    words = (*files, "--regions", PLATE, "--register", "none", "--camera", tmp_path / "camera.yaml")
    taken = ("--sensitivities", tmp_path / "sensor.csv", "--full-scale", 2000)
    found = compared(cyclopean, *words, *taken, expect=None)
    row = found["eyes"]["both"]["camera_rgb"]["rows"][0]
    ratio = np.array(row["rendering_rgb"]) / row["photo_rgb"]
    np.testing.assert_allclose(ratio, (metamer @ sensor) / (even @ sensor), rtol=2e-3)
    assert np.abs(ratio - 1).max() > 0.02
    assert found["rendering"]["holds"] == "spectral"
    # Summed for the observer first, both are one colour, and the matrix makes one RGB of it.
    summed = compared(cyclopean, *words, "--photo-holds", "spectral", "--rendering-holds", "spectral", expect=None)
    row = summed["eyes"]["both"]["camera_rgb"]["rows"][0]
    np.testing.assert_allclose(row["rendering_rgb"], row["photo_rgb"], rtol=2e-3)


def test_a_photograph_s_own_rgb_at_its_own_exposure(cyclopean: Cyclopean, regions_yaml: Path, tmp_path: Path) -> None:
    """Camera RGB of 1/5 s, by a camera file of 1/15 s, beside the scene's XYZ: RGB as in the file, and alike."""
    import tifffile

    scene = chart()
    rgb = np.asarray(CAMERA.rgb(scene, Exposure(1 / 5, 8.0, 800.0)), dtype=np.float32)
    rgb *= np.float32(0.8)  # so that no patch fills the sensor
    tifffile.imwrite(tmp_path / "photo.tif", rgb, photometric="rgb")
    write_camera(CAMERA, tmp_path / "camera.yaml")
    words = ("--regions", regions_yaml, "--register", "none", "--camera", tmp_path / "camera.yaml", "--linear")
    rendering = written(tmp_path / "scene.exr", np.asarray(scene * np.float32(0.8), dtype=np.float32))
    more = ("--exposure", "1/5,8,800", "--rendering-holds", "xyz")
    found = compared(cyclopean, tmp_path / "photo.tif", rendering, *words, *more, expect=None)
    table = found["eyes"]["both"]["camera_rgb"]
    assert table["exposure"] == "1/5 s, f/8, ISO 800"
    regions = place_regions(read_regions(regions_yaml), rgb.shape).regions
    means = area_means(rgb, [(region.name, region.photo_px) for region in regions], None, least_pixels=4, what="it")
    for row, mean in zip(table["rows"], means, strict=True):
        assert row["photo_rgb"] == pytest.approx(mean.XYZ.tolist(), abs=2e-5)
        # Half floats round the rendering's XYZ by 1/2048 each.
        assert row["rendering_rgb"] == pytest.approx(mean.XYZ.tolist(), rel=2e-3, abs=2e-4)


@pytest.mark.nightly
def test_standard_errors_are_those_of_the_picture_in_rgb(tmp_path: Path) -> None:
    # Large enough patches for the cells that errors come from.
    corners, size = 2 * CORNERS, (480, 360)
    photo, rendering = (chart(None, corners, size, noise, seed) for noise, seed in ((0.02, 1), (0.03, 2)))
    large = tmp_path / "large.yaml"
    large.write_text(CHART.replace("[[20, 18], [222, 22], [218, 160], [16, 154]]", str(corners.tolist())))
    regions = read_regions(large)
    found = known(in_regions(photo, rendering, large).camera_rgb)
    outlines = [(region.name, region.photo_px) for region in place_regions(regions, photo.shape).regions]
    sides = [
        area_means(np.asarray(CAMERA.rgb(side), dtype=np.float32), outlines, None, least_pixels=4, what="picture")
        for side in (photo, rendering)
    ]
    for row, one, other in zip(found.rows, *sides, strict=True):
        expected = np.sqrt(np.diag(known(one.covariance_XYZ) + known(other.covariance_XYZ)))
        assert row.delta_rgb_se == pytest.approx(tuple(expected), rel=1e-3)
        assert row.photo_rgb == pytest.approx(tuple(one.XYZ), abs=1e-6)


def test_another_exposure_scales_the_signal_and_full_channels_are_named(regions_yaml: Path) -> None:
    light, regions = chart(noise=0.0), read_regions(regions_yaml)
    placed = place_regions(regions, light.shape)
    found = compare_regions(
        light, light, placed, regions, white_XYZ=[96, 100, 82], camera=CAMERA, exposure=Exposure(1 / 5, 8.0, 800.0)
    ).camera_rgb
    assert found is not None
    np.testing.assert_allclose(rgb_of(found.rows, "photo_rgb"), 3 * RGB, atol=3e-6)
    full = [row.above_full_scale for row in found.rows]
    assert full == [tuple(c for c, v in zip(("red", "green", "blue"), 3 * rgb, strict=True) if v > 1) for rgb in RGB]
    assert any(full)
    assert not all(full)


# A ColorChecker that lies another way round than its corners say is found, and said.

Draw = Callable[..., NDArray[np.float64]]
Write = Callable[..., RegionsFile]
WAY_CORNERS = np.array([[40.0, 30.0], [330.0, 44.0], [318.0, 240.0], [28.0, 220.0]])


def way_chart(corners: NDArray[np.float64], inner: float = 0.5) -> Chart:
    return Chart("chart", corners, corners, inner)


@pytest.mark.parametrize("way", list(WAYS))
def test_each_way_round_is_told_with_the_right_corners(chart_picture: Draw, way: str) -> None:
    picture = chart_picture(WAY_CORNERS, noise=0.05)
    # Corners from which that way leads back to the chart's own.
    given = np.empty_like(WAY_CORNERS)
    given[list(WAYS[way])] = WAY_CORNERS
    if not way:
        assert check_charts(picture, [way_chart(given)], "photograph") == ()
        return
    with pytest.raises(StimulusError) as caught:
        check_charts(picture, [way_chart(given)], "photograph", file="r.yaml")
    (finding,) = caught.value.findings
    assert finding.message == f"the chart 'chart' lies {way} in the photograph"
    assert known(finding.remedy).endswith("[[40, 30], [330, 44], [318, 240], [28, 220]]")


def test_another_white_and_a_camera_of_its_own_do_not_matter(chart_picture: Draw) -> None:
    matrix = np.array([[0.5, 0.3, 0.1], [0.2, 0.9, -0.2], [0.0, 0.1, 0.6]])
    assert check_charts(chart_picture() @ matrix.T, [way_chart(WAY_CORNERS)], "rendering") == ()


def test_what_is_no_chart_is_told(chart_picture: Draw) -> None:
    with pytest.raises(StimulusError, match="in no way round in the rendering"):
        check_charts(chart_picture(), [way_chart(WAY_CORNERS[::1] * 0.6)], "rendering")


def test_a_saturated_chart_is_left_open(chart_picture: Draw) -> None:
    picture = chart_picture()
    (said,) = check_charts(picture, [way_chart(WAY_CORNERS)], "photograph", np.ones(picture.shape, dtype=np.bool_))
    assert "is not known" in said


def test_another_chart_is_not_asked_for_its_colours(regions_of: Write) -> None:
    entry = "{kind: colorchecker, colours: other, corners: [[0, 0], [138, 0], [138, 90], [0, 90]]}"
    assert place_regions(regions_of(entry), (100, 200, 3)).charts == ()


def test_bands_do_not_matter(chart_picture: Draw, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "BAND_PIXELS", 700)
    assert check_charts(chart_picture(), [way_chart(WAY_CORNERS)], "photograph") == ()
