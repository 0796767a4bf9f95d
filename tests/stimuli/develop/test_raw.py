"""Raw files and linear pictures developed, whole and in bands."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import pytest
import rawpy
import tifffile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from devices.camera import CameraModel, Exposure
from documents import at_most_threads
from stimuli.develop import (
    CameraImage,
    Demosaic,
    DevelopOptions,
    Levels,
    demosaic,
    develop_photographs,
    make_picture,
    read_camera_image,
    to_xyz,
    write_camera_exr,
)
from stimuli.develop.demosaic import REACH_PX, Linear, Mosaic, interpolate, superpixel
from stimuli.develop.raw_files import DEMOSAICS, read_raw, read_sensor
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, write_exr
from stimuli.pictures.picture_pixels import turned
from tests.kept import known
from tests.stimuli.develop.dng import (
    camera_tags,
    coded,
    exposure_tags,
    retagged,
    save_dng,
    save_linear_dng,
    smooth,
    write_dng,
)
from tests.stimuli.oiio_files import save_picture

BLACK = (100, 110, 120, 130)
PATTERNS = {"RGGB": (0, 1, 1, 2), "BGGR": (2, 1, 1, 0), "GRBG": (1, 0, 2, 1), "GBRG": (1, 2, 0, 1)}
FULL: tuple[Demosaic, ...] = ("bilinear", "malvar", "vng", "ppg", "ahd")


def refusal(path: Path, **options: object) -> str:
    with pytest.raises(StimulusError) as caught:
        read_camera_image(path, **options)  # type: ignore[arg-type]  # keywords by name
    (finding,) = caught.value.findings
    assert finding.file == str(path)
    assert finding.remedy
    return finding.message


@pytest.mark.parametrize("pattern", [PATTERNS["RGGB"], PATTERNS["GBRG"]])
@pytest.mark.parametrize("method", FULL)
def test_known_linear_values_come_back(tmp_path: Path, method: Demosaic, pattern: tuple[int, ...]) -> None:
    """Colours that rise linearly are interpolated without error but for codes, within 1e-3 of full scale."""
    path = write_dng(tmp_path / "a.dng", smooth(), black=BLACK, white=16000, pattern=pattern)
    image = read_camera_image(path, demosaic=method)
    error = np.abs(image.rgb - smooth())[4:-4, 4:-4]
    assert image.rgb.shape == smooth().shape
    # half a code of 16000, weighted by at most 1.6 in all, and half a step of LibRaw's 16 bits
    assert error.max() < 1.2e-4
    assert not image.saturated.any()


@pytest.mark.parametrize("pattern", PATTERNS.values(), ids=PATTERNS)
def test_superpixels_are_the_photosites(tmp_path: Path, pattern: tuple[int, ...]) -> None:
    codes = np.random.default_rng(1).integers(0, 3001, (25, 31)).astype(np.uint16)
    path = save_dng(tmp_path / "a.dng", codes, black=BLACK, white=2900, pattern=pattern)
    image = read_camera_image(path, demosaic="superpixel")
    assert image.rgb.shape == (12, 15, 3)
    quads = codes[:24, :30].reshape(12, 2, 15, 2).transpose(0, 2, 1, 3).reshape(12, 15, 4).astype(float)
    light = (quads - BLACK) / (2900 - np.array(BLACK))
    for colour in range(3):
        sites = [i for i in range(4) if pattern[i] == colour]
        np.testing.assert_allclose(image.rgb[..., colour], light[..., sites].mean(axis=-1), atol=2e-7)
        np.testing.assert_array_equal(image.saturated[..., colour], (quads[..., sites] >= 2900).any(axis=-1))
    assert image.saturated.any()
    assert (image.rgb < 0).any(), "noise below black is kept"


@pytest.mark.parametrize("method", FULL)
def test_measured_values_stay(tmp_path: Path, method: Demosaic) -> None:
    """At its own photosite a colour is what was measured, below black and above white as well."""
    codes = np.random.default_rng(2).integers(60, 4300, (30, 40)).astype(np.uint16)
    path = save_dng(tmp_path / "a.dng", codes, black=(200,), white=4000)
    image = read_camera_image(path, demosaic=method)
    light = (codes.astype(float) - 200) / 3800
    assert light.min() < -0.03
    assert light.max() > 1.05
    for (row, column), colour in {(0, 0): 0, (0, 1): 1, (1, 0): 1, (1, 1): 2}.items():
        np.testing.assert_allclose(image.rgb[row::2, column::2, colour], light[row::2, column::2], atol=2e-7)


def test_the_file_s_linearisation_table_is_applied(tmp_path: Path) -> None:
    """Codes are those after the table (tag 50712); black and white are too."""
    table = tuple(min(65535, (code * code) // 16) for code in range(1024))
    truth = coded(smooth(), white=60000).astype(float)
    stored = np.rint(np.sqrt(truth * 16)).astype(np.uint16)
    tags = [(50712, "H", len(table), table, True)]
    path = save_dng(tmp_path / "a.dng", stored, white=60000, tags=tags)
    image = read_camera_image(path, demosaic="superpixel")
    assert np.abs(image.rgb[..., 0] - np.array(table)[stored][::2, ::2] / 60000).max() < 1e-6


def _perturbed(tmp_path: Path, method: Demosaic, codes: NDArray[np.uint16], place: tuple[int, int]) -> None:
    """Change one saturated photosite: no unmarked value may move."""
    codes = codes.copy()
    codes[place] = 1500
    full = save_dng(tmp_path / "full.dng", codes, white=4095)
    codes[place] = 4095
    over = save_dng(tmp_path / "over.dng", codes, white=4095)
    one = read_camera_image(full, demosaic=method, levels=Levels(saturated=1500))
    other = read_camera_image(over, demosaic=method, levels=Levels(saturated=1500))
    assert one.saturated.any()
    moved = np.abs(one.rgb - other.rgb) > 1e-9
    assert not (moved & ~one.saturated).any()


@pytest.mark.parametrize("trials", [4, pytest.param(12, marks=pytest.mark.stress)])
@pytest.mark.parametrize("method", DEMOSAICS)
def test_the_saturation_map_marks_all_that_a_full_photosite_touches(
    tmp_path: Path, method: Demosaic, trials: int
) -> None:
    rng = np.random.default_rng(4)
    waves = 750 + 500 * np.sin(np.arange(40) / 2.1)[None, :] * np.cos(np.arange(36) / 3.3)[:, None]
    for trial in range(trials):
        noise = rng.normal(0, 60, waves.shape) if trial % 2 else rng.uniform(-700, 700, waves.shape)
        codes = np.clip(waves + noise, 0, 1490).astype(np.uint16)
        row, column = rng.integers(0, 36), rng.integers(0, 40)
        _perturbed(tmp_path, method, codes, (int(row), int(column)))


def test_the_saturation_map_is_no_wider_than_the_method(tmp_path: Path) -> None:
    codes = np.full((40, 40), 1000, np.uint16)
    codes[20, 20] = 4095  # red
    path = save_dng(tmp_path / "a.dng", codes, white=4095)
    marks = {method: read_camera_image(path, demosaic=method).saturated for method in DEMOSAICS}
    assert [int(marks["superpixel"][..., colour].sum()) for colour in range(3)] == [1, 0, 0]
    assert [int(marks["bilinear"][..., colour].sum()) for colour in range(3)] == [9, 0, 0]
    assert not marks["malvar"][18:23, 18:23].all()
    assert marks["malvar"][20, 21, 1] == 0, "a measured green owes nothing to red"
    for method, reach in REACH_PX.items():
        assert int(marks[method][..., 1].sum()) == (2 * reach + 1) ** 2
    step = next(step for step in read_camera_image(path).steps if step["step"] == "linearise")
    assert step["saturated_photosites"]["red"] == {"photosites": 1, "share": 1 / 400}
    assert step["saturated_photosites"]["green"]["photosites"] == 0


@pytest.mark.parametrize("orientation", range(1, 9))
def test_the_picture_is_turned_upright(tmp_path: Path, orientation: int) -> None:
    """As LibRaw turns it, for each of the eight orientations; and not when told so."""
    path = write_dng(tmp_path / "a.dng", smooth(), tags=[(274, "H", 1, orientation, True)])
    with rawpy.imread(str(path)) as raw:
        theirs = raw.postprocess(output_color=rawpy.ColorSpace.raw, no_auto_bright=True, user_wb=[1, 1, 1, 1])
    image = read_camera_image(path, demosaic="bilinear")
    assert image.rgb.shape == theirs.shape
    corner = np.unravel_index(np.argmin(theirs.sum(axis=-1)), theirs.shape[:2])
    ours = np.unravel_index(np.argmin(image.rgb.sum(axis=-1)), theirs.shape[:2])
    assert max(abs(int(a) - int(b)) for a, b in zip(corner, ours, strict=True)) <= 2
    assert image.saturated.shape == image.rgb.shape
    assert read_camera_image(path, demosaic="bilinear", rotate=False).rgb.shape == smooth().shape


def test_the_exposure_is_the_file_s_or_told(tmp_path: Path) -> None:
    path = write_dng(tmp_path / "a.dng", smooth(), tags=exposure_tags((1, 125), (56, 10), 400))
    assert read_camera_image(path).exposure == Exposure(0.008, 5.6, 400.0)
    told = read_camera_image(path, exposure=Exposure(2.0, 8.0))
    assert told.exposure == Exposure(2.0, 8.0)
    assert told.steps[-1]["source"] == "told"
    bare = write_dng(tmp_path / "b.dng", smooth())
    assert read_camera_image(bare).exposure is None
    manual_lens = write_dng(tmp_path / "c.dng", smooth(), tags=exposure_tags((1, 125), (56, 10), 400)[::2])
    assert read_camera_image(manual_lens).exposure is None


def test_a_raw_file_cut_short_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = write_dng(tmp_path / "a.dng", smooth())
    content = path.read_bytes()
    for length in (0, 7, 300, len(content) // 2, len(content) - 1):
        path.write_bytes(content[:length])
        assert "cut short" in refusal(path) or "no raw file" in refusal(path)
    os.truncate(path, 0)
    refusal(path)


def test_what_is_no_bayer_raw_file_is_refused(tmp_path: Path) -> None:
    from PIL import Image

    photo = tmp_path / "photo.NEF"
    Image.fromarray(np.zeros((16, 16, 3), np.uint8)).save(photo, format="JPEG")
    assert "JPEG" in refusal(photo)
    photo.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    assert "PNG" in refusal(photo)
    photo.write_bytes(np.random.default_rng(0).bytes(4000))
    assert "no raw file" in refusal(photo)
    assert "no such file" in refusal(tmp_path / "missing.nef")
    assert "this is a folder" in refusal(tmp_path)
    path = write_dng(tmp_path / "a.dng", smooth(), black=(500,), white=400)
    assert "white level 400" in refusal(path)
    with pytest.raises(StimulusError, match="no demosaicing 'dht'"):
        read_camera_image(path, demosaic="dht")  # type: ignore[arg-type]  # a wrong word on purpose


def test_bilinear_is_libraw_s_own_without_its_rounding(tmp_path: Path) -> None:
    """LibRaw's linear interpolation is the same but for its 16-bit integers, away from the border."""
    codes = np.random.default_rng(3).integers(0, 65536, (32, 40)).astype(np.uint16)
    path = save_dng(tmp_path / "a.dng", codes)
    ours = read_camera_image(path, demosaic="bilinear").rgb
    with rawpy.imread(str(path)) as raw:
        theirs = raw.postprocess(
            demosaic_algorithm=rawpy.DemosaicAlgorithm.LINEAR,
            output_color=rawpy.ColorSpace.raw,
            output_bps=16,
            gamma=(1, 1),
            user_wb=[1, 1, 1, 1],
            no_auto_bright=True,
            no_auto_scale=True,
        )
    assert np.abs(ours * 65535 - theirs)[1:-1, 1:-1].max() <= 1.0


def test_what_libraw_would_do_is_not_done(tmp_path: Path) -> None:
    """Its own development of the same file is balanced, curved and clipped: the test would see it."""
    path = write_dng(tmp_path / "a.dng", smooth(), black=BLACK, white=16000)
    with rawpy.imread(str(path)) as raw:
        curved = raw.postprocess(output_bps=16) / 65535.0
    assert np.abs(curved - smooth())[4:-4, 4:-4].max() > 0.1
    balanced = write_dng(tmp_path / "b.dng", smooth(), black=BLACK, white=16000, neutral=(1.0, 0.3, 0.8))
    for method in ("superpixel", "bilinear", "malvar"):
        np.testing.assert_array_equal(
            read_camera_image(path, demosaic=method).rgb, read_camera_image(balanced, demosaic=method).rgb
        )
    for adaptive in ("vng", "ppg", "ahd"):
        one, other = (read_camera_image(file, demosaic=adaptive).rgb for file in (path, balanced))
        # the balance may change a direction, and VNG's integers round by its gains: not more than is promised
        assert np.abs(one - other)[4:-4, 4:-4].max() < 1e-3


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    black=st.integers(0, 3000),
    span=st.integers(200, 60000),
    method=st.sampled_from(DEMOSAICS),
    light=st.lists(st.floats(0, 1), min_size=3, max_size=3),
)
def test_an_even_colour_is_even(tmp_path: Path, black: int, span: int, method: Demosaic, light: list[float]) -> None:
    """Whatever the levels, an even colour comes back as its codes say, to the border."""
    rgb = np.broadcast_to(np.array(light), (24, 26, 3)).copy()
    path = write_dng(tmp_path / "even.dng", rgb, black=(black,), white=black + span)
    image = read_camera_image(path, demosaic=method)
    truth = np.rint(black + np.array(light) * span).clip(0, 65535) - black
    assert np.abs(image.rgb - truth / span).max() < 1e-4


def test_told_levels_take_the_place_of_the_file_s(tmp_path: Path) -> None:
    path = write_dng(tmp_path / "a.dng", smooth(), black=(64,), white=4000)
    wrong = save_dng(tmp_path / "b.dng", coded(smooth(), black=(64,), white=4000), black=(0,), white=65535)
    told = read_camera_image(wrong, demosaic="malvar", levels=Levels(black=64, white=4000))
    np.testing.assert_allclose(told.rgb, read_camera_image(path, demosaic="malvar").rgb, atol=1e-6)


@pytest.mark.parametrize("levels", [{"black": -1}, {"white": 0}, {"black": 5, "white": 5}, {"saturated": np.inf}])
def test_levels_that_cannot_be(levels: dict[str, float]) -> None:
    with pytest.raises(StimulusError, match="level"):
        Levels(**levels)


CODES = np.random.default_rng(0).integers(0, 65536, (8, 9, 3)).astype(np.uint16)
CODES[0, 0] = 65535, 60000, 65534  # full scale, of integers and of the floats below, and just not


def linear_refusal(path: Path) -> str:
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
    exposure = known(read_camera_image(tmp_path / "a.tif").exposure)
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
        assert words in linear_refusal(tmp_path / name)
        told = read_camera_image(tmp_path / name, assume_linear=True)
        assert np.abs(told.rgb - light).max() < (0.005 if name == "eight.tif" else 1e-6)
    save_picture(tmp_path / "linear.exr", light)
    np.testing.assert_array_equal(read_camera_image(tmp_path / "linear.exr").rgb, light)


def test_what_cannot_be_read_is_refused(tmp_path: Path) -> None:
    light = (CODES / 65535.0).astype(np.float32)
    light[0, 0, 1] = np.nan
    light[1, 2, 0] = np.inf
    assert "2 pixels are NaN or infinite" in linear_refusal(save_picture(tmp_path / "nan.exr", light))
    assert "lacks the channel R" in linear_refusal(save_picture(tmp_path / "xyz.exr", CODES / 65535.0, ("X", "Y", "Z")))
    tifffile.imwrite(tmp_path / "grey.tif", CODES[..., 0])
    assert "lacks the channel R" in linear_refusal(tmp_path / "grey.tif")
    tifffile.imwrite(tmp_path / "two.tif", np.stack([CODES, CODES]), photometric="rgb")
    assert "more than one picture" in linear_refusal(tmp_path / "two.tif")
    tifffile.imwrite(tmp_path / "cut.tif", CODES, photometric="rgb")
    content = (tmp_path / "cut.tif").read_bytes()
    for length in (0, 6, 100, len(content) - 50):
        (tmp_path / "cut.tif").write_bytes(content[:length])
        linear_refusal(tmp_path / "cut.tif")
    assert "no such file" in linear_refusal(tmp_path / "missing.tif")
    (tmp_path / "jpeg.tif").write_bytes(b"\xff\xd8\xff\xe0" + bytes(60))
    linear_refusal(tmp_path / "jpeg.tif")


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


# Raw files are developed a band of rows at a time, and the picture is the whole one to the last bit.

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
    rgb, saturated = whole(Mosaic(sensor.values, sensor.saturated, known(sensor.pattern)), "malvar")
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
    assert known(report.luminance).mean_cd_m2 == pytest.approx(float(at_once.xyz[..., 1].mean(dtype=float)), rel=1e-12)
    assert known(report.luminance).negative_pixels == at_once.clipped > 0
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
