"""Pictures that are read a few rows at a time, so that none needs to be whole in memory."""

from __future__ import annotations

import tempfile
import threading
import weakref
from collections.abc import Callable, Iterator
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from documents import in_threads
from documents.arrays import Floats32

Mask = NDArray[np.bool_]
# Called with how many rows of how many are done.
RowsDone = Callable[[int, int], None]
Result = TypeVar("Result")

# Pixels worked on at a time: some tens of megabytes of intermediate values.
BAND_PIXELS = 1 << 19


class Rows(Protocol):
    """A picture of shape (height, width, 3) whose rows are read by slicing; an array is one, and so is `RowFile`."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and 3."""
        ...

    def __getitem__(self, rows: slice, /) -> NDArray[np.floating]:
        """Return those rows, shape (rows, width, 3)."""
        ...


def bands(shape: tuple[int, ...]) -> Iterator[slice]:
    """Return slices that go through the rows of a picture of ``shape``, some `BAND_PIXELS` pixels each."""
    height, width = shape[:2]
    rows = max(1, BAND_PIXELS // max(width, 1))
    return (slice(start, min(start + rows, height)) for start in range(0, height, rows))


def over_bands(
    work: Callable[[slice], Result], shape: tuple[int, ...], rows_done: RowsDone | None = None
) -> list[Result]:
    """Return ``work`` of each of the `bands` of a picture of ``shape``, in their order, shared among threads.

    ``rows_done`` is called with how many rows of how many are done, by one thread at a time.
    """
    turn, done = threading.Lock(), 0

    def counted(band: slice) -> Result:
        nonlocal done
        result = work(band)
        if rows_done is not None:
            with turn:
                done += band.stop - band.start
                rows_done(done, shape[0])
        return result

    return in_threads(counted, bands(shape))


def bands_with_margin(shape: tuple[int, ...], margin: int) -> Iterator[tuple[slice, slice, slice]]:
    """Return bands of rows for a filter that reaches ``margin`` rows beyond a pixel.

    Each is the rows whose results are wanted, the rows that are read for them, and where the first lie in the second.
    What a filter makes up beyond the rows that are read does not reach those that are wanted, but at the picture's own
    edges.
    """
    height, width = shape[:2]
    rows = max(1, BAND_PIXELS // max(width, 1), 4 * margin)
    for start in range(0, height, rows):
        stop = min(start + rows, height)
        first, last = max(0, start - margin), min(height, stop + margin)
        yield slice(start, stop), slice(first, last), slice(start - first, stop - first)


def block_means(picture: Rows, side: int, channels: int | slice = slice(None)) -> Floats32:
    """Return the means over squares of ``side`` pixels, of one channel or several; incomplete squares are left out.

    Parameters
    ----------
    picture
        A picture in any unit, (height, width, 3): an array, or anything whose rows can be sliced.
    side
        The side of a square, in pixels, at least 1.
    channels
        The number of one channel, 0 to 2; all three without it.

    Returns
    -------
    numpy.ndarray
        The means in the picture's unit, float32, (height // side, width // side); of several channels
        (height // side, width // side, 3).

    Examples
    --------
    >>> picture = np.zeros((4, 5, 3), np.float32)
    >>> picture[:2, :2] = 8.0
    >>> block_means(picture, 2, 1).tolist()
    [[8.0, 0.0], [0.0, 0.0]]
    """
    import cv2

    height, width = picture.shape[:2]
    rows, columns = height // side, width // side
    means = np.empty((rows, columns) if isinstance(channels, int) else (rows, columns, 3), dtype=np.float32)
    group = max(1, BAND_PIXELS // (width * side))
    for first in range(0, rows, group):
        last = min(first + group, rows)
        part = np.ascontiguousarray(picture[first * side : last * side][:, : columns * side, channels], np.float32)
        # A mean over whole squares; NumPy's over two axes takes ten times as long.
        means[first:last] = cv2.resize(part, (columns, last - first), interpolation=cv2.INTER_AREA)
    return means


class RowFile:
    """A picture in XYZ in cd/m², float32 (height, width, 3), in a temporary file that is deleted with this object.

    Rows are read and written, not mapped: the memory of a mapped file would count as this program's.
    """

    def __init__(self, shape: tuple[int, int, int]) -> None:
        self._shape = shape
        self._file = tempfile.TemporaryFile(prefix="cyclopean-rows-", buffering=0)  # noqa: SIM115  # open as long as this
        weakref.finalize(self, self._file.close)
        self._row_bytes = shape[1] * shape[2] * 4
        # A place in the file is sought and read at once, whoever else reads.
        self._lock = threading.Lock()

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and 3."""
        return self._shape

    def __getitem__(self, rows: slice, /) -> Floats32:
        """Return those rows, (rows, width, 3)."""
        start, stop, step = rows.indices(self._shape[0])
        if step != 1:
            raise ValueError("rows are read one after another")
        part = np.empty((max(0, stop - start), *self._shape[1:]), dtype=np.float32)
        if not part.size:
            return part
        view = part.data.cast("B")
        with self._lock:
            self._file.seek(start * self._row_bytes)
            done = 0
            while done < len(view):
                read = self._file.readinto(view[done:])
                if not read:
                    raise OSError("a picture's rows were read before they were written")
                done += read
        return part

    def write(self, first: int, rows: NDArray[np.floating]) -> None:
        """Put ``rows`` (n, width, 3) where row ``first`` begins."""
        view = np.ascontiguousarray(rows, dtype=np.float32).data.cast("B")
        with self._lock:
            self._file.seek(first * self._row_bytes)
            done = 0
            while done < len(view):
                done += self._file.write(view[done:])

    @classmethod
    def of(cls, picture: NDArray[np.floating]) -> RowFile:
        """Return a copy of an array (height, width, 3)."""
        height, width, _ = picture.shape
        copy = cls((height, width, 3))
        for band in bands(copy.shape):
            copy.write(band.start, picture[band])
        return copy


class ScaledRows:
    """A picture times ``factor``, as its rows are read."""

    def __init__(self, picture: Rows, factor: float = 1.0) -> None:
        self._picture = picture
        self.factor = factor

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and 3."""
        return self._picture.shape

    def __getitem__(self, rows: slice, /) -> Floats32:
        """Return those rows, float32 (rows, width, 3)."""
        part = np.asarray(self._picture[rows], dtype=np.float32)
        return part if self.factor == 1.0 else part * np.float32(self.factor)
