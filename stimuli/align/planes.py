"""The plane of light that pictures are compared on, and pictures that cannot be compared."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents.arrays import Floats32
from stimuli.errors import StimulusError

Region = tuple[int, int, int, int]

LEAST_SIDE_PX = 32
# Slower variation is light and shade, not texture; it differs between views that see a lamp's lobe elsewhere.
LOCAL_MEAN_PX = 33
# Variation below this share of the mean light is rounding: half floats err by 1.4e-4 of it, root mean square.
LEAST_CONTRAST = 2e-4


def light_plane(picture: NDArray[Any], luminance_weights: ArrayLike | None, name: str) -> Floats32:
    """Return the light of ``picture``, float32 (height, width).

    Parameters
    ----------
    picture
        (height, width) light as it is, or (height, width, 3): XYZ, whose Y is taken, or any linear RGB, whose channels
        are summed with ``luminance_weights`` (3,).
    name
        The name of the picture in a finding.

    Raises
    ------
    StimulusError
        If the shape is another, a side is shorter than 32 pixels, or a value is NaN or infinite.
    """
    image = np.asarray(picture)
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise StimulusError.of(
            f"the {name} picture has shape {image.shape}", "give (height, width) or (height, width, 3)"
        )
    height, width = image.shape[:2]
    if min(height, width) < LEAST_SIDE_PX:
        raise StimulusError.of(
            f"the {name} picture is {width} × {height} pixels",
            f"a picture to align has at least {LEAST_SIDE_PX} pixels on each side",
        )
    bad = sum(int(np.count_nonzero(~np.isfinite(rows).all(axis=-1))) for rows in _bands(image))
    if bad:
        raise StimulusError.of(
            f"{bad} of {width * height} pixels of the {name} picture are NaN or infinite",
            "repair or crop them before aligning",
        )
    if image.ndim == 2:
        return image.astype(np.float32)
    if luminance_weights is None:
        return image[:, :, 1].astype(np.float32)
    weights = np.asarray(luminance_weights, dtype=np.float64)
    if weights.shape != (3,) or not np.isfinite(weights).all() or not weights.any():
        raise StimulusError.of(f"luminance_weights is {luminance_weights}", "give three finite numbers, not all 0")
    return np.asarray(image @ weights.astype(np.float32), dtype=np.float32)


def same_size(first: NDArray[Any], second: NDArray[Any], names: tuple[str, str]) -> None:
    """Raise StimulusError unless both pictures have the same height and width."""
    if first.shape[:2] != second.shape[:2]:
        sizes = [
            f"{picture.shape[1]} × {picture.shape[0]}" if picture.ndim >= 2 else str(picture.shape)
            for picture in (first, second)
        ]
        raise StimulusError.of(
            f"the {names[0]} picture is {sizes[0]} pixels and the {names[1]} one {sizes[1]}",
            "both views come from one camera at one size",
        )


def texture(light: Floats32) -> Floats32:
    """Return ``light`` (height, width) minus its local mean over squares of 33 pixels."""
    from scipy.ndimage import uniform_filter

    return np.asarray(light - uniform_filter(light, min(LOCAL_MEAN_PX, *light.shape), mode="nearest"))


def binned(plane: Floats32, bin_px: int) -> Floats32:
    """Return the means of squares of ``bin_px`` pixels of ``plane`` (height, width); what is over is left out."""
    if bin_px == 1:
        return plane
    height, width = (length // bin_px for length in plane.shape)
    kept = plane[: height * bin_px, : width * bin_px]
    return np.asarray(kept.reshape(height, bin_px, width, bin_px).mean(axis=(1, 3)), dtype=np.float32)


def is_flat(fine: Floats32, light: Floats32) -> bool:
    """Return whether ``fine``, the texture of ``light`` or itself, varies by no more than rounding."""
    return float(np.std(fine)) <= LEAST_CONTRAST * float(np.abs(light).mean())


def checked_region(region: Region | None, shape: tuple[int, ...]) -> Region:
    """Return ``region`` (first column, first row, column and row after the last), or the whole picture for None."""
    height, width = shape[:2]
    if region is None:
        return 0, 0, width, height
    left, top, right, bottom = region
    if not (0 <= left < right <= width and 0 <= top < bottom <= height):
        raise StimulusError.of(
            f"the region {tuple(region)} does not lie in a picture of {width} × {height} pixels",
            "give first column, first row, and the column and row after the last",
        )
    if min(right - left, bottom - top) < LEAST_SIDE_PX:
        raise StimulusError.of(
            f"the region {tuple(region)} is too small", f"give at least {LEAST_SIDE_PX} pixels on each side"
        )
    return int(left), int(top), int(right), int(bottom)


def _bands(image: NDArray[Any]) -> list[NDArray[Any]]:
    flat = image.reshape(image.shape[0], image.shape[1], -1)
    return [flat[start : start + 256] for start in range(0, len(flat), 256)]
