"""Only what the aperture lets through is made ready: the rest of a larger picture is not read, uploaded or shaded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from runner.presenter.modes.mode import EyeArea
from stimuli.pictures.exr_views import Part, Region
from stimuli.pictures.stereo_image import StereoImage


class LoadPart(Protocol):
    """Where pictures come from, by name: whole, or the part that is chosen by their size."""

    def __call__(self, name: str, part: Part | None = None, /) -> StereoImage:
        """Return the picture ``name``, or ``part`` of it."""


def through_aperture(load: LoadPart, aperture_px: tuple[int, int], area: EyeArea) -> Callable[[str], StereoImage]:
    """Return ``load`` with its pictures cropped to ``aperture_px`` (width, height), standing where they stood.

    A picture in the middle of an eye's view begins at (view - size) // 2, so that the crop depends on the view's size
    by a pixel. A squeezed view shares pixels between columns or rows, and there nothing is cropped.
    """
    if area.squeeze != (1, 1):
        return load

    def shown(size_px: tuple[int, int]) -> Region:
        width, height = (min(most, size) for most, size in zip(aperture_px, size_px, strict=True))
        left, top = (
            (view - kept) // 2 - (view - size) // 2
            for view, kept, size in zip(area.view_px, (width, height), size_px, strict=True)
        )
        return Region(left, top, width, height)

    return lambda name: load(name, shown)
