"""What pictures state of themselves: profiles with and without tables, primaries, pixels that are not square."""

from __future__ import annotations

import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image, ImageCms, TiffImagePlugin

from devices.characterise import thesis_display
from devices.errors import DeviceError
from devices.profiles import model_of_profile, read_profile
from devices.profiles.tag_table import parse_profile_file
from devices.readings import profile_measurements, read_profile_measurements
from runner.cli.main import group
from stimuli.errors import StimulusError
from stimuli.pictures import ColourSpace, Packing, StereoImage, find_pictures, read_picture
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import CHAD, COLORANTS, matrix_tags, para, profile, text, vcgt

# Profiles inside of pictures: what a picture does not need of them, how large they may be, what ranks above them.

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


# A profile with a table beside its matrix: the table holds [ICC2022], for pictures and for displays alike.

TABLES_CODES = np.random.default_rng(3).integers(0, 256, (8, 12, 3), dtype=np.uint8)
ADAPTATION = np.reshape(CHAD, (3, 3))


def tables(*names: str) -> dict[str, bytes]:
    """Return a table of a display whose primaries and curves are not sRGB's, under ``names``."""
    from extensions.profiles import profile_of_model

    content = parse_profile_file(profile_of_model(thesis_display(), "display", kind="table", points=9).data, "made")
    tag = content.tag("A2B0")
    assert tag is not None
    return dict.fromkeys(names, tag.data)


def tables_read(path: Path, data: bytes, codes: np.ndarray = TABLES_CODES) -> StereoImage:
    Image.fromarray(codes).save(path, icc_profile=data)
    return read_picture(path, white_luminance_cd_m2=100)


@pytest.mark.parametrize("names", [("A2B0",), ("A2B0", "A2B1")])
def test_the_table_holds_where_there_is_a_matrix_too(tmp_path: Path, names: tuple[str, ...]) -> None:
    both = profile(matrix_tags(para(0, 1.8)) | tables(*names))
    found = tables_read(tmp_path / "both.png", both).left.reshape(-1, 3)
    wanted = 100 * through(both, TABLES_CODES.reshape(-1, 3) / 255) @ np.linalg.inv(ADAPTATION).T
    # LittleCMS keeps sampled curves in 16 bits; the matrix is off by more than a cd/m².
    assert np.abs(found - wanted).max() < 0.1
    by_matrix = tables_read(tmp_path / "matrix.png", profile(matrix_tags(para(0, 1.8)))).left.reshape(-1, 3)
    assert np.abs(by_matrix - wanted).max() > 5


def test_a_matrix_alone_stays_exact(tmp_path: Path) -> None:
    found = tables_read(tmp_path / "a.png", profile(matrix_tags(para(0, 1.8)))).left.reshape(-1, 3)
    primaries = np.stack([COLORANTS[name] for name in ("rXYZ", "gXYZ", "bXYZ")], axis=1)
    wanted = 100 * (TABLES_CODES.reshape(-1, 3) / 255) ** 1.8 @ (np.linalg.inv(ADAPTATION) @ primaries).T
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=2e-3)


@pytest.mark.parametrize("more", [{}, tables("A2B1")])
def test_pictures_and_displays_read_one_light(tmp_path: Path, more: dict[str, bytes]) -> None:
    (tmp_path / "display.icc").write_bytes(profile(matrix_tags(para(0, 1.8)) | more))
    readings = profile_measurements(read_profile(tmp_path / "display.icc"))
    codes = np.rint(255 * readings.codes)
    whole = np.abs(codes - 255 * readings.codes).max(axis=1) < 1e-6
    assert whole.sum() > 20
    picture = tables_read(
        tmp_path / "a.png", (tmp_path / "display.icc").read_bytes(), codes[whole][None].astype(np.uint8)
    )
    np.testing.assert_allclose(picture.left[0], readings.XYZ[whole], rtol=1e-5, atol=1e-5)


@pytest.mark.nightly
def test_display_fit_takes_the_table_and_the_matrix_says_that_it_is_not_all(tmp_path: Path) -> None:
    path = tmp_path / "display.icc"
    path.write_bytes(profile(matrix_tags(para(0, 1.8)) | tables("A2B1")))
    told = CliRunner().invoke(group, ["display", "fit", str(path), "--json", "--brief"])
    assert told.exit_code == 0, told.output
    assert "('A2B1')" in " ".join(json.loads(told.stdout)["both"]["said"])
    assert any("ranks above" in note for note in model_of_profile(read_profile(path)).notes)
    path.write_bytes(profile(matrix_tags(para(0, 1.8))))
    assert not any("ranks above" in note for note in model_of_profile(read_profile(path)).notes)
    path.write_bytes(profile({name: tag for name, tag in matrix_tags(para(0, 1.8)).items() if "XYZ" not in name}))
    with pytest.raises(DeviceError):
        read_profile_measurements(path)


def test_a_damaged_matrix_is_not_needed_beside_a_table(tmp_path: Path) -> None:
    tags = matrix_tags(para(0, 1.8)) | tables("A2B1")
    whole = tables_read(tmp_path / "a.png", profile(tags))
    del tags["rTRC"]
    np.testing.assert_array_equal(tables_read(tmp_path / "b.png", profile(tags)).left, whole.left)


# What ordinary files state beside their codes: pixels that are not square, and primaries without a profile.

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


def stated_read(path: Path, space: Any = "srgb", packing: Packing | None = None) -> StereoImage:
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
        assert stated_read(save(path, square)).width_px == 12
    with pytest.raises(StimulusError, match=r"1\.5 times as wide") as error:
        stated_read(save(path, (200, 300)))
    assert "--resize 150%x100%" in str(error.value)
    with pytest.raises(StimulusError, match=r"its pixels are 0\.5 times as wide"):
        stated_read(save(path, (200, 100)))


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif"])
def test_half_pictures_may_state_their_wide_pixels(tmp_path: Path, suffix: str) -> None:
    path = save(tmp_path / f"a.{suffix}", (100, 200))
    assert stated_read(path, packing="side-by-side-half-crossed").width_px == 12
    for packing in ("side-by-side", "top-bottom-half"):
        with pytest.raises(StimulusError, match="2 times as wide as high"):
            stated_read(path, packing=packing)
    high = save(tmp_path / f"b.{suffix}", (200, 100))
    assert stated_read(high, packing="top-bottom-half").height_px == 8


def test_primaries_of_srgb_leave_its_curve_to_be_named(tmp_path: Path) -> None:
    path = with_chunks(tmp_path / "a.png", gama(0.45455), chrm(SRGB))
    assert stated_read(path).width_px == 12
    with pytest.raises(StimulusError, match="declares no colour space"):
        stated_read(path, None)


def test_primaries_and_power_of_adobe_rgb_declare_it(tmp_path: Path) -> None:
    path = with_chunks(tmp_path / "a.png", gama(0.4547), chrm(ADOBE))
    np.testing.assert_array_equal(
        stated_read(path, None).left, stated_read(with_chunks(tmp_path / "b.png"), "adobe-rgb").left
    )
    with pytest.raises(StimulusError, match="adobe-rgb, and srgb is asked for"):
        stated_read(path)


@pytest.mark.parametrize(
    "chunks", [[gama(0.45455), chrm(P3)], [chrm(ADOBE)], [chrm((0.0,) * 8)], [chrm((0.3457, 0.3585, *SRGB[2:]))]]
)
def test_other_primaries_without_a_profile_are_refused(tmp_path: Path, chunks: list[tuple[bytes, bytes]]) -> None:
    """As sRGB they would be shown in wrong colours without a word."""
    with pytest.raises(StimulusError, match=r"cHRM states .*ICC profile"):
        stated_read(with_chunks(tmp_path / "a.png", *chunks))


def test_what_stands_before_cHRM_counts(tmp_path: Path) -> None:
    """PNG's order: cICP, iCCP, sRGB, then gAMA and cHRM."""
    assert stated_read(with_chunks(tmp_path / "a.png", (b"sRGB", b"\0"), chrm(P3)), None).width_px == 12
    declared = stated_read(with_chunks(tmp_path / "b.png", (b"cICP", bytes([12, 13, 0, 1])), chrm(ADOBE)), None)
    np.testing.assert_array_equal(declared.left, stated_read(with_chunks(tmp_path / "c.png"), "display-p3").left)


@pytest.mark.parametrize(("xy", "right"), [(SRGB, True), (ADOBE, False)])
def test_a_tiff_s_primaries(tmp_path: Path, xy: tuple[float, ...], right: bool) -> None:
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[318], tags[319] = xy[:2], xy[2:]
    Image.fromarray(CODES).save(tmp_path / "a.tif", tiffinfo=tags)
    if right:
        assert stated_read(tmp_path / "a.tif").width_px == 12
        return
    with pytest.raises(StimulusError, match="tag PrimaryChromaticities"):
        stated_read(tmp_path / "a.tif")


def test_turned_pictures_turn_their_pixels(tmp_path: Path) -> None:
    with pytest.raises(StimulusError, match=r"its pixels are 1\.5 times as wide"):
        stated_read(save(tmp_path / "a.jpg", (300, 200), orientation=6))


@pytest.mark.parametrize(("across", "down"), [(0, 0), (0, 72), (72, 0)])
def test_a_resolution_of_nothing_states_nothing(tmp_path: Path, across: int, down: int) -> None:
    assert stated_read(with_chunks(tmp_path / "a.png", phys(across, down))).width_px == 12
    save(tmp_path / "a.jpg", (72, 72))
    data = bytearray((tmp_path / "a.jpg").read_bytes())
    at = data.index(b"JFIF\0") + 8
    data[at : at + 4] = struct.pack(">HH", across, down)
    (tmp_path / "a.jpg").write_bytes(data)
    assert stated_read(tmp_path / "a.jpg").width_px == 12
