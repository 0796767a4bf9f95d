"""One factor for all XYZ of a picture: its luminance changes, its chromaticities and the ratio of its eyes do not.

Thesis Section 4.5.1.1: pictures are brought to one luminance, preserving the colorimetric ratios.
In the grayscale series each pixel keeps its luminance and gets one chromaticity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from devices.colour import XYZ_from_xyY
from stimuli.errors import StimulusError
from stimuli.pictures.stereo_image import StereoImage, XYZImage

# (first row, first column, rows, columns) of a part of a picture.
Box = tuple[int, int, int, int]


def eyes_once(image: StereoImage) -> tuple[XYZImage, ...]:
    """Return the picture's arrays, that of a flat picture once."""
    return (image.left,) if image.is_flat else (image.left, image.right)


def mean_luminance_cd_m2(image: StereoImage) -> float:
    """Return the mean Y over all pixels and both eyes.

    Parameters
    ----------
    image
        The picture, XYZ in cd/m².

    Returns
    -------
    float
        The mean in cd/m².

    Examples
    --------
    >>> mean_luminance_cd_m2(StereoImage.flat(np.full((4, 6, 3), 5.0, np.float32)))
    5.0
    """
    return float(np.mean([eye[..., 1].mean(dtype=np.float64) for eye in eyes_once(image)]))


def max_luminance_cd_m2(image: StereoImage) -> float:
    """Return the largest Y of either eye."""
    return float(max(eye[..., 1].max() for eye in eyes_once(image)))


def white_luminance_cd_m2(image: StereoImage, box: Box) -> float:
    """Return the median Y over both eyes of a white that was photographed along, in ``box``.

    Parameters
    ----------
    image
        The picture, XYZ in cd/m².
    box
        First row, first column, rows and columns of the white, in pixels, counted from 0.

    Returns
    -------
    float
        The median in cd/m².

    Raises
    ------
    StimulusError
        If the box does not lie in the picture.

    Examples
    --------
    >>> light = np.full((4, 6, 3), 5.0, np.float32)
    >>> light[:2, :2] = 80.0
    >>> white_luminance_cd_m2(StereoImage.flat(light), (0, 0, 2, 2))
    80.0
    """
    top, left, rows, columns = box
    if min(top, left) < 0 or min(rows, columns) < 1 or top + rows > image.height_px or left + columns > image.width_px:
        message = f"the white's box {list(box)} does not lie in the picture of {image.height_px} × {image.width_px} px"
        raise StimulusError.of(message, "give first row, first column, rows and columns inside it")
    parts = [eye[top : top + rows, left : left + columns, 1] for eye in eyes_once(image)]
    return float(np.median(np.stack(parts).astype(np.float64)))


def factor_to(luminance_cd_m2: float, target_cd_m2: float) -> float:
    """Return what ``luminance_cd_m2`` must be multiplied by to become ``target_cd_m2``.

    With the mean, the maximum or a white of a picture as the luminance, this is the factor to a target mean, to a
    reference's maximum (Expression 4.11) or to a target white.

    Parameters
    ----------
    luminance_cd_m2
        The luminance of the picture, in cd/m², above 0.
    target_cd_m2
        The luminance that it is to have, in cd/m², above 0.

    Returns
    -------
    float
        The factor, above 0.

    Raises
    ------
    StimulusError
        If the luminance is not above 0, so that nothing can bring it to the target, or the target is not.

    Examples
    --------
    >>> factor_to(20.0, 50.0)
    2.5
    """
    if not (math.isfinite(target_cd_m2) and target_cd_m2 > 0):
        raise StimulusError(f"the target luminance is {target_cd_m2} cd/m²; it must be a finite number above 0")
    factor = target_cd_m2 / luminance_cd_m2 if luminance_cd_m2 > 0 else math.nan
    if not (math.isfinite(factor) and factor > 0):
        message = f"the picture has {luminance_cd_m2:g} cd/m², which no factor brings to {target_cd_m2:g} cd/m²"
        raise StimulusError.of(message, "give a picture that holds light")
    return factor


def scaled(xyz_cd_m2: XYZImage, factor: float) -> XYZImage:
    """Return XYZ, any shape, times ``factor``, float32, in one multiplication: within 2e-7 of each value.

    Raises
    ------
    StimulusError
        If the factor is not a finite number above 0, or a product is no longer a number.
    """
    if not (math.isfinite(factor) and factor > 0):
        raise StimulusError(f"the luminance factor is {factor}; it must be a finite number above 0")
    with np.errstate(over="ignore", invalid="ignore"):
        product = xyz_cd_m2 * np.float32(factor)
    if not math.isfinite(product.max(initial=0.0)):
        raise StimulusError(f"the luminance factor {factor:g} makes light that no number holds")
    return product


def scaled_picture(image: StereoImage, factor: float) -> StereoImage:
    """Return the picture with both eyes times one ``factor``; a flat picture stays flat. Raises as `scaled` does.

    Parameters
    ----------
    image
        The picture, XYZ in cd/m².
    factor
        What XYZ is multiplied by, finite and above 0.

    Returns
    -------
    StereoImage
        The picture, XYZ in cd/m², float32, of the same shape.

    Examples
    --------
    >>> picture = StereoImage.flat(np.full((4, 6, 3), 5.0, np.float32))
    >>> brighter = scaled_picture(picture, 2.0)
    >>> brighter.left[0, 0].tolist(), brighter.is_flat
    ([10.0, 10.0, 10.0], True)
    """
    shown = [scaled(eye, factor) for eye in eyes_once(image)]
    return StereoImage(shown[0], shown[-1])


def factor_series(step_percent: float, count: int, first: float = 1.0) -> Sequence[float]:
    """Return ``count`` factors from ``first`` on, each ``step_percent`` above the one before.

    The thesis's brighter series (Section 4.5.1.1) is the second of 33 %: 1, 1.33.

    Raises
    ------
    StimulusError
        If there is no factor to give, or they would not be finite and above 0.
    """
    ratio = 1.0 + step_percent / 100.0
    factors = tuple(first * ratio**place for place in range(count)) if count > 0 and ratio > 0 else ()
    if not factors or not all(math.isfinite(factor) and factor > 0 for factor in factors):
        raise StimulusError(f"there is no series of {count} factors from {first} on in steps of {step_percent} %")
    return factors


def greyscale(xyz_cd_m2: XYZImage, white_xy: ArrayLike) -> XYZImage:
    """Return XYZ (..., 3), float32, with the Y of ``xyz_cd_m2``, bit for bit, and the chromaticity ``white_xy`` (x, y).

    Thesis Section 4.5.1.1: the grayscale series.

    Raises
    ------
    StimulusError
        If no light has that chromaticity.
    """
    xy = np.asarray(white_xy, dtype=np.float64)
    if xy.shape != (2,) or not np.all(np.isfinite(xy)) or xy[0] < 0 or xy[1] <= 0 or xy.sum() > 1:
        raise StimulusError(f"no light has the chromaticity {xy.tolist()}; x, y and 1 - x - y are shares, y above 0")
    white = XYZ_from_xyY([*xy, 1.0]).astype(np.float32)
    return np.asarray(xyz_cd_m2[..., 1:2] * white)


def grey_picture(image: StereoImage, white_xy: ArrayLike) -> StereoImage:
    """Return the picture without colour; a flat picture stays flat. Raises as `greyscale` does."""
    left = greyscale(image.left, white_xy)
    return StereoImage(left, left if image.is_flat else greyscale(image.right, white_xy))
