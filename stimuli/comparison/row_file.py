"""Pictures that lie in a file without a name and are read a few rows at a time, so that none is whole in memory."""

from __future__ import annotations

import weakref
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from documents.platform import nameless_file, read_at, write_at

Floats32 = NDArray[np.float32]

# Pixels held at a time where a picture goes through memory.
BAND_PIXELS = 1 << 20


class RowFile:
    """XYZ in cd/m², float32 (height, width, 3): a `RowSource`. Its file is gone when it is.

    Rows are read and written, not mapped: a mapped file would count as this program's memory.
    """

    def __init__(self, shape: tuple[int, int, int]) -> None:
        self._shape = shape
        self._kept = nameless_file()
        self._file = self._kept.fileno()
        weakref.finalize(self, self._kept.close)
        self._row_bytes = shape[1] * shape[2] * 4

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and 3."""
        return self._shape

    def __getitem__(self, rows: slice, /) -> Floats32:
        """Return those rows, (rows, width, 3)."""
        start, stop, step = rows.indices(self._shape[0])
        if step != 1:
            raise ValueError("rows are read one after another")
        found = np.empty((max(0, stop - start), *self._shape[1:]), dtype=np.float32)
        if not found.size:
            return found
        view = found.data.cast("B")
        done = 0
        while done < len(view):
            read = read_at(self._file, view[done:], start * self._row_bytes + done)
            if read == 0:
                raise OSError("a picture's rows were read before they were written")
            done += read
        return found

    def write(self, first: int, rows: NDArray[np.floating]) -> None:
        """Put ``rows`` (n, width, 3) where row ``first`` begins."""
        view = np.ascontiguousarray(rows, dtype=np.float32).data.cast("B")
        done = 0
        while done < len(view):
            done += write_at(self._file, view[done:], first * self._row_bytes + done)

    def bands(self) -> Iterator[tuple[int, int]]:
        """Return first rows and rows after the last, some `BAND_PIXELS` pixels each."""
        return bands(self._shape)

    def plane(self, channel: int = 1) -> Floats32:
        """Return one channel, float32 (height, width); Y if not said."""
        found = np.empty(self._shape[:2], dtype=np.float32)
        for first, last in self.bands():
            found[first:last] = self[first:last][:, :, channel]
        return found

    @classmethod
    def of(cls, picture: NDArray[np.floating]) -> RowFile:
        """Return a copy of an array (height, width, 3)."""
        height, width, _ = picture.shape
        found = cls((height, width, 3))
        for first, last in found.bands():
            found.write(first, picture[first:last])
        return found


def bands(shape: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """Return first rows and rows after the last of a picture of ``shape``, some `BAND_PIXELS` pixels each."""
    height, width = shape[:2]
    rows = max(1, BAND_PIXELS // max(1, width))
    return ((first, min(first + rows, height)) for first in range(0, height, rows))
