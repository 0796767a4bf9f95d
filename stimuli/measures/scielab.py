"""A picture as the eye resolves it at a distance: S-CIELAB's filters on the opponent channels.

X. Zhang and B. A. Wandell 1997, "A spatial extension of CIELAB for digital color image reproduction". Each opponent
channel is blurred by a sum of Gaussians, k · exp(−r²/spread²), whose weights sum to one: what is finer than the eye
resolves averages out, in colour sooner than in lightness, and a uniform field stays as it is. Beyond its
edges the picture is continued by its mirror image.

The channels are those of G. M. Johnson and M. D. Fairchild 2003, "A top down description of S-CIELAB and CIEDE2000",
computed from XYZ scaled so that the white is that of D65: greys then have no colour, and a grey pattern gets none by
being blurred. With the channels of 1997 it would, because their luminance and colour are not apart.

A narrow Gaussian runs over the pixels; a wide one over cells of several pixels, and its outcome is interpolated back:
`NARROWEST_CELLS` is the least standard deviation in cells, which sets how exact that is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour import WHITE_POINTS_XYZ
from devices.colour_matching import DEFAULT_OBSERVER
from stimuli.errors import StimulusError
from stimuli.pictures.rows import Floats32, Rows, bands

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Rows: luminance, red-green and blue-yellow, of XYZ of the 2° observer under D65; the last two of a grey are 0.
OPPONENT_FROM_XYZ_D65 = np.array([[0.0556, 0.9981, -0.0254], [0.9510, -0.9038, 0.0], [0.0386, 1.0822, -1.0276]])
# Weight and spread in degrees of visual angle of each channel's Gaussians, as published; weights are then normalised.
GAUSSIANS: tuple[tuple[tuple[float, float], ...], ...] = (
    ((0.921, 0.0283), (0.105, 0.133), (-0.108, 4.336)),
    ((0.531, 0.0392), (0.330, 0.494)),
    ((0.488, 0.0536), (0.371, 0.386)),
)
# A Gaussian is blurred in cells of as many pixels as leave its standard deviation this many cells.
NARROWEST_CELLS = 8.0
# Gaussians end at this many standard deviations.
REACH_SD = 4.0
# A display at two kilometres; beyond it the wide Gaussians take seconds, then more memory than there is.
MOST_PIXELS_PER_DEGREE = 1e5


@dataclass(frozen=True, slots=True)
class _Blur:
    """One Gaussian of one channel: its weight, and its standard deviation in pixels."""

    channel: int
    weight: float
    sd_px: float

    @property
    def cell_px(self) -> int:
        return max(1, int(self.sd_px / NARROWEST_CELLS))


class SeenPicture:
    """A picture as the eye resolves it at a distance; its rows are read by slicing, like those of an array.

    Cells of the wide Gaussians are filled when it is made, in one pass over the picture.

    Parameters
    ----------
    picture
        XYZ in cd/m², (height, width, 3): an array, or anything whose rows can be sliced.
    pixels_per_degree
        The pixels in a degree of visual angle.
    white_XYZ
        The white that makes greys grey, (3,); its luminance does not matter.

    Raises
    ------
    StimulusError
        If the pixels per degree or the white's components are not finite numbers above 0, or the former beyond 100,000.

    Examples
    --------
    >>> checks = np.indices((32, 32)).sum(axis=0)[..., None] % 2 * np.full(3, 100.0)
    >>> seen = SeenPicture(checks, pixels_per_degree=500, white_XYZ=[95.047, 100.0, 108.883])
    >>> np.round(seen[16:17][0, 16]).tolist()             # fine black and white checks are seen as grey
    [50.0, 50.0, 50.0]
    """

    def __init__(self, picture: Rows, pixels_per_degree: float, white_XYZ: ArrayLike) -> None:
        white = np.asarray(white_XYZ, dtype=np.float64)
        if white.shape != (3,) or not (np.all(np.isfinite(white)) and np.all(white > 0)):
            raise StimulusError(f"a white needs three finite numbers above 0, not {white.tolist()}")
        if not (np.isfinite(pixels_per_degree) and pixels_per_degree > 0):
            raise StimulusError(f"pixels_per_degree is {pixels_per_degree}; it must be a finite number above 0")
        if pixels_per_degree > MOST_PIXELS_PER_DEGREE:
            raise StimulusError(
                f"the picture is seen at {pixels_per_degree:.4g} pixels per degree, more than "
                f"{MOST_PIXELS_PER_DEGREE:g}: check the viewing distance"
            )
        self._picture = picture
        self._opponent = opponent_from_xyz(white)
        blurs = [
            _Blur(channel, weight / sum(w for w, _ in gaussians), spread * pixels_per_degree / np.sqrt(2.0))
            for channel, gaussians in enumerate(GAUSSIANS)
            for weight, spread in gaussians
        ]
        self._narrow = [blur for blur in blurs if blur.cell_px == 1]
        self._wide = _wide_layers(picture, self._opponent, [blur for blur in blurs if blur.cell_px > 1])

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and 3."""
        return self._picture.shape

    def __getitem__(self, rows: slice, /) -> Floats32:
        """Return those rows in XYZ, float32, (rows, width, 3); beside bright places dark ones fall below 0."""
        import cv2

        height, width = self.shape[:2]
        start, stop, _ = rows.indices(height)
        reach = max((_reach_px(blur.sd_px) for blur in self._narrow), default=0)
        opponent = _turned(_mirrored_rows(self._picture, start - reach, stop + reach), self._opponent)
        seen = np.zeros((stop - start, width, 3), dtype=np.float32)
        for blur in self._narrow:
            kernel = gaussian_kernel(blur.sd_px)
            own = len(kernel) // 2
            part = np.ascontiguousarray(opponent[reach - own : len(opponent) - (reach - own), :, blur.channel])
            # Rows beyond the part are there: what the filter makes up at its ends is cut off.
            soft = cv2.sepFilter2D(part, cv2.CV_32F, kernel, kernel, borderType=cv2.BORDER_REFLECT)
            seen[..., blur.channel] += np.float32(blur.weight) * soft[own : len(part) - own]
        for layer in self._wide:
            seen[..., layer.blur.channel] += layer.rows(start, stop)
        return _turned(seen, np.asarray(np.linalg.inv(self._opponent), dtype=np.float64))


def remarks_on_observer(observer: str) -> list[str]:
    """Return what is to be said of pictures of a colorimetric observer: the channels are for CIE 1931 2°."""
    if observer == DEFAULT_OBSERVER:
        return []
    return [
        f"the eye's luminance and colour channels (S-CIELAB) are defined for {DEFAULT_OBSERVER}, and they take XYZ for "
        f"{observer} here: greys stay grey, and colours finer than the eye resolves are blurred approximately"
    ]


def gaussian_kernel(sd_px: float) -> NDArray[np.float64]:
    """Return how much of a Gaussian falls on each pixel, shape (2·reach + 1,), summing to 1."""
    from scipy.special import ndtr

    reach = _reach_px(sd_px)
    edges = np.arange(-reach, reach + 2) - 0.5
    kernel = np.diff(ndtr(edges / sd_px))
    return np.asarray(kernel / kernel.sum())


def _reach_px(sd_px: float) -> int:
    return int(np.ceil(REACH_SD * sd_px))


def opponent_from_xyz(white_XYZ: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from XYZ to the opponent channels, for a white (3,)."""
    return np.asarray(OPPONENT_FROM_XYZ_D65 * (np.array(WHITE_POINTS_XYZ["d65"]) * white_XYZ[1] / white_XYZ))


def _turned(values: NDArray[np.floating], matrix: NDArray[np.float64]) -> Floats32:
    return np.asarray(values, dtype=np.float32) @ matrix.T.astype(np.float32)


def _mirrored(index: NDArray[np.int64], length: int) -> NDArray[np.int64]:
    """Indices into 0..length − 1 for places on a picture that is continued as its own mirror image."""
    place = np.mod(index, 2 * length)
    return np.asarray(np.minimum(place, 2 * length - 1 - place))


def _mirrored_rows(picture: Rows, start: int, stop: int) -> NDArray[np.floating]:
    wanted = _mirrored(np.arange(start, stop), picture.shape[0])
    low, high = int(wanted.min()), int(wanted.max()) + 1
    rows = picture[low:high]
    return rows if np.array_equal(wanted, np.arange(low, high)) else rows[wanted - low]


@dataclass(frozen=True, eq=False, slots=True)
class _Layer:
    """A wide Gaussian's outcome in cells, times its weight, and how pixels are interpolated from them."""

    blur: _Blur
    cells: Floats32
    pixel_rows: csr_array
    pixel_columns: csr_array

    def rows(self, start: int, stop: int) -> Floats32:
        return np.asarray(self.pixel_columns @ (self.pixel_rows[start:stop] @ self.cells).T, dtype=np.float32).T


def _wide_layers(picture: Rows, matrix: NDArray[np.float64], blurs: list[_Blur]) -> list[_Layer]:
    from scipy.ndimage import convolve1d

    height, width = picture.shape[:2]
    means = [(_cell_means(height, blur), _cell_means(width, blur)) for blur in blurs]
    cells = [np.zeros((rows.shape[0], columns.shape[0])) for rows, columns in means]
    for band in bands(picture.shape) if blurs else ():
        opponent = _turned(picture[band], matrix)
        for (rows, columns), blur, sums in zip(means, blurs, cells, strict=True):
            sums += rows[:, band.start : band.stop] @ np.asarray(columns @ opponent[..., blur.channel].T).T
    layers = []
    for blur, sums in zip(blurs, cells, strict=True):
        # A cell has already blurred its pixels, by the variance of its width over that of a pixel's.
        variance = blur.sd_px**2 - (blur.cell_px**2 - 1) / 12.0
        kernel = _sampled_gaussian(float(np.sqrt(variance)) / blur.cell_px)
        for axis in (0, 1):
            sums = convolve1d(sums, kernel, axis=axis, mode="nearest")
        places = (_interpolation(height, blur), _interpolation(width, blur))
        layers.append(_Layer(blur, (blur.weight * sums).astype(np.float32), *places))
    return layers


def _sampled_gaussian(sd: float) -> NDArray[np.float64]:
    reach = int(np.ceil(REACH_SD * sd))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sd) ** 2)
    return np.asarray(kernel / kernel.sum())


def _margin_cells(blur: _Blur) -> int:
    """Cells beyond the picture's edge: as far as the Gaussian reaches, and two more for the interpolation."""
    return int(np.ceil(REACH_SD * blur.sd_px / blur.cell_px)) + 2


def _cell_count(pixels: int, blur: _Blur) -> int:
    return -(-pixels // blur.cell_px) + 2 * _margin_cells(blur)


def _cell_means(pixels: int, blur: _Blur) -> csr_array:
    """The mean over each cell, along one axis of the mirrored picture: (cells, pixels)."""
    from scipy.sparse import coo_array

    count, size = _cell_count(pixels, blur), blur.cell_px
    place = np.arange(count * size) - _margin_cells(blur) * size
    entries = (np.full(len(place), 1.0 / size), (np.repeat(np.arange(count), size), _mirrored(place, pixels)))
    return coo_array(entries, shape=(count, pixels)).tocsr()


def _interpolation(pixels: int, blur: _Blur) -> csr_array:
    """Pixels out of cells by Keys' cubic convolution, along one axis: (pixels, cells)."""
    from scipy.sparse import csr_array

    at = (np.arange(pixels) + 0.5) / blur.cell_px - 0.5 + _margin_cells(blur)
    first = np.floor(at).astype(np.int64)
    t = at - first
    weights = 0.5 * np.stack(
        [-(t**3) + 2 * t**2 - t, 3 * t**3 - 5 * t**2 + 2, -3 * t**3 + 4 * t**2 + t, t**3 - t**2], axis=-1
    )
    columns = first[:, None] + np.arange(-1, 3)
    rows = np.repeat(np.arange(pixels), 4)
    return csr_array((weights.ravel(), (rows, columns.ravel())), shape=(pixels, _cell_count(pixels, blur)))
