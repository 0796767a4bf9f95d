"""The tag `vcgt`, read against bytes written here."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from devices.display import GammaTable
from devices.errors import DeviceError
from devices.profiles.profile import read_gamma_table
from devices.profiles.tag_table import Tag
from tests.devices.profiles.profile_bytes import s15, vcgt


def _read(data: bytes) -> GammaTable:
    return read_gamma_table(Tag("display.icc", "vcgt", data))


def test_a_table_of_16_bits_is_read_to_its_last_bit() -> None:
    values = np.random.default_rng(1).integers(0, 65536, (3, 256))
    table = _read(vcgt(3, 2, values.ravel().tolist()))
    assert table.entries is not None
    np.testing.assert_array_equal(table.entries.T, values)
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
    with pytest.raises(DeviceError) as caught:
        _read(data)
    assert words in str(caught.value)
    assert "display.icc: the tag 'vcgt'" in str(caught.value)
    assert len(caught.value.findings) == 1
