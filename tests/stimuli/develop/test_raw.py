from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import rawpy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.camera import Exposure
from stimuli.develop import Demosaic, Levels, read_camera_image
from stimuli.develop.demosaic import REACH_PX
from stimuli.develop.raw_files import DEMOSAICS
from stimuli.errors import StimulusError
from tests.stimuli.develop.dng import coded, exposure_tags, save_dng, smooth, write_dng

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


def test_equal_files_give_equal_pictures(tmp_path: Path) -> None:
    path = write_dng(tmp_path / "a.dng", smooth())
    one, other = read_camera_image(path), read_camera_image(path)
    np.testing.assert_array_equal(one.rgb, other.rgb)
    assert one.steps == other.steps
