"""Profiles inside of pictures: what a picture does not need of them, how large they may be, what ranks above them."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageCms

from devices.errors import DeviceError
from devices.profiles import read_profile
from devices.readings import profile_measurements
from stimuli.errors import StimulusError
from stimuli.pictures import ColourSpace, StereoImage, find_pictures, read_picture
from tests.devices.profiles.profile_bytes import matrix_tags, para, profile, text, vcgt
from tests.stimuli.pictures.test_stated_by_files import CODES, with_chunks

OWN = matrix_tags(para(0, 1.8))
SRGB_PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
CICP_P3, CICP_SRGB = (b"cICP", bytes([12, 13, 0, 1])), (b"cICP", bytes([1, 13, 0, 1]))


def read(path: Path, space: ColourSpace | None = None) -> StereoImage:
    return read_picture(path, space, white_luminance_cd_m2=100)


def iccp(data: bytes) -> tuple[bytes, bytes]:
    return b"iCCP", b"own\0\0" + zlib.compress(data, 9)


def saved(path: Path, data: bytes) -> Path:
    options: dict[str, Any] = {"lossless": True} if path.suffix == ".webp" else {}
    Image.fromarray(CODES).save(path, icc_profile=data, **options)
    return path


@pytest.mark.parametrize(
    "more",
    [
        {"vcgt": vcgt(3, 2, [0, 30000, 65535] * 3) + b"\0" * 22},
        {"lumi": text("very")},
    ],
)
def test_a_picture_needs_none_of_the_tags_of_a_display(tmp_path: Path, more: dict[str, bytes]) -> None:
    plain = read(saved(tmp_path / "plain.png", profile(OWN)))
    found = read(saved(tmp_path / "more.png", profile(OWN | more)))
    np.testing.assert_array_equal(found.left, plain.left)


@pytest.mark.parametrize("suffix", ["png", pytest.param("jpg", marks=pytest.mark.nightly)])
def test_a_profile_of_three_megabytes_is_no_damage(tmp_path: Path, suffix: str) -> None:
    noise = np.random.default_rng(2).bytes(3_000_000)
    large = profile(OWN | {"priv": b"data\0\0\0\0" + noise})
    plain = read(saved(tmp_path / f"plain.{suffix}", profile(OWN)))
    np.testing.assert_array_equal(read(saved(tmp_path / f"a.{suffix}", large)).left, plain.left)


def test_a_profile_that_unpacks_without_end_is_refused(tmp_path: Path) -> None:
    bomb = with_chunks(tmp_path / "bomb.png", iccp(b"\0" * 40_000_000))
    with pytest.raises(StimulusError, match="unpacks to more than 32 MB"):
        read(bomb)
    # Each would be unpacked.
    many = with_chunks(tmp_path / "many.png", *[iccp(b"\0" * 1000)] * 2)
    with pytest.raises(StimulusError, match="more than one ICC profile"):
        read(many)


def test_a_damaged_profile_is_not_overlooked(tmp_path: Path) -> None:
    """It would be shown as sRGB without a word."""
    name, data = iccp(SRGB_PROFILE)
    path = with_chunks(tmp_path / "a.png", (name, data[:20] + bytes(byte ^ 255 for byte in data[20:])))
    with pytest.raises(StimulusError, match="profile"):
        read(path, "srgb")


@pytest.mark.parametrize("chunk", [CICP_P3, CICP_SRGB, (b"sRGB", b"\0")])
def test_statements_that_disagree_are_refused_until_one_is_chosen(tmp_path: Path, chunk: tuple[bytes, bytes]) -> None:
    path = with_chunks(tmp_path / "a.png", chunk, iccp(profile(OWN)))
    named: ColourSpace = "display-p3" if chunk is CICP_P3 else "srgb"
    for space in (None, "declared"):
        with pytest.raises(StimulusError, match=f"states {named}, and its ICC profile another") as caught:
            read(path, space)
        assert len(caught.value.findings) == 1
    with pytest.raises(StimulusError, match="cICP or sRGB states"):
        find_pictures([path])
    np.testing.assert_array_equal(read(path, named).left, read(with_chunks(tmp_path / "n.png"), named).left)
    np.testing.assert_array_equal(read(path, "icc").left, read(saved(tmp_path / "p.png", profile(OWN))).left)
    with pytest.raises(StimulusError, match="and rec2020 is asked for"):
        read(path, "rec2020")


def test_cICP_and_sRGB_that_disagree_are_refused(tmp_path: Path) -> None:
    with pytest.raises(StimulusError, match="cICP states display-p3"):
        read(with_chunks(tmp_path / "a.png", CICP_P3, (b"sRGB", b"\0")))
    assert read(with_chunks(tmp_path / "b.png", CICP_SRGB, (b"sRGB", b"\0"))).width_px == 12


@pytest.mark.parametrize(("last", "words"), [((0, 0), "narrow range"), ((1, 1), "matrix 1")])
def test_other_codes_than_those_of_full_range_are_refused(tmp_path: Path, last: tuple[int, int], words: str) -> None:
    path = with_chunks(tmp_path / "a.png", (b"cICP", bytes([1, 13, *last])))
    for space in (None, "srgb"):
        with pytest.raises(StimulusError, match=words):
            read(path, space)


def test_a_damaged_tag_of_a_display_is_refused_where_a_display_is_read(tmp_path: Path) -> None:
    path = tmp_path / "display.icc"
    for name, damaged in (("vcgt", b"vcgt\0\0\0\0\0\0\0\x07"), ("lumi", text("very")), ("bkpt", text("dark"))):
        path.write_bytes(profile(OWN | {name: damaged}))
        with pytest.raises(DeviceError, match=f"the tag '{name}'"):
            read_profile(path)


def test_filling_behind_the_gamma_table_changes_no_reading(tmp_path: Path) -> None:
    table, path = vcgt(3, 2, [0, 30000, 65535] * 3), tmp_path / "display.icc"
    found = []
    for filling in (b"", b"\0" * 22):
        path.write_bytes(profile(OWN | {"vcgt": table + filling}))
        found.append(profile_measurements(read_profile(path)))
    np.testing.assert_array_equal(found[0].codes, found[1].codes)


@pytest.mark.nightly
def test_a_png_of_16_bits_with_a_large_profile(tmp_path: Path) -> None:
    large = profile(OWN | {"priv": b"data\0\0\0\0" + np.random.default_rng(2).bytes(9_500_000)})
    grey = np.arange(96, dtype=np.uint16).reshape(8, 12) * 600
    for name, data in (("plain", profile(OWN)), ("large", large)):
        Image.fromarray(grey).save(tmp_path / f"{name}.png", icc_profile=data)
    np.testing.assert_array_equal(read(tmp_path / "large.png").left, read(tmp_path / "plain.png").left)


def test_cICP_and_a_profile_that_agree(tmp_path: Path) -> None:
    own = read(with_chunks(tmp_path / "a.png", CICP_SRGB, iccp(SRGB_PROFILE)))
    np.testing.assert_array_equal(own.left, read(with_chunks(tmp_path / "b.png"), "srgb").left)
