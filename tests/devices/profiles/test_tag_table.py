"""Headers and tag tables: every fault has one line that names the file, the place and what would be right."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from devices.errors import DeviceError
from devices.profiles import read_profile
from devices.profiles.tag_table import parse_profile_file
from tests.devices.profiles.profile_bytes import curv, matrix_tags, profile

GOOD = profile(matrix_tags(curv(0x0233)))


def _refused(data: bytes) -> list[str]:
    with pytest.raises(DeviceError) as caught:
        parse_profile_file(data, "display.icc")
    return str(caught.value).splitlines()


def test_the_header_and_the_places_of_the_tags_are_read() -> None:
    content = parse_profile_file(GOOD, "display.icc")
    assert content.version == (4, 0)
    assert content.pcs == "XYZ"
    lumi = content.tag("lumi")
    assert lumi is not None
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
