"""The parts of a profile: headers, curves, tables, the gamma table; damaged ones are refused."""

from __future__ import annotations

import re
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.characterise import thesis_display
from devices.display import GammaTable
from devices.errors import DeviceError
from devices.profiles import model_of_profile, read_profile
from devices.profiles.colour_table import read_table
from devices.profiles.curves import curve_at, curves_at
from devices.profiles.profile import profile_of, read_gamma_table
from devices.profiles.tag_table import Tag, parse_profile_file
from devices.readings import Measurements, profile_measurements
from devices.readings.ti3 import format_ti3
from documents.arrays import Floats
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import CHAD, curv, matrix_tags, para, profile, s15, text, vcgt
from tests.kept import known

# Headers and tag tables: every fault has one line that names the file, the place and what would be right.

GOOD = profile(matrix_tags(curv(0x0233)))


def _refused(data: bytes) -> list[str]:
    with pytest.raises(DeviceError) as caught:
        parse_profile_file(data, "display.icc")
    return str(caught.value).splitlines()


def test_the_header_and_the_places_of_the_tags_are_read() -> None:
    content = parse_profile_file(GOOD, "display.icc")
    assert content.version == (4, 0)
    assert content.pcs == "XYZ"
    lumi = known(content.tag("lumi"))
    assert lumi.type == "XYZ "
    assert lumi.fixed(8, 3).tolist() == [0.0, 100.0, 0.0]
    assert content.tag("A2B0") is None


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no ICC profile"),
        (b"\0" * 5000, "no ICC profile"),
        (GOOD[:131], "no ICC profile"),
        (profile({}, kind=b"prtr", space=b"CMYK", pcs=b"Lab "), "a printer (class 'prtr', colours 'CMYK')"),
        (profile({}, kind=b"nmcl"), "named colours"),
        (profile({}, kind=b"link"), "a link between two devices"),
        (profile({}, space=b"GRAY"), "'GRAY', not RGB"),
        (profile({}, pcs=b"HSV "), "connects to 'HSV'"),
        (profile({}, version=5), "version 5"),
        (GOOD[:-40], "was cut off"),
    ],
)
def test_what_is_no_profile_of_a_display_is_refused_in_one_line(data: bytes, words: str) -> None:
    (line,) = _refused(data)
    assert line.startswith("display.icc: ")
    assert words in line


def test_a_broken_tag_table_of_version_2_names_every_tag_that_lies_outside() -> None:
    data = bytearray(profile(matrix_tags(curv(0x0233)), version=2))
    struct.pack_into(">I", data, 132 + 4, 0xFFFFFFF0)
    struct.pack_into(">I", data, 132 + 12 + 8, 3)
    lines = _refused(bytes(data))
    assert len(lines) == 2
    assert "'rXYZ' lies at byte 4294967280" in lines[0]
    assert "'gXYZ'" in lines[1]
    assert "3 bytes" in lines[1]


def test_more_tags_than_the_file_can_hold_are_refused() -> None:
    data = bytearray(GOOD)
    struct.pack_into(">I", data, 128, 2**32 - 1)
    (line,) = _refused(bytes(data))
    assert "4294967295 tags" in line


def test_a_tag_twice_is_refused() -> None:
    data = bytearray(GOOD)
    data[132 + 12 : 132 + 16] = b"rXYZ"
    assert "stands twice" in "".join(_refused(bytes(data)))


def test_a_large_file_of_zeros_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "zeros.icc"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(DeviceError, match="larger than 32 MB"):
        read_profile(path)
    with pytest.raises(DeviceError, match="there is no such file"):
        read_profile(tmp_path / "none.icc")


# Curves of a profile against their formulas.

X = np.linspace(0, 1, 301)


def _curve(data: bytes) -> Floats:
    return curve_at(Tag("display.icc", "rTRC", data))[0](X)


@pytest.mark.parametrize(
    ("data", "formula"),
    [
        (curv(), lambda x: x),
        (curv(0x0233), lambda x: x ** (0x233 / 256)),
        (curv(0, 10000, 65535), lambda x: np.interp(x, [0, 0.5, 1], [0, 10000 / 65535, 1])),
        (para(0, 2.5), lambda x: x**2.5),
        (para(1, 2.0, 1.25, -0.25), lambda x: np.where(x >= 0.2, np.maximum(1.25 * x - 0.25, 0) ** 2, 0)),
        (para(2, 2.0, 0.5, 0.25, 0.125), lambda x: (0.5 * x + 0.25) ** 2 + 0.125),
        (para(2, 2.0, 1.0, -0.25, 0.125), lambda x: np.where(x >= 0.25, np.maximum(x - 0.25, 0) ** 2, 0) + 0.125),
        (para(3, 2.0, 0.75, 0.25, 0.125, 0.5), lambda x: np.where(x >= 0.5, (0.75 * x + 0.25) ** 2, x / 8)),
        (
            para(4, 2.0, 0.75, 0.125, 0.25, 0.5, 0.0625, 0.03125),
            lambda x: np.where(x >= 0.5, (0.75 * x + 0.125) ** 2 + 0.0625, x / 4 + 0.03125),
        ),
    ],
)
def test_a_curve_is_its_formula(data: bytes, formula: Callable[[Floats], Floats]) -> None:
    np.testing.assert_allclose(_curve(data), formula(X), rtol=0, atol=1e-12)


def test_what_leaves_the_range_is_clipped() -> None:
    assert _curve(para(1, 30000.0, 2.0, 0.0))[-1] == 1.0
    assert _curve(para(4, 1.0, 1.0, -0.5, 0.0, 0.0, 0.0, 0.0))[0] == 0.0


def test_curves_follow_each_other_at_multiples_of_four_bytes() -> None:
    data = curv(0x0200) + b"\0\0" + curv(0, 1, 65535) + b"\0\0" + para(0, 3.0)
    first, second, third = curves_at(Tag("display.icc", "A2B0", data), 0, 3)
    assert float(first(0.5)) == 0.25
    assert float(third(0.5)) == 0.125
    assert second(0.5) == pytest.approx(1 / 65535)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (curv(0), "gamma of 0"),
        (para(0, -1.0), "gamma -1"),
        (para(1, 2.0, 0.0, 0.5), "a 0"),
        (b"para\0\0\0\0\0\x09\0\0", "parametric function 9"),
        (para(3, 2.0), "needs"),
        (b"curv\0\0\0\0\xff\xff\xff\xff", "needs 8589934602 bytes and has 12"),
        (b"XYZ \0\0\0\0", "type 'XYZ '"),
        (b"cur", "needs 4 bytes"),
    ],
)
def test_a_damaged_curve_is_refused(data: bytes, words: str) -> None:
    with pytest.raises(DeviceError, match=re.escape(words)) as caught:
        _curve(data)
    assert "'rTRC'" in str(caught.value)


# The tag `vcgt`, read against bytes written here.
def _read(data: bytes) -> GammaTable:
    return read_gamma_table(Tag("display.icc", "vcgt", data))


def test_a_table_of_16_bits_is_read_to_its_last_bit() -> None:
    values = np.random.default_rng(1).integers(0, 65536, (3, 256))
    table = _read(vcgt(3, 2, values.ravel().tolist()))
    np.testing.assert_array_equal(known(table.entries).T, values)
    assert np.abs(table.shares - values.T / 65535).max() < 1e-4


def test_a_table_of_8_bits_spans_the_same_range_and_one_channel_serves_all() -> None:
    table = _read(vcgt(1, 1, [0, 100, 255]))
    np.testing.assert_allclose(table.shares, np.repeat([[0.0], [100 / 255], [1.0]], 3, axis=1), atol=1e-12)


def test_a_formula_is_gamma_between_least_and_most() -> None:
    rows = [(1.1, 0.02, 0.9), (1.0, 0.0, 1.0), (2.0, 0.0, 0.5)]
    table = _read(b"vcgt\0\0\0\0" + struct.pack(">I", 1) + s15(*(number for row in rows for number in row)))
    codes = np.linspace(0, 1, 11)
    wanted = np.stack([low + (high - low) * codes**gamma for gamma, low, high in rows], axis=1)
    assert np.abs(table.at(codes) - wanted).max() < 1e-4


@pytest.mark.parametrize("filling", [2, 22, 1000])
def test_filling_behind_the_table_is_no_fault(filling: int) -> None:
    values = [0, 30000, 65535] * 3
    assert _read(vcgt(3, 2, values) + b"\xff" * filling).same_as(_read(vcgt(3, 2, values)))
    assert _read(vcgt(3, 1, [0, 255] * 3) + b"\0\0").size == 2


def test_adobe_s_table_of_16_bits_that_says_8() -> None:
    values = np.random.default_rng(1).integers(0, 65536, 768).tolist()
    said = bytearray(vcgt(3, 2, values) + b"\0" * 22)
    said[17] = 1
    assert _read(bytes(said)).same_as(_read(vcgt(3, 2, values)))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (vcgt(3, 2, [0] * 300, entries=256), "3 channels of 256 entries of 2 bytes, and holds 600 bytes"),
        (vcgt(3, 1, [0] * 1536, entries=256), "3 channels of 256 entries of 1 bytes, and holds 1536 bytes"),
        (vcgt(2, 2, [0] * 512), "2 channels"),
        (vcgt(3, 2, [0, 0, 0]), "1 entries"),
        (b"vcgt\0\0\0\0" + struct.pack(">IHHH", 0, 3, 256, 3), "3 bytes"),
        (b"vcgt\0\0\0\0" + struct.pack(">I", 7), "of the kind 7"),
        (b"vcgt\0\0\0\0" + struct.pack(">I", 1) + s15(*[0.0] * 9), "gamma 0, least 0, most 0"),
        (b"vcgt\0\0\0\0" + struct.pack(">I", 1), "needs 48 bytes and has 12"),
        (b"curv\0\0\0\0", "of the type 'curv'"),
    ],
)
def test_a_table_of_another_size_is_refused_with_its_figures(data: bytes, words: str) -> None:
    with pytest.raises(DeviceError, match=re.escape(words)) as caught:
        _read(data)
    assert "display.icc: the tag 'vcgt'" in str(caught.value)
    assert len(caught.value.findings) == 1


# Tables of a profile: what they give is what LittleCMS gives, and damaged ones are refused.

RNG = np.random.default_rng(1)
CODES = np.concatenate([RNG.random((400, 3)), np.eye(3), np.zeros((1, 3)), np.ones((1, 3))])


def _smooth_grid(shape: tuple[int, int, int]) -> np.ndarray:
    """Return a grid (r, g, b, 3) of 0..1 that rises with all channels, with some noise."""
    axes = np.meshgrid(*(np.linspace(0, 1, points) for points in shape), indexing="ij")
    colours = np.stack([0.3 * axes[0] + 0.2 * axes[1] + 0.1, 0.6 * axes[1] + 0.2, 0.5 * axes[2] + 0.1 * axes[0]], -1)
    return np.asarray(colours + 0.1 * np.random.default_rng(2).random(colours.shape))


def _in_a_row(size: int) -> bytes:
    """Return ``mft1`` or ``mft2`` with a grid of 5 points."""
    full, form = (255, "B") if size == 1 else (65535, "H")
    n, m = (256, 256) if size == 1 else (17, 33)
    first = np.linspace(0, 1, n) ** 1.4
    last = np.linspace(0, 1, m) ** 0.9
    values = np.concatenate([np.tile(first, 3), _smooth_grid((5, 5, 5)).ravel(), np.tile(last, 3)])
    head = (b"mft1" if size == 1 else b"mft2") + b"\0\0\0\0" + bytes([3, 3, 5, 0])
    head += s15(1, 0, 0, 0, 1, 0, 0, 0, 1) + (b"" if size == 1 else struct.pack(">HH", n, m))
    return head + struct.pack(f">{values.size}{form}", *np.rint(values * full).astype(int).tolist())


def _by_offsets(shape: tuple[int, int, int], size: int, *, matrix: bool) -> bytes:
    """Return ``mAB `` with curves of several kinds."""
    full, form = (255, "B") if size == 1 else (65535, "H")
    grid = np.rint(_smooth_grid(shape) * full).astype(int).ravel().tolist()
    last = curv() * 3
    middle = para(0, 1.1) * 3
    rows = s15(0.8, 0.1, 0, 0, 0.9, 0.05, 0.1, 0, 0.7, 0.01, 0.02, 0.0)
    clut = bytes([*shape, *[0] * 13, size, 0, 0, 0]) + struct.pack(f">{len(grid)}{form}", *grid)
    clut += b"\0" * (-len(clut) % 4)
    first = curv(*(round(65535 * (i / 63) ** 1.7) for i in range(64))) * 3
    parts, at = [last, rows if matrix else b"", middle if matrix else b"", clut, first], 32
    offsets = []
    for part in parts:
        offsets.append(at if part else 0)
        at += len(part)
    return b"mAB \0\0\0\0" + bytes([3, 3, 0, 0]) + struct.pack(">5I", *offsets) + b"".join(parts)


TABLES = {
    "8 bits": _in_a_row(1),
    "16 bits": _in_a_row(2),
    "mAB": _by_offsets((5, 4, 6), 2, matrix=True),
    "mAB, 8 bits, no matrix": _by_offsets((3, 3, 3), 1, matrix=False),
}


# XYZ have no coding in 8 bits.
@pytest.mark.parametrize(
    ("name", "pcs"),
    [(name, pcs) for name in TABLES for pcs in (b"XYZ ", b"Lab ") if (name, pcs) != ("8 bits", b"XYZ ")],
)
def test_a_table_gives_what_littlecms_gives(name: str, pcs: bytes) -> None:
    tag = TABLES[name]
    chad = b"sf32\0\0\0\0" + s15(*CHAD)
    wanted = through(profile({"A2B0": tag, "chad": chad}, pcs=pcs), CODES)
    found = read_table(Tag("display.icc", "A2B0", tag), pcs.decode().strip()).xyz(CODES)
    # LittleCMS keeps sampled curves in 16 bits.
    assert np.abs(found - wanted).max() < 1.5e-4
    assert np.abs(found).max() > 0.3


@pytest.mark.parametrize(
    ("tag", "words"),
    [
        (b"mft2\0\0\0\0\x04\x03\x05\0", "leads from 4 channels to 3"),
        (b"mft2\0\0\0\0\x03\x03\x01\0", "grid of 1 points"),
        (b"mft2\0\0\0\0\x03\x03\x05\0" + b"\0" * 40, "curves of 0 entries"),
        (b"mft1\0\0\0\0\x03\x03\xff\0" + b"\0" * 40, "needs 816 bytes"),
        (b"mft1\0\0\0\0\x03\x03\xff\0" + b"\0" * 900, "needs 49744941 bytes and has 912"),
        (b"curv\0\0\0\0", "type 'curv'"),
        (b"mAB \0\0\0\0\x03\x03\0\0" + b"\0" * 20, "no curves at its end"),
        (b"mAB \0\0\0\0\x03\x03\0\0" + struct.pack(">5I", 32, 0, 0, 32, 0) + curv() * 3, "grid without curves"),
        (b"mAB \0\0\0\0\x03\x03\0\0" + struct.pack(">5I", 2**32 - 1, 0, 0, 0, 0), "needs 4294967299 bytes"),
        (
            b"mAB \0\0\0\0\x03\x03\0\0" + struct.pack(">5I", 32, 0, 0, 68, 32) + curv() * 3 + b"\xff" * 3 + b"\0" * 17,
            "255x255x255 points in numbers of 0 bytes",
        ),
    ],
)
def test_a_damaged_table_is_refused(tag: bytes, words: str) -> None:
    with pytest.raises(DeviceError, match=re.escape(words)):
        read_table(Tag("display.icc", "A2B0", tag), "Lab").xyz(CODES)


# Damaged profiles: whatever bytes are cut off or changed, the answer is a reading or a refusal, and comes soon.
@cache
def whole_profiles() -> dict[str, bytes]:
    from extensions.profiles import profile_of_model

    readings = Measurements(np.eye(3), np.eye(3) * 50 + 1)
    table = {"vcgt": vcgt(3, 2, [0, 30000, 65535] * 3)}
    return {
        "matrix": profile(matrix_tags(para(3, 2.4, 0.948, 0.052, 0.0774, 0.04)) | table),
        "sampled": profile(matrix_tags(curv(*range(0, 65536, 1057))), version=2),
        "mft2": profile(matrix_tags(curv()) | {"A2B0": TABLES["16 bits"]}, pcs=b"Lab ", version=2),
        "mAB": profile(matrix_tags(curv()) | {"A2B1": TABLES["mAB"]}),
        "readings": profile({"targ": text(format_ti3(readings))} | table, version=2),
        "own": profile_of_model(thesis_display(), "own").data,
    }


def _hostile_read(data: bytes) -> None:
    """Read ``data`` every way; fail unless each gives finite light or refuses with a DeviceError."""
    with suppress(DeviceError):
        made = profile_of(parse_profile_file(data, "display.icc"))
        with suppress(DeviceError):
            assert np.all(np.isfinite(profile_measurements(made, 100.0).XYZ))
        assert np.all(np.isfinite(model_of_profile(made, 100.0).model.xyz(np.eye(3))))


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(sorted(whole_profiles())), st.data())
def test_changed_bytes_give_a_reading_or_a_refusal(name: str, data: st.DataObject) -> None:
    whole = bytearray(whole_profiles()[name])
    # Most of what matters stands in the first kilobyte: header, tag table, heads of tags.
    places = st.one_of(st.integers(0, min(1000, len(whole) - 1)), st.integers(0, len(whole) - 1))
    for place, value in data.draw(st.lists(st.tuples(places, st.integers(0, 255)), min_size=1, max_size=6)):
        whole[place] = value
    _hostile_read(bytes(whole))


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(sorted(whole_profiles())), st.data())
def test_a_profile_cut_off_is_refused(name: str, data: st.DataObject) -> None:
    whole = whole_profiles()[name]
    cut = whole[: data.draw(st.integers(0, len(whole) - 1))]
    with pytest.raises(DeviceError):
        parse_profile_file(cut, "display.icc")
    # Though its header say that it is whole.
    if len(cut) > 4:
        _hostile_read(len(cut).to_bytes(4) + cut[4:])


def test_tables_that_only_announce_their_size_take_no_time_and_no_memory(tmp_path: Path) -> None:
    began = time.process_time()
    for tag in (b"mft2\0\0\0\0\x03\x03\xff\0" + b"\xff" * 60, b"curv\0\0\0\0\xff\xff\xff\xff", b"mAB " + b"\xff" * 40):
        for name in ("A2B0", "rTRC", "vcgt", "chad", "lumi"):
            _hostile_read(profile(matrix_tags(curv()) | {name: tag}))
    assert time.process_time() - began < 2.0


def test_tags_may_share_their_bytes() -> None:
    data = bytearray(whole_profiles()["sampled"])
    count = int.from_bytes(data[128:132])
    entries = {bytes(data[at : at + 4]): at for at in range(132, 132 + 12 * count, 12)}
    data[entries[b"gTRC"] + 4 : entries[b"gTRC"] + 12] = data[entries[b"rTRC"] + 4 : entries[b"rTRC"] + 12]
    model = model_of_profile(profile_of(parse_profile_file(bytes(data), "display.icc"))).model
    assert model.curves[0] == model.curves[1]
