"""Only what the aperture lets through is made ready: the rest of a larger picture is neither shaded nor uploaded."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from runner.presenter.modes.mode import EyeArea
from stimuli.stereo_image import StereoImage, XYZImage

Load = Callable[[str], StereoImage]


def through_aperture(load: Load, aperture_px: tuple[int, int], area: EyeArea) -> Load:
    """Return ``load`` with its pictures cropped to ``aperture_px`` (width, height), standing where they stood.

    A picture in the middle of an eye's view begins at (view - size) // 2, so that the crop depends on the view's size
    by a pixel. A squeezed view shares pixels between columns or rows, and there nothing is cropped.
    """
    if area.squeeze != (1, 1):
        return load

    def cropped(name: str) -> StereoImage:
        image = load(name)
        width, height = (min(most, size) for most, size in zip(aperture_px, _size(image), strict=True))
        if (width, height) == _size(image):
            return image
        left, top = (
            (view - kept) // 2 - (view - size) // 2
            for view, kept, size in zip(area.view_px, (width, height), _size(image), strict=True)
        )

        def crop(view: XYZImage) -> XYZImage:
            return np.ascontiguousarray(view[top : top + height, left : left + width])

        flat = crop(image.left)
        return StereoImage.flat(flat) if image.is_flat else StereoImage(flat, crop(image.right))

    return cropped


def _size(image: StereoImage) -> tuple[int, int]:
    return image.width_px, image.height_px
