"""Work on pictures in bands of rows, with a pause between two, so that a key never waits for a whole picture."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import TypeAlias, TypeVar

from runner.presenter.rectangle import Size

T = TypeVar("T")
# Work that pauses after each band but the last, and ends in a T. What it holds is freed if it is closed before.
InBands: TypeAlias = Generator[None, None, T]

# About 2 ms of the colour pass on a software driver with two cores, and next to nothing on a graphics card.
BAND_PX = 1 << 16


def bands(size_px: Size, band_px: int | None) -> Iterator[tuple[int, int]]:
    """Return the first row and the number of rows of each band of a picture of ``size_px``, in order.

    A band has as many rows as ``band_px`` pixels fill, but at least one; with None the picture is one band.
    """
    width, height = size_px
    rows = height if band_px is None else max(1, band_px // width)
    for first in range(0, height, rows):
        yield first, min(rows, height - first)


def to_the_end(work: InBands[T]) -> T:
    """Do what is left of ``work`` without a pause and return its result."""
    while True:
        try:
            next(work)
        except StopIteration as done:
            result: T = done.value
            return result
