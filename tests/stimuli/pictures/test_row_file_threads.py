"""Rows of one file read and written by several threads at once: each gets its own."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from stimuli.pictures import RowFile


def test_threads_read_and_write_their_own_rows() -> None:
    numbered = np.repeat(np.arange(64, dtype=np.float32), 20_000 * 3).reshape(64, 20_000, 3)
    rows = RowFile.of(numbered)

    def read_and_write(row: int) -> bool:
        right = all(bool((rows[row : row + 1] == row).all()) for _ in range(20))
        rows.write(row, numbered[row : row + 1])
        return right

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(read_and_write, list(range(64)) * 2))
    assert np.array_equal(rows[:], numbered)
