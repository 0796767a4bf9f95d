"""Raw files are developed a band of rows at a time, and the picture is the whole one to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.camera import CameraModel, Exposure
from documents import at_most_threads
from stimuli.develop import CameraImage, DevelopOptions, demosaic, develop_photographs, to_xyz
from stimuli.develop.demosaic import Linear, Mosaic, interpolate, superpixel
from stimuli.develop.raw_files import read_raw, read_sensor
from stimuli.develop.sensor_image import make_picture
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, write_exr
from stimuli.pictures.picture_pixels import turned
from tests.stimuli.develop.dng import camera_tags, exposure_tags, retagged, save_dng, save_linear_dng

OURS: tuple[Literal["superpixel"] | Linear, ...] = ("superpixel", *get_args(Linear))
MATRIX = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, 5.0], [1.0, 10.0, 120.0]])


def noisy(size: tuple[int, int], seed: int = 0) -> NDArray[np.uint16]:
    return np.random.default_rng(seed).integers(60, 4300, size).astype(np.uint16)


def whole(mosaic: Mosaic, method: Literal["superpixel"] | Linear) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The slow twin: all of the sensor at once."""
    return superpixel(mosaic) if method == "superpixel" else interpolate(mosaic, method)


@pytest.mark.parametrize("photosites", [1, 4 * 31, 1000])
@pytest.mark.parametrize("size", [(37, 31), (24, 26), (2, 9)])
@pytest.mark.parametrize("method", OURS)
def test_bands_are_the_whole_to_the_last_bit(
    monkeypatch: pytest.MonkeyPatch, method: Literal["superpixel"] | Linear, size: tuple[int, int], photosites: int
) -> None:
    monkeypatch.setattr(demosaic, "BAND_PHOTOSITES", photosites)
    values = (noisy(size).astype(np.float32) - 200) / np.float32(3800)
    mosaic = Mosaic(values, values >= 1, np.array([[1, 0], [2, 1]]))
    rgb, saturated = whole(mosaic, method)
    made = np.full_like(rgb, np.nan), np.zeros_like(saturated)
    seen: list[int] = []

    def keep(rows: slice, part: demosaic.RGB) -> None:
        made[0][rows], made[1][rows] = part
        seen.extend(range(rows.start, rows.stop))

    with at_most_threads(3):
        demosaic.by_bands(mosaic, method, keep)
    assert sorted(seen) == list(range(len(rgb)))
    np.testing.assert_array_equal(made[0], rgb)
    np.testing.assert_array_equal(made[1], saturated)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_turned_picture_is_the_whole_one_turned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, orientation: int
) -> None:
    monkeypatch.setattr(demosaic, "BAND_PHOTOSITES", 200)
    path = save_dng(tmp_path / "a.dng", noisy((33, 26)), white=4000, tags=[(274, "H", 1, orientation, True)])
    sensor = read_sensor(path)
    assert sensor.pattern is not None
    rgb, saturated = whole(Mosaic(sensor.values, sensor.saturated, sensor.pattern), "malvar")
    picture = make_picture(sensor, "malvar")
    np.testing.assert_array_equal(picture.rgb, turned(rgb, sensor.flip))
    np.testing.assert_array_equal(picture.saturated, turned(saturated, sensor.flip))
    assert picture.rgb.flags.c_contiguous


def test_xyz_is_written_by_bands_as_it_is_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from stimuli.develop import camera_to_xyz

    path = save_dng(
        tmp_path / "a.dng", noisy((96, 64)), black=(200,), white=4000, tags=exposure_tags((1, 8), (8, 1), 200)
    )
    camera = CameraModel(MATRIX, np.zeros(3), np.zeros(3), Exposure(1 / 8, 8, 200), (20.0, 90.0), name="test")
    at_once = to_xyz(read_raw(path), camera)
    write_exr(tmp_path / "whole.exr", StereoImage.flat(at_once.xyz))
    monkeypatch.setattr(camera_to_xyz, "_BAND_PIXELS", 64 * 7)
    (report,) = develop_photographs([path], tmp_path / "bands.exr", DevelopOptions(camera=camera)).photographs
    assert (tmp_path / "bands.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()
    assert report.luminance is not None
    assert report.luminance.mean_cd_m2 == pytest.approx(float(at_once.xyz[..., 1].mean(dtype=float)), rel=1e-12)
    assert report.luminance.negative_pixels == at_once.clipped > 0
    assert list(report.steps) == [dict(step) for step in at_once.steps]


def test_a_linear_dng_is_read(tmp_path: Path) -> None:
    codes = np.random.default_rng(1).integers(90, 4100, (48, 64, 3)).astype(np.uint16)
    tags = [*exposure_tags((1, 8), (8, 1), 200), *camera_tags("Acme", "Mk II")]
    path = save_linear_dng(tmp_path / "a.dng", codes, black=(100, 110, 120), white=4000, tags=tags)
    image = read_raw(path)
    truth = (codes - np.array([100, 110, 120])) / (4000 - np.array([100, 110, 120]))
    np.testing.assert_allclose(image.rgb, truth, atol=1e-6)
    np.testing.assert_array_equal(image.saturated, codes >= 4000)
    assert image.exposure == Exposure(1 / 8, 8, 200)
    assert [step["step"] for step in image.steps] == ["read", "linearise", "exposure"]
    assert read_sensor(path).camera == "Acme Mk II"


@pytest.mark.parametrize(
    ("compression", "words"), [(34892, "with loss"), (52546, "JPEG XL"), (8, "compressed by Deflate")]
)
def test_forms_of_dng_that_cannot_be_read_are_named(tmp_path: Path, compression: int, words: str) -> None:
    codes = np.zeros((24, 32, 3), np.uint16)
    path = retagged(save_linear_dng(tmp_path / "a.dng", codes), 259, compression)
    with pytest.raises(StimulusError, match=words) as caught:
        read_raw(path)
    (finding,) = caught.value.findings
    assert finding.file == str(path)
    assert finding.remedy


def test_a_refused_picture_is_not_written(tmp_path: Path) -> None:
    path = save_dng(
        tmp_path / "a.dng", noisy((96, 64)), black=(200,), white=4000, tags=exposure_tags((1, 8), (8, 1), 200)
    )
    camera = CameraModel(MATRIX, np.zeros(3), np.zeros(3), Exposure(1 / 8, 8, 200))
    report = develop_photographs([path], tmp_path / "a.exr", DevelopOptions(camera=camera, negative="refuse"))
    assert "negative XYZ" in report.findings[0].message
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.dng"]


def test_a_linear_dng_is_turned_and_kept_by_any_demosaicing(tmp_path: Path) -> None:
    codes = np.random.default_rng(1).integers(90, 4100, (24, 32, 3)).astype(np.uint16)
    path = save_linear_dng(tmp_path / "a.dng", codes, tags=[(274, "H", 1, 6, True)])
    image: CameraImage = read_raw(path, demosaic="superpixel")
    np.testing.assert_allclose(image.rgb, np.rot90(codes, -1) / 65535, atol=1e-6)
