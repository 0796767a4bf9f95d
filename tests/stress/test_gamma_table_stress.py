"""Thousands of gamma tables and drivers: changes are found, nothing else is refused; any record is read or refused."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import GammaTable
from devices.errors import DeviceError

pytestmark = pytest.mark.stress
CASES = 3000


def rounded(shares: NDArray[np.float64], bits: int, half: float) -> GammaTable:
    value = np.floor(shares * (2**bits - 1) + half).astype(np.int64)
    return GammaTable((value << (16 - bits)).astype(np.uint16))


def drawn(rng: np.random.Generator, size: int) -> NDArray[np.float64]:
    at = np.linspace(0.0, 1.0, size)[:, None]
    return np.asarray(at ** rng.uniform(0.7, 1.5, 3) * rng.uniform(0.5, 1.0, 3))


def test_what_one_driver_reads_twice_is_the_same_and_one_step_is_not() -> None:
    rng = np.random.default_rng(11)
    for _ in range(CASES):
        size, bits = int(rng.choice([256, 1024, 2048, 4096])), int(rng.integers(8, 13))
        shares, half = drawn(rng, size), float(rng.choice([1e-9, 0.5]))
        table = rounded(shares, bits, half)
        assert table.same_as(rounded(shares, bits, half))
        changed = np.array(table.entries, dtype=np.int64)
        row, channel = int(rng.integers(size // 2, size)), int(rng.integers(3))
        changed[row, channel] -= 1 << (16 - bits)
        assert table.same_as(GammaTable(changed.astype(np.uint16))) is False


def test_what_drivers_of_other_sizes_or_bits_read_is_the_same() -> None:
    rng = np.random.default_rng(12)
    for _ in range(CASES):
        sizes, bits = rng.choice([256, 1024, 4096], 2), rng.integers(8, 17, 2)
        if sizes[0] == sizes[1] and bits[0] == bits[1]:
            continue
        seed, half = int(rng.integers(2**32)), rng.choice([1e-9, 0.5], 2)
        one, two = (
            rounded(drawn(np.random.default_rng(seed), int(size)), int(depth), float(cut))
            for size, depth, cut in zip(sizes, bits, half, strict=True)
        )
        assert one.is_identity or two.is_identity or one.same_as(two)


def test_any_record_is_read_or_refused() -> None:
    rng = np.random.default_rng(13)
    whole = GammaTable.from_shares(drawn(rng, 256)).to_text()
    refused = 0
    for _ in range(CASES):
        text = list(whole)
        for place in rng.integers(0, len(text), int(rng.integers(1, 6))):
            text[int(place)] = chr(int(rng.integers(32, 127)))
        try:
            GammaTable.from_text("".join(text[: int(rng.integers(1, len(text) + 1))]))
        except DeviceError:
            refused += 1
    assert refused > CASES / 2
