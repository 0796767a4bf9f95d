"""What ordinary files state beside their codes: pixels that are not square, and primaries without a profile."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin

from stimuli.errors import StimulusError
from stimuli.pictures import Packing, StereoImage, read_picture

CODES = np.random.default_rng(0).integers(0, 256, (8, 12, 3), dtype=np.uint8)
SRGB = (0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06)
ADOBE = (0.3127, 0.3290, 0.64, 0.33, 0.21, 0.71, 0.15, 0.06)
P3 = (0.3127, 0.3290, 0.680, 0.320, 0.265, 0.690, 0.150, 0.060)


def with_chunks(path: Path, *chunks: tuple[bytes, bytes]) -> Path:
    """Write a PNG with chunks between its header and its pixels."""
    Image.fromarray(CODES).save(path)
    data = path.read_bytes()
    more = b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body)) for name, body in chunks
    )
    path.write_bytes(data[:33] + more + data[33:])
    return path


def phys(across: int, down: int) -> tuple[bytes, bytes]:
    return b"pHYs", struct.pack(">IIB", across, down, 1)


def chrm(xy: tuple[float, ...]) -> tuple[bytes, bytes]:
    return b"cHRM", struct.pack(">8I", *(round(1e5 * value) for value in xy))


def gama(gamma: float) -> tuple[bytes, bytes]:
    return b"gAMA", struct.pack(">I", round(1e5 * gamma))


def read(path: Path, space: Any = "srgb", packing: Packing | None = None) -> StereoImage:
    return read_picture(path, space, white_luminance_cd_m2=100, packing=packing)


def save(path: Path, per_inch: tuple[float, float], orientation: int = 1) -> Path:
    if path.suffix == ".png":
        return with_chunks(path, phys(*(round(value / 0.0254) for value in per_inch)))
    if path.suffix == ".jpg":
        exif = Image.Exif()
        exif[0x0112] = orientation
        Image.fromarray(CODES).save(path, dpi=tuple(map(round, per_inch)), exif=exif)
        return path
    Image.fromarray(CODES).save(path, dpi=per_inch)
    return path


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif"])
def test_pixels_that_are_not_square_are_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    for square in ((72, 72), (300, 299), (299.0, 300.0)):
        assert read(save(path, square)).width_px == 12
    with pytest.raises(StimulusError, match=r"1\.5 times as wide") as error:
        read(save(path, (200, 300)))
    assert "--resize 150%x100%" in str(error.value)
    with pytest.raises(StimulusError, match=r"its pixels are 0\.5 times as wide"):
        read(save(path, (200, 100)))


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif"])
def test_half_pictures_may_state_their_wide_pixels(tmp_path: Path, suffix: str) -> None:
    path = save(tmp_path / f"a.{suffix}", (100, 200))
    assert read(path, packing="side-by-side-half-crossed").width_px == 12
    for packing in ("side-by-side", "top-bottom-half"):
        with pytest.raises(StimulusError, match="2 times as wide as high"):
            read(path, packing=packing)
    high = save(tmp_path / f"b.{suffix}", (200, 100))
    assert read(high, packing="top-bottom-half").height_px == 8


def test_primaries_of_srgb_leave_its_curve_to_be_named(tmp_path: Path) -> None:
    path = with_chunks(tmp_path / "a.png", gama(0.45455), chrm(SRGB))
    assert read(path).width_px == 12
    with pytest.raises(StimulusError, match="declares no colour space"):
        read(path, None)


def test_primaries_and_power_of_adobe_rgb_declare_it(tmp_path: Path) -> None:
    path = with_chunks(tmp_path / "a.png", gama(0.4547), chrm(ADOBE))
    np.testing.assert_array_equal(read(path, None).left, read(with_chunks(tmp_path / "b.png"), "adobe-rgb").left)
    with pytest.raises(StimulusError, match="adobe-rgb, and srgb is asked for"):
        read(path)


@pytest.mark.parametrize(
    "chunks", [[gama(0.45455), chrm(P3)], [chrm(ADOBE)], [chrm((0.0,) * 8)], [chrm((0.3457, 0.3585, *SRGB[2:]))]]
)
def test_other_primaries_without_a_profile_are_refused(tmp_path: Path, chunks: list[tuple[bytes, bytes]]) -> None:
    """As sRGB they would be shown in wrong colours without a word."""
    with pytest.raises(StimulusError, match=r"cHRM states .*ICC profile"):
        read(with_chunks(tmp_path / "a.png", *chunks))


def test_what_stands_before_cHRM_counts(tmp_path: Path) -> None:
    """PNG's order: cICP, iCCP, sRGB, then gAMA and cHRM."""
    assert read(with_chunks(tmp_path / "a.png", (b"sRGB", b"\0"), chrm(P3)), None).width_px == 12
    declared = read(with_chunks(tmp_path / "b.png", (b"cICP", bytes([12, 13, 0, 1])), chrm(ADOBE)), None)
    np.testing.assert_array_equal(declared.left, read(with_chunks(tmp_path / "c.png"), "display-p3").left)


@pytest.mark.parametrize(("xy", "right"), [(SRGB, True), (ADOBE, False)])
def test_a_tiff_s_primaries(tmp_path: Path, xy: tuple[float, ...], right: bool) -> None:
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[318], tags[319] = xy[:2], xy[2:]
    Image.fromarray(CODES).save(tmp_path / "a.tif", tiffinfo=tags)
    if right:
        assert read(tmp_path / "a.tif").width_px == 12
        return
    with pytest.raises(StimulusError, match="tag PrimaryChromaticities"):
        read(tmp_path / "a.tif")


def test_turned_pictures_turn_their_pixels(tmp_path: Path) -> None:
    with pytest.raises(StimulusError, match=r"its pixels are 1\.5 times as wide"):
        read(save(tmp_path / "a.jpg", (300, 200), orientation=6))


@pytest.mark.parametrize(("across", "down"), [(0, 0), (0, 72), (72, 0)])
def test_a_resolution_of_nothing_states_nothing(tmp_path: Path, across: int, down: int) -> None:
    assert read(with_chunks(tmp_path / "a.png", phys(across, down))).width_px == 12
    save(tmp_path / "a.jpg", (72, 72))
    data = bytearray((tmp_path / "a.jpg").read_bytes())
    at = data.index(b"JFIF\0") + 8
    data[at : at + 4] = struct.pack(">HH", across, down)
    (tmp_path / "a.jpg").write_bytes(data)
    assert read(tmp_path / "a.jpg").width_px == 12
