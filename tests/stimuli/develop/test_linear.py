from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tifffile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from devices.camera import Exposure
from stimuli.develop import CameraImage, Levels, read_camera_image, write_camera_exr
from stimuli.errors import StimulusError
from tests.stimuli.oiio_files import save_picture

CODES = np.random.default_rng(0).integers(0, 65536, (8, 9, 3)).astype(np.uint16)
CODES[0, 0] = 65535, 60000, 65534  # full scale, of integers and of the floats below, and just not


def refusal(path: Path) -> str:
    with pytest.raises(StimulusError) as caught:
        read_camera_image(path)
    (finding,) = caught.value.findings
    assert finding.file == str(path)
    assert finding.remedy
    return finding.message


def test_integers_are_shares_of_their_largest(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", CODES, photometric="rgb")
    image = read_camera_image(tmp_path / "a.tif")
    np.testing.assert_allclose(image.rgb, CODES / 65535.0, rtol=1e-7)
    np.testing.assert_array_equal(image.saturated, CODES == 65535)
    assert image.saturated[0, 0].tolist() == [True, False, False]
    assert next(step for step in image.steps if step["step"] == "scale")["white"] == 65535.0


def test_levels_of_a_sensor_in_sixteen_bits(tmp_path: Path) -> None:
    """A 14-bit export says neither black nor white: both are told, and noise below black stays."""
    tifffile.imwrite(tmp_path / "a.tif", CODES // 4, photometric="rgb")
    image = read_camera_image(tmp_path / "a.tif", levels=Levels(black=600, white=15520, saturated=15000))
    np.testing.assert_allclose(image.rgb, (CODES // 4 - 600.0) / 14920, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(image.saturated, CODES // 4 >= 15000)
    assert (image.rgb < 0).any()


@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_floats_are_shares_of_full_scale(tmp_path: Path, kind: type) -> None:
    light: NDArray[np.floating] = (CODES / 60000.0).astype(kind)
    tifffile.imwrite(tmp_path / "a.tiff", light, photometric="rgb")
    image = read_camera_image(tmp_path / "a.tiff")
    np.testing.assert_array_equal(image.rgb, light.astype(np.float32))
    np.testing.assert_array_equal(image.saturated, light >= 1)
    assert light[0, 0, 1] == 1


def test_an_exif_orientation_is_followed(tmp_path: Path) -> None:
    turned = {1: CODES, 3: CODES[::-1, ::-1], 6: np.rot90(CODES, -1), 8: np.rot90(CODES, 1), 2: CODES[:, ::-1]}
    for orientation, upright in turned.items():
        tag = [(274, "H", 1, orientation, True)]
        tifffile.imwrite(tmp_path / "a.tif", CODES, photometric="rgb", extratags=tag)
        np.testing.assert_allclose(read_camera_image(tmp_path / "a.tif").rgb, upright / 65535.0, rtol=1e-7)
    kept = read_camera_image(tmp_path / "a.tif", rotate=False)
    np.testing.assert_allclose(kept.rgb, CODES / 65535.0, rtol=1e-7)


def test_the_exposure_is_read(tmp_path: Path) -> None:
    tags = [(33434, "2I", 1, (1, 3), True), (33437, "2I", 1, (8, 1), True), (34855, "H", 1, 200, True)]
    tifffile.imwrite(tmp_path / "a.tif", CODES, photometric="rgb", extratags=tags)
    exposure = read_camera_image(tmp_path / "a.tif").exposure
    assert exposure is not None
    assert exposure.same_signal(Exposure(1 / 3, 8.0, 200.0))
    told = read_camera_image(tmp_path / "a.tif", exposure=Exposure(2, 4)).exposure
    assert told == Exposure(2, 4)


RGB = arrays(np.float32, (3, 4, 3), elements=st.floats(-0.125, 1.5, width=32))


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rgb=RGB, full=arrays(np.bool_, (3, 4, 3)), time_s=st.floats(1e-4, 1e3), known=st.booleans())
def test_what_is_written_reads_back(
    tmp_path: Path, rgb: NDArray[np.float32], full: NDArray[np.bool_], time_s: float, known: bool
) -> None:
    exposure = Exposure(time_s, 8.0, 400.0) if known else None
    image = CameraImage(rgb, full, exposure, "photo.nef", ({"step": "read", "file": "é.nef"}, {"step": "demosaic"}))
    write_camera_exr(tmp_path / "a.exr", image)
    back = read_camera_image(tmp_path / "a.exr")
    np.testing.assert_array_equal(back.rgb, rgb)
    np.testing.assert_array_equal(back.saturated, full)
    assert back.exposure == exposure
    assert back.steps[:2] == image.steps


def test_what_declares_a_curve_is_refused_unless_told(tmp_path: Path) -> None:
    from PIL import ImageCms

    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    tifffile.imwrite(tmp_path / "icc.tif", CODES, photometric="rgb", iccprofile=profile)
    tifffile.imwrite(tmp_path / "eight.tif", (CODES >> 8).astype(np.uint8), photometric="rgb")
    light = (CODES / 65535.0).astype(np.float32)
    save_picture(tmp_path / "srgb.exr", light, oiio__ColorSpace="sRGB")
    save_picture(tmp_path / "rec709.exr", light, chromaticities=(0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
    said = {
        "icc.tif": "colour profile",
        "eight.tif": "8 bits",
        "srgb.exr": "not linear",
        "rec709.exr": "chromaticities",
    }
    for name, words in said.items():
        assert words in refusal(tmp_path / name)
        told = read_camera_image(tmp_path / name, assume_linear=True)
        assert np.abs(told.rgb - light).max() < (0.005 if name == "eight.tif" else 1e-6)
    save_picture(tmp_path / "linear.exr", light)
    np.testing.assert_array_equal(read_camera_image(tmp_path / "linear.exr").rgb, light)


def test_what_cannot_be_read_is_refused(tmp_path: Path) -> None:
    light = (CODES / 65535.0).astype(np.float32)
    light[0, 0, 1] = np.nan
    light[1, 2, 0] = np.inf
    assert "2 pixels are NaN or infinite" in refusal(save_picture(tmp_path / "nan.exr", light))
    assert "lacks the channel R" in refusal(save_picture(tmp_path / "xyz.exr", CODES / 65535.0, ("X", "Y", "Z")))
    tifffile.imwrite(tmp_path / "grey.tif", CODES[..., 0])
    assert "lacks the channel R" in refusal(tmp_path / "grey.tif")
    tifffile.imwrite(tmp_path / "two.tif", np.stack([CODES, CODES]), photometric="rgb")
    assert "more than one picture" in refusal(tmp_path / "two.tif")
    tifffile.imwrite(tmp_path / "cut.tif", CODES, photometric="rgb")
    content = (tmp_path / "cut.tif").read_bytes()
    for length in (0, 6, 100, len(content) - 50):
        (tmp_path / "cut.tif").write_bytes(content[:length])
        refusal(tmp_path / "cut.tif")
    assert "no such file" in refusal(tmp_path / "missing.tif")
    (tmp_path / "jpeg.tif").write_bytes(b"\xff\xd8\xff\xe0" + bytes(60))
    refusal(tmp_path / "jpeg.tif")


@pytest.mark.parametrize("shape", [(0, 4, 3), (4, 4), (4, 4, 4)])
def test_a_camera_picture_has_three_colours(shape: tuple[int, ...]) -> None:
    with pytest.raises(StimulusError, match="shape"):
        CameraImage(np.zeros(shape, np.float32), np.zeros(shape, bool), None, "a")


def test_planes_and_alpha_change_nothing(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "p.tif", np.moveaxis(CODES, 2, 0).copy(), photometric="rgb", planarconfig="separate")
    alpha = np.concatenate([CODES, CODES[..., :1]], axis=-1)
    tifffile.imwrite(tmp_path / "a.tif", alpha, photometric="rgb", extrasamples=["unassalpha"])
    for name in ("p.tif", "a.tif"):
        np.testing.assert_allclose(read_camera_image(tmp_path / name).rgb, CODES / 65535.0, rtol=1e-7)


def test_equal_pictures_make_equal_files(tmp_path: Path) -> None:
    image = CameraImage(np.ones((2, 2, 3), np.float32), np.ones((2, 2, 3), bool), None, "a")
    write_camera_exr(tmp_path / "a.exr", image)
    write_camera_exr(tmp_path / "b.exr", image)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_writing_where_nothing_can_be_written_leaves_nothing(tmp_path: Path) -> None:
    image = CameraImage(np.ones((2, 2, 3), np.float32), np.ones((2, 2, 3), bool), None, "a")
    with pytest.raises(StimulusError, match="cannot be written"):
        write_camera_exr(tmp_path / "none" / "a.exr", image)
    (tmp_path / "taken.exr").mkdir()
    with pytest.raises(StimulusError, match="cannot be written"):
        write_camera_exr(tmp_path / "taken.exr", image)
    assert [entry.name for entry in tmp_path.iterdir()] == ["taken.exr"]


def test_the_map_has_the_picture_s_shape() -> None:
    with pytest.raises(StimulusError, match="saturation map"):
        CameraImage(np.zeros((4, 4, 3), np.float32), np.zeros((4, 4), bool), None, "a")
    full = np.zeros((4, 5, 3), bool)
    full[:2, :, 1] = True
    image = CameraImage(np.zeros((4, 5, 3), np.float32), full, None, "a")
    assert image.saturated_share == (0.0, 0.5, 0.0)


def test_double_precision_is_held_a_few_rows_at_a_time(tmp_path: Path) -> None:
    """What is stored, R, G and B of it, and the result: no more than that, and flags, lie in memory whole."""
    import tracemalloc

    pixels = np.random.default_rng(1).random((1200, 800, 3)).astype(np.float32)
    tifffile.imwrite(tmp_path / "a.tif", pixels, photometric="rgb")
    read_camera_image(tmp_path / "a.tif")
    tracemalloc.start()
    try:
        image = read_camera_image(tmp_path / "a.tif")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    np.testing.assert_array_equal(image.rgb, pixels)
    assert peak < 3.8 * image.rgb.nbytes
