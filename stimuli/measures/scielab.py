"""A picture as the eye resolves it at a distance: S-CIELAB's filters on the opponent channels.

X. Zhang and B. A. Wandell 1997, "A spatial extension of CIELAB for digital color image reproduction". Each opponent
channel is blurred by a sum of Gaussians, k · exp(−r²/spread²), whose weights sum to one: what is finer than the eye
resolves averages out, in colour sooner than in lightness, and a uniform field stays as it is. Beyond its
edges the picture is continued by its mirror image.

The channels are those of G. M. Johnson and M. D. Fairchild 2003, "A top down description of S-CIELAB and CIEDE2000",
computed from XYZ scaled so that the white is that of D65: greys then have no colour, and a grey pattern gets none by
being blurred. With the channels of 1997 it would, because their luminance and colour are not apart.

A narrow Gaussian runs over the pixels; a wide one over cells of several pixels, and its outcome is interpolated back by
a cubic spline: `NARROWEST_CELLS` is the least standard deviation in cells, which sets how exact that is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour import WHITE_POINTS_XYZ
from devices.colour_matching import DEFAULT_OBSERVER
from documents.arrays import Floats, Floats32
from stimuli.errors import StimulusError
from stimuli.measures.difference_map import difference_map
from stimuli.measures.measure import MapMeasure
from stimuli.measures.viewing import ViewingConditions
from stimuli.pictures.rows import Rows, over_bands

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

# Rows: luminance, red-green and blue-yellow, of XYZ of the 2° observer under D65; the last two of a grey are 0.
OPPONENT_FROM_XYZ_D65 = np.array([[0.0556, 0.9981, -0.0254], [0.9510, -0.9038, 0.0], [0.0386, 1.0822, -1.0276]])
# Weight and spread in degrees of visual angle of each channel's Gaussians, as published; weights are then normalised.
GAUSSIANS: tuple[tuple[tuple[float, float], ...], ...] = (
    ((0.921, 0.0283), (0.105, 0.133), (-0.108, 4.336)),
    ((0.531, 0.0392), (0.330, 0.494)),
    ((0.488, 0.0536), (0.371, 0.386)),
)
# A Gaussian is blurred in cells of as many pixels as leave its standard deviation this many cells.
NARROWEST_CELLS = 2.5
# Rows of pixels that come into cells by one product.
_DENSE_ROWS = 128
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
        planes = _planes(_mirrored_rows(self._picture, start - reach, stop + reach), self._opponent)
        seen = np.zeros((3, stop - start, width), dtype=np.float32)
        for blur in self._narrow:
            kernel = gaussian_kernel(blur.sd_px)
            own = len(kernel) // 2
            part = planes[blur.channel][reach - own : len(planes[blur.channel]) - (reach - own)]
            # Rows beyond the part are there: what the filter makes up at its ends is cut off.
            soft = cv2.sepFilter2D(part, cv2.CV_32F, kernel, blur.weight * kernel, borderType=cv2.BORDER_REFLECT)
            seen[blur.channel] += soft[own : len(part) - own]
        for layer in self._wide:
            seen[layer.blur.channel] += layer.rows(start, stop)
        together = np.asarray(cv2.merge(list(seen)), dtype=np.float32)
        return _turned(together, np.asarray(np.linalg.inv(self._opponent), dtype=np.float64))


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


def _turned(values: NDArray[Any], matrix: NDArray[np.float64]) -> Floats32:
    import cv2

    # An eighth of the time of a product with a matrix of three rows.
    turned: NDArray[Any] = np.asarray(cv2.transform(np.asarray(values, dtype=np.float32), matrix), dtype=np.float32)
    return turned.reshape(values.shape)


def _planes(picture: NDArray[Any], matrix: NDArray[np.float64]) -> list[Floats32]:
    """Return the opponent channels of rows of a picture, (rows, width) each."""
    turned = _turned(picture, matrix)
    return [np.ascontiguousarray(turned[..., channel]) for channel in range(3)]


def _mirrored(index: NDArray[np.int64], length: int) -> NDArray[np.int64]:
    """Indices into 0..length − 1 for places on a picture that is continued as its own mirror image."""
    place = np.mod(index, 2 * length)
    return np.asarray(np.minimum(place, 2 * length - 1 - place))


def _mirrored_rows(picture: Rows, start: int, stop: int) -> NDArray[Any]:
    wanted = _mirrored(np.arange(start, stop), picture.shape[0])
    low, high = int(wanted.min()), int(wanted.max()) + 1
    rows = picture[low:high]
    return rows if np.array_equal(wanted, np.arange(low, high)) else rows[wanted - low]


@dataclass(frozen=True, eq=False)
class _CellAxis:
    """One axis of a picture, cut into cells that go on beyond its ends, as far as a Gaussian reaches.

    Light comes into cells, and back out to pixels, by cubic B-splines: a box would take what is finer than a cell for
    something coarse.
    """

    pixels: int
    blur: _Blur

    @cached_property
    def margin(self) -> int:
        """Cells beyond either end: as far as the Gaussian reaches, and more for the splines."""
        return int(np.ceil(REACH_SD * self.blur.sd_px / self.blur.cell_px)) + 6

    @cached_property
    def cells(self) -> int:
        return -(-self.pixels // self.blur.cell_px) + 2 * self.margin

    @cached_property
    def taps(self) -> Floats:
        """The B-splines of a cell and of two on either side at each of its pixels, (5, cell_px)."""
        size = self.blur.cell_px
        away = np.abs((np.arange(size) + 0.5) / size - 0.5 - np.arange(-2, 3)[:, None])
        inner = (4.0 - 6.0 * away**2 + 3.0 * away**3) / 6.0
        return np.asarray(np.where(away < 1.0, inner, np.maximum(2.0 - away, 0.0) ** 3 / 6.0))

    @cached_property
    def variance_px2(self) -> float:
        """The variance that coming into cells adds, in pixels squared."""
        size = self.blur.cell_px
        away = np.arange(size) + 0.5 - size / 2 - size * np.arange(-2, 3)[:, None]
        return float(np.sum(self.taps * away**2) / size)

    @cached_property
    def into_cells(self) -> csr_array:
        """The means of the mirrored picture by B-splines, (cells, pixels); the outermost cells are incomplete."""
        from scipy.sparse import coo_array

        size = self.blur.cell_px
        place = _mirrored(np.arange(self.cells * size) - self.margin * size, self.pixels)
        cell = np.arange(self.cells).repeat(size)
        to = np.arange(-2, 3)[:, None] + cell
        weights = np.tile(self.taps / size, self.cells)
        kept = (to >= 0) & (to < self.cells)
        places = (to[kept], np.broadcast_to(place, to.shape)[kept])
        return coo_array((weights[kept], places), shape=(self.cells, self.pixels)).tocsr()

    @cached_property
    def from_rows(self) -> csc_array:
        """The same, to take the columns of some pixels from."""
        return self.into_cells.tocsc()

    def cells_along(self, plane: Floats32) -> Floats32:
        """Return the cells along each row of a plane (rows, pixels), (rows, cells)."""
        size, margin = self.blur.cell_px, self.margin
        whole = self.pixels // size
        parts = plane[:, : whole * size].reshape(-1, size) @ (self.taps.T / size).astype(np.float32)
        parts = parts.reshape(len(plane), whole, 5)
        cells = np.zeros((len(plane), self.cells), dtype=np.float32)
        for tap in range(5):
            cells[:, margin - 2 + tap : margin - 2 + tap + whole] += parts[:, :, tap]
        # Cells that reach beyond the whole ones.
        for beyond in (slice(margin + 2), slice(margin + whole - 2, None)):
            cells[:, beyond] = (self.into_cells[beyond] @ plane.T).T
        return cells

    def pixels_along(self, cells: Floats32) -> Floats32:
        """Return the pixels along each row of spline coefficients (rows, cells), (rows, pixels)."""
        count = -(-self.pixels // self.blur.cell_px)
        first = self.margin - 2
        windows = np.lib.stride_tricks.sliding_window_view(cells, 5, axis=1)[:, first : first + count]
        pixels = np.ascontiguousarray(windows).reshape(-1, 5) @ self.taps.astype(np.float32)
        return pixels.reshape(len(cells), -1)[:, : self.pixels]


@dataclass(frozen=True, eq=False, slots=True)
class _Layer:
    """A wide Gaussian's outcome times its weight, as spline coefficients of cells, and the cells of both axes."""

    blur: _Blur
    cells: Floats32
    down: _CellAxis
    across: _CellAxis

    def rows(self, start: int, stop: int) -> Floats32:
        """Return some rows of pixels: along the rows of cells that they lie among first, then down the columns."""
        size = self.blur.cell_px
        low, high = start // size, max(stop - 1, start) // size
        first = low + self.down.margin - 2
        along = self.across.pixels_along(self.cells[first : first + high - low + 5])
        taps, out = self.down.taps.T.astype(np.float32), np.empty((stop - start, along.shape[1]), dtype=np.float32)
        for cell in range(low, high + 1):
            top, bottom = max(start, cell * size), min(stop, (cell + 1) * size)
            weights = taps[top - cell * size : bottom - cell * size]
            np.matmul(weights, along[cell - low : cell - low + 5], out=out[top - start : bottom - start])
        return out


def _wide_layers(picture: Rows, matrix: NDArray[np.float64], blurs: list[_Blur]) -> list[_Layer]:
    from scipy.ndimage import convolve1d, spline_filter

    height, width = picture.shape[:2]
    axes = [(_CellAxis(height, blur), _CellAxis(width, blur)) for blur in blurs]
    cells = [np.zeros((down.cells, across.cells)) for down, across in axes]

    def gathered(band: slice) -> list[tuple[int, slice, Floats32]]:
        """Return what the rows of a band add to the cells of which Gaussian, and to which rows of cells."""
        planes = _planes(picture[band], matrix)
        parts = []
        for number, ((down, across), blur) in enumerate(zip(axes, blurs, strict=True)):
            for first in range(band.start, band.stop, _DENSE_ROWS):
                last = min(first + _DENSE_ROWS, band.stop)
                into = down.from_rows[:, first:last]
                rows = slice(int(into.indices.min()), int(into.indices.max()) + 1)
                # Down the columns first: a dense product of few rows is quick, and leaves few rows to go along.
                plane = planes[blur.channel][first - band.start : last - band.start]
                parts.append((number, rows, across.cells_along(into[rows].toarray().astype(np.float32) @ plane)))
        return parts

    for parts in over_bands(gathered, picture.shape) if blurs else ():
        for number, rows, part in parts:
            cells[number][rows] += part
    layers = []
    for blur, (down, across), sums in zip(blurs, axes, cells, strict=True):
        # Pixels are blurred by their own width and that of the cells already.
        variance = blur.sd_px**2 + 1.0 / 12.0 - across.variance_px2
        kernel = _sampled_gaussian(float(np.sqrt(variance)) / blur.cell_px)
        for axis in (0, 1):
            sums = convolve1d(sums, kernel, axis=axis, mode="nearest")
        coefficients = spline_filter(blur.weight * sums, 3, mode="mirror").astype(np.float32)
        layers.append(_Layer(blur, coefficients, down, across))
    return layers


def _sampled_gaussian(sd: float) -> NDArray[np.float64]:
    reach = int(np.ceil(REACH_SD * sd))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sd) ** 2)
    return np.asarray(kernel / kernel.sum())


class SCielab(MapMeasure):
    """The mean of CIEDE2000 over the pixels of both pictures as the eye resolves them."""

    name = "s-cielab"
    title = "S-CIELAB"
    unit = "ΔE"
    better = "lower"
    identical = 0.0
    source = "Johnson2003"
    map_title = "ΔE00 of what the eye resolves"
    map_highest = 10.0
    symmetric = True

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return ΔE00 of each pixel, float32 (height, width)."""
        white, density = viewing.cielab_white_XYZ, viewing.pixels_per_degree
        seen = [SeenPicture(picture, density, white) for picture in (reference_XYZ, test_XYZ)]
        return difference_map(seen[0], seen[1], white, filtered=True)
