"""The gamma table: read back by drivers of other sizes and bits, it is the same; changed, it is not."""

from __future__ import annotations

import zlib
from base64 import b64encode
from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.display import GammaTable
from devices.errors import DeviceError

SIZES = st.sampled_from([17, 256, 1024, 2048, 4096])
BITS = st.sampled_from([8, 10, 12, 16])
ROUNDED = st.sampled_from(["floor", "nearest"])
WRITTEN = st.sampled_from(["zeros", "again", "rounded"])


def read_back(shares: NDArray[np.float64], bits: int, rounded: str, written: str) -> GammaTable:
    """``shares`` (n,) as a driver with hardware of ``bits`` bits returns them."""
    highest = 2**bits - 1
    value = (np.floor(shares * highest + 1e-9) if rounded == "floor" else np.rint(shares * highest)).astype(np.int64)
    if written == "zeros":
        entries = value << (16 - bits)
    elif written == "again":
        entries = value << (16 - bits) | value >> (2 * bits - 16)
    else:
        entries = np.rint(value * (65535 / highest)).astype(np.int64)
    return GammaTable(np.repeat(entries[:, None], 3, axis=1))


def curve(size: int, exponent: float) -> NDArray[np.float64]:
    return np.linspace(0, 1, size) ** exponent


@settings(max_examples=15)
@given(SIZES, BITS, ROUNDED, WRITTEN)
def test_an_identity_in_any_size_and_rounding_is_the_identity(size: int, bits: int, rounded: str, written: str) -> None:
    table = read_back(curve(size, 1.0), bits, rounded, written)
    assert table.is_identity
    assert table.same_as(GammaTable.identity())
    assert GammaTable.identity(1024).same_as(table)
    assert table.bits <= bits


@settings(max_examples=15)
@given(SIZES, ROUNDED, WRITTEN, st.sampled_from([0.5, 0.9, 1.01, 1.1, 2.2]))
def test_a_calibration_is_none(size: int, rounded: str, written: str, exponent: float) -> None:
    # Of 8 bits, gamma 1.01 departs by less than a step.
    for bits in (10, 16) if exponent == 1.01 else (8, 10, 16):
        table = read_back(curve(size, exponent), bits, rounded, written)
        assert not table.is_identity
        assert table.same_as(GammaTable.identity(size)) is False
        assert GammaTable.identity(256).same_as(table) is False


@settings(max_examples=15)
@given(SIZES, SIZES, BITS, ROUNDED, WRITTEN)
def test_a_calibration_read_by_another_driver_is_the_same(
    first: int, second: int, bits: int, rounded: str, written: str
) -> None:
    if 17 in (first, second):
        first = second = 17  # a line between 17 entries is no power
    one = GammaTable.from_shares(curve(first, 1.3))
    two = read_back(curve(second, 1.3), bits, rounded, written)
    assert one.same_as(two)
    assert two.same_as(one)
    other = read_back(curve(second, 1.35), bits, rounded, written)
    assert one.same_as(other) is False


@pytest.mark.parametrize("size", [256, 1024, 4096])
def test_one_step_of_one_entry_is_a_change(size: int) -> None:
    """The smallest change that hardware of 8 bits can make, and of 12 bits: both are found."""
    for bits, exponent in ((8, 1.0), (8, 1.3), (12, 1.0), (12, 1.3)):
        entries = np.array(read_back(curve(size, exponent), bits, "nearest", "zeros").entries)
        changed = entries.copy()
        changed[size // 2, 1] += 2 << (16 - bits)
        assert GammaTable(entries).same_as(GammaTable(changed)) is False
        assert GammaTable(entries).same_as(GammaTable(entries)) is True


def test_departures_are_codes_of_8_bits() -> None:
    entries = np.array(GammaTable.identity(256).entries)
    entries[100, 2] += 5 * 257
    assert GammaTable(entries).departure_codes == pytest.approx(5.0)
    assert GammaTable(entries).bits == 8
    assert GammaTable(np.zeros((256, 3), np.uint16)).departure_codes == pytest.approx(255)


def test_hash_is_of_the_bits_not_of_how_they_are_written() -> None:
    ways = {read_back(curve(256, 1.4), 8, "nearest", how).sha256 for how in ("zeros", "again", "rounded")}
    assert len(ways) == 1
    assert read_back(curve(256, 1.41), 8, "nearest", "zeros").sha256 not in ways
    assert GammaTable.identity(256).sha256 != GammaTable.identity(1024).sha256


@settings(max_examples=15)
@given(SIZES, st.floats(0.3, 3.0))
def test_records_give_the_table_back(size: int, exponent: float) -> None:
    table = GammaTable.from_shares(np.stack([curve(size, exponent), curve(size, 1.0), curve(size, 1.2)], axis=1))
    held = GammaTable.from_json(table.to_json())
    assert np.array_equal(np.asarray(held.entries), np.asarray(table.entries))
    identity = read_back(curve(size, 1.0), 10, "floor", "zeros")
    assert "entries" not in identity.to_json()
    assert GammaTable.from_json(identity.to_json()).same_as(identity)


def test_unknown_is_neither_same_nor_other() -> None:
    unknown = GammaTable.unreadable("Wayland has none")
    assert GammaTable.from_json(unknown.to_json()).unknown == "Wayland has none"
    assert unknown.same_as(GammaTable.identity()) is None
    assert GammaTable.identity().same_as(unknown) is None
    assert not unknown.is_identity
    assert np.isnan(unknown.departure_codes)
    assert unknown.sentence() == "unknown (Wayland has none)"
    with pytest.raises(DeviceError, match="Wayland has none"):
        assert unknown.shares.size


def test_shares_at_other_codes_are_interpolated() -> None:
    codes = np.array([0.0, 0.5, 0.8, 1.0])
    table = GammaTable.from_shares(codes / 2, codes)
    assert np.allclose(table.shares[:, 0], [0, 1 / 6, 1 / 3, 1 / 2], atol=1e-5)
    assert np.allclose(table.at([0.0, 0.25, 1.0])[:, 1], [0, 0.125, 0.5], atol=1e-5)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: GammaTable(None), "needs a reason"),
        (lambda: GammaTable(np.zeros((256, 4), np.uint16)), r"\(256, 4\)"),
        (lambda: GammaTable(np.zeros((1, 3), np.uint16)), r"\(1, 3\)"),
        (lambda: GammaTable(np.full((4, 3), 70000)), "whole numbers"),
        (lambda: GammaTable(cast(Any, np.zeros((4, 3)))), "whole numbers"),
        (lambda: GammaTable.from_shares([0.0, 1.2]), "in 0..1"),
        (lambda: GammaTable.from_shares([0.0, np.nan]), "in 0..1"),
        (lambda: GammaTable.from_shares([0.0, 0.5, 1.0], [0.0, 1.0, 0.5]), "rise from 0 to 1"),
        (lambda: GammaTable.from_json({"size": 4}), "size and hash"),
        (lambda: GammaTable.from_json({"size": 10**9, "hash": ""}), "2 to 65536"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "", "departure_codes": 3.0}), "needs its entries"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "", "entries": "%"}), "cannot be read"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "", "entries": packed(3)}), "does not hold the 4 entries"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "", "entries": packed(10**6)}), "does not hold the 4"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "no", "entries": packed(4)}), "is not that of its entries"),
    ],
)
def test_wrong_tables_are_refused(make: object, words: str) -> None:
    assert callable(make)
    with pytest.raises(DeviceError, match=words):
        make()


def packed(size: int) -> str:
    return b64encode(zlib.compress(bytes(6 * size))).decode()


def test_entries_are_decoded_once_and_nobody_changes_what_they_stand_for(monkeypatch: pytest.MonkeyPatch) -> None:
    from devices.display import gamma_table

    decode = Mock(wraps=gamma_table._decoded)
    monkeypatch.setattr(gamma_table, "_decoded", decode)
    table, other = (GammaTable.from_shares(np.linspace(0.0, 1.0, 256) ** power) for power in (1.0, 1.2))
    assert not table.same_as(other)
    assert (table.bits, table.is_identity, other.is_identity) == (8, True, False)
    assert table.to_json() != other.to_json()
    assert decode.call_count == 2
    with pytest.raises(ValueError, match="read-only"):
        table.shares[0] = 1.0
