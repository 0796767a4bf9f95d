"""Pictures onto the display's pixel grid at true size, in linear light, with no weight below 0.

By default each new pixel holds the mean light over its own area. `axis_weights` has smoother filters too, B-splines
[Unser1999]: whatever the filter, an even plane stays even and each picture's light is kept, since at every place the
B-splines of a grid add up to one. Filters that keep more detail and alias less, such as Lanczos's, ring below 0 around
a sparkle: there is no such light.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from documents import in_threads
from documents.arrays import Floats
from stimuli.errors import StimulusError
from stimuli.pictures.stereo_image import StereoImage, XYZImage

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Filter = Literal["area", "linear", "cubic"]
MAX_PIXELS = 16384  # along one axis; no display has more
MAX_AREA_PX = 100_000_000  # more than `stimuli.pictures.exr_views` reads
# Of a display's pixel; a smaller picture is a mistake, and its weights fill the memory.
_LEAST_PIXELS = 0.01
_DEGREE = {"linear": 1, "cubic": 3}
# Rows of the new picture made at a time, so that a large picture is never in memory as float64.
_ROWS = 128


def display_pixels(length_mm: float, pixel_pitch_mm: float) -> int:
    """Return how many display pixels are nearest to a length: at least one, at most 16384.

    Raises
    ------
    StimulusError
        If the pitch or the length is not a finite number above 0, or there are more, or less than a hundredth of one.
    """
    for name, value in (("pixel_pitch_mm", pixel_pitch_mm), ("length_mm", length_mm)):
        if not (np.isfinite(value) and value > 0):
            raise StimulusError(f"{name} is {value}; it must be a finite number above 0")
    if length_mm / pixel_pitch_mm > MAX_PIXELS:
        raise StimulusError(f"{length_mm} mm at pixel_pitch_mm {pixel_pitch_mm} is more than {MAX_PIXELS} pixels")
    if length_mm / pixel_pitch_mm < _LEAST_PIXELS:
        raise StimulusError(f"{length_mm} mm at pixel_pitch_mm {pixel_pitch_mm} is less than {_LEAST_PIXELS} pixels")
    return max(1, round(length_mm / pixel_pitch_mm))


def area_weights(pixels: int, length_mm: float, pixel_pitch_mm: float) -> csr_array:
    """Return the sparse matrix (display pixels, pixels) of area weights along one axis.

    The ``pixels`` span ``length_mm``, centred on the display's whole pixels; their number is the nearest to the
    length. A weight is the share of the display pixel's width that a pixel covers: a display pixel that reaches
    beyond the picture receives light on the covered part only, and what the display pixels do not reach is cropped.
    """
    from scipy.sparse import csr_array

    count = display_pixels(length_mm, pixel_pitch_mm)
    edges = (np.arange(count + 1) - 0.5 * count) * pixel_pitch_mm
    source = (np.arange(pixels + 1) / pixels - 0.5) * length_mm
    size = length_mm / pixels
    first = np.clip(np.floor((edges[:-1] - source[0]) / size).astype(np.int64) - 1, 0, pixels - 1)
    span = int(np.ceil(pixel_pitch_mm / size)) + 3
    index = np.minimum(first[:, None] + np.arange(span), pixels - 1)
    fresh = np.diff(index, axis=1, prepend=-1) > 0
    overlap = np.minimum(source[index + 1], edges[1:, None]) - np.maximum(source[index], edges[:-1, None])
    share = np.where(fresh, np.maximum(overlap, 0.0), 0.0) / pixel_pitch_mm
    rows = np.repeat(np.arange(count), span)
    keep = share.ravel() > 0
    return csr_array((share.ravel()[keep], (rows[keep], index.ravel()[keep])), shape=(count, pixels))


def axis_weights(pixels: int, length_mm: float, pixel_pitch_mm: float, filter: Filter = "area") -> csr_array:
    """Return the sparse matrix (display pixels, pixels) of weights along one axis, on the grid of `area_weights`.

    ``area`` is that function. ``linear`` and ``cubic`` weigh by a B-spline of that degree, as wide as display pixels
    where there are fewer of them than the picture's pixels, else by one between the picture's pixels, averaged over
    each display pixel. A picture that has the display's own pixels is left as it is. At the picture's edges the splines
    are folded inwards, so that no light leaves.

    Raises
    ------
    StimulusError
        If there is no such filter, or as `display_pixels` does.
    """
    from scipy.sparse import csr_array

    if filter == "area":
        return area_weights(pixels, length_mm, pixel_pitch_mm)
    if filter not in _DEGREE:
        raise StimulusError.of(f"there is no filter '{filter}'", "expected area, linear or cubic")
    count = display_pixels(length_mm, pixel_pitch_mm)
    size = length_mm / pixels
    if count == pixels and abs(size - pixel_pitch_mm) <= 1e-9 * size:
        return area_weights(pixels, length_mm, size)
    display = (np.arange(count + 1) - 0.5 * count) * pixel_pitch_mm
    source = (np.arange(pixels + 1) / pixels - 0.5) * length_mm
    # Where the two grids do not end at one place, what lies beyond the other's end is cropped, or dark.
    if size <= pixel_pitch_mm:
        return csr_array(_splines(np.clip(source, display[0], display[-1]), count, pixel_pitch_mm, _DEGREE[filter]))
    inside = np.clip(display, source[0], source[-1])
    return csr_array(_splines(inside, pixels, size, _DEGREE[filter]).T * (size / pixel_pitch_mm))


def _splines(edges: Floats, count: int, size: float, degree: int) -> csr_array:
    """Return how much of ``count`` B-splines, ``size`` apart about 0, lies between edges: (count, intervals)."""
    from scipy.sparse import csr_array

    reach = 0.5 * (degree + 1)
    # Those beyond the ends are folded back on the ones that they mirror.
    number = np.arange(-degree, count + degree)
    places = edges / size + 0.5 * (count - 1)
    first = np.clip(np.searchsorted(places, number - reach, side="right") - 1, 0, len(edges) - 2)
    last = np.clip(np.searchsorted(places, number + reach, side="left"), 1, len(edges) - 1)
    index = first[:, None] + np.arange(int((last - first).max()))
    within = index < last[:, None]
    index = np.minimum(index, len(edges) - 2)
    share = _below(places[index + 1] - number[:, None], degree) - _below(places[index] - number[:, None], degree)
    folded = number % (2 * count)
    folded = np.where(folded < count, folded, 2 * count - 1 - folded)
    rows = np.broadcast_to(folded[:, None], index.shape)
    within &= share > 0
    return csr_array((share[within], (rows[within], index[within])), shape=(count, len(edges) - 1))


def _below(t: Floats, degree: int) -> Floats:
    """Return the integral of the B-spline of degree 1 or 3 about 0 up to ``t``."""
    reach = 0.5 * (degree + 1)
    r = np.minimum(np.abs(t), reach)
    if degree == 1:
        above = 0.5 * (1 - r) ** 2
    else:
        above = np.where(r < 1, 0.5 - r * (2 / 3 - r**2 * (1 / 3 - r / 8)), (2 - r) ** 4 / 24)
    return np.asarray(np.where(t < 0, above, 1 - above))


def resample(image: NDArray[np.floating], rows: csr_array, columns: csr_array) -> Floats:
    """Return ``image`` (rows, columns) on the display's grid, float64, by the weights of `axis_weights`."""
    small = np.empty((rows.shape[0], columns.shape[0]))

    def make(first: int) -> None:
        band = rows[first : first + _ROWS]
        if band.nnz == 0:
            small[first : first + _ROWS] = 0.0
            return
        top, bottom = int(band.indices.min()), int(band.indices.max()) + 1
        small[first : first + _ROWS] = (columns @ np.asarray(band[:, top:bottom] @ image[top:bottom]).T).T

    in_threads(make, range(0, len(small), _ROWS))
    return small


def resample_maps(
    maps: Sequence[NDArray[np.floating]], size_mm: tuple[float, float], pixel_pitch_mm: float, filter: Filter = "area"
) -> Floats:
    """Return maps of light on the pixels of a display, at true size, with the shares of light of `axis_weights`.

    Parameters
    ----------
    maps
        One or more of one shape (rows, columns), such as the channels of a picture.
    size_mm
        Their true width and height.
    pixel_pitch_mm
        The pixel pitch of the display.
    filter
        As `resample_picture` has it.

    Returns
    -------
    numpy.ndarray
        Float64, (rows, columns, maps), of ``size_mm / pixel_pitch_mm`` pixels, rounded.

    Raises
    ------
    StimulusError
        As `axis_weights` does.

    Examples
    --------
    >>> resample_maps([np.full((200, 300), 5.0)], size_mm=(30.0, 20.0), pixel_pitch_mm=0.25).shape
    (80, 120, 1)
    """
    rows_px, columns_px = maps[0].shape
    columns = axis_weights(columns_px, size_mm[0], pixel_pitch_mm, filter)
    rows = axis_weights(rows_px, size_mm[1], pixel_pitch_mm, filter)
    return np.stack([resample(each, rows, columns) for each in maps], axis=-1)


def resample_picture(
    image: StereoImage, size_mm: tuple[float, float], pixel_pitch_mm: float, filter: Filter = "area"
) -> StereoImage:
    """Return a picture on the pixels of a display, at true size and in linear light.

    Parameters
    ----------
    image
        The picture; a flat picture stays flat.
    size_mm
        Its true width and height.
    pixel_pitch_mm
        The pixel pitch of the display.
    filter
        ``area`` takes the mean over each display pixel; ``linear`` and ``cubic`` weigh by B-splines [Unser1999], with
        less aliasing and more blur.

    Returns
    -------
    StereoImage
        XYZ in cd/m², of ``size_mm / pixel_pitch_mm`` pixels, rounded.

    Raises
    ------
    StimulusError
        If a length is not a finite number above 0, there is no such filter, or the new picture would have more than
        `MAX_AREA_PX` pixels.

    Examples
    --------
    >>> picture = StereoImage.flat(np.full((200, 300, 3), 5.0, np.float32))
    >>> small = resample_picture(picture, size_mm=(30.0, 20.0), pixel_pitch_mm=0.25)
    >>> small.width_px, small.height_px
    (120, 80)
    """
    width_px, height_px = (display_pixels(length_mm, pixel_pitch_mm) for length_mm in size_mm)
    if width_px * height_px > MAX_AREA_PX:
        raise StimulusError.of(
            f"{size_mm[0]:g} × {size_mm[1]:g} mm are {width_px} × {height_px} pixels of the display, more than "
            f"{MAX_AREA_PX}",
            "make the picture smaller",
        )

    def shown(xyz_cd_m2: XYZImage) -> XYZImage:
        channels = [xyz_cd_m2[..., i] for i in range(3)]
        return resample_maps(channels, size_mm, pixel_pitch_mm, filter).astype(np.float32)

    left = shown(image.left)
    return StereoImage(left, left if image.is_flat else shown(image.right))
