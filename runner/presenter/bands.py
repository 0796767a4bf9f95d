"""Work on pictures in bands of rows, with a pause between two, so that a key never waits for a whole picture."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import TypeAlias, TypeVar

import moderngl
import numpy as np

from devices.compensation import Size
from runner.presenter.counters import Work
from stimuli.pictures import XYZImage

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


Upload: TypeAlias = Callable[[XYZImage], InBands[moderngl.Texture]]


def as_uploaded(view: XYZImage) -> XYZImage:
    """Return ``view`` as its texture holds it: float32 or, if it is so already, float16, its rows without gaps.

    It is the same array where that is so already. What is beyond single precision becomes infinite.
    """
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(view, dtype=np.float16 if view.dtype == np.float16 else np.float32)


def upload(
    context: moderngl.Context, work: Work, view: XYZImage, band_px: int | None = None
) -> InBands[moderngl.Texture]:
    """Return a new texture of ``view``, top row first.

    It is written in bands of about ``band_px`` pixels, all at once if None, and counts as one upload once it is
    whole.
    """
    data = as_uploaded(view)
    height, width, _ = data.shape
    dtype = "f2" if data.dtype == np.float16 else "f4"
    texture = context.texture((width, height), 3, alignment=1, dtype=dtype)
    try:
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        for first, rows in bands((width, height), band_px):
            if first:
                yield
            texture.write(data[first : first + rows], viewport=(0, first, width, rows), alignment=1)
    except BaseException:
        texture.release()
        raise
    work.add(uploads=1, bytes_uploaded=data.nbytes)
    return texture
