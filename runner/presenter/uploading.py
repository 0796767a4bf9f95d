"""A view's XYZ to a texture of floats, in bands of rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import moderngl
import numpy as np

from runner.presenter.bands import InBands, bands
from runner.presenter.counters import Work
from stimuli.pictures.stereo_image import XYZImage

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
