"""S-CIELAB by the definition of its authors' code of 1996, version 1.1.1 of 1998 [Zhang1996].

The channels are those of Poirson and Wandell; each is filtered by a sum of Gaussians that is given by half widths at
half maximum, cut off at one degree of visual angle, and sampled 224 times per degree or more: at fewer, the kernel is
interpolated linearly and sampled down. The picture is continued by its mirror image for half a kernel. The difference
is ΔE*ab of 1976.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.colour import xyz_to_lab
from documents.arrays import Floats, Floats32
from stimuli.errors import StimulusError
from stimuli.measures import EyeMeasured, MapMeasure, ViewingConditions
from stimuli.pictures import Rows, bands_with_margin

# Rows: black-white, red-green and blue-yellow, of XYZ of the 2° observer.
OPPONENT_FROM_XYZ = np.array(
    [[0.2787336, 0.7218031, -0.1065520], [-0.4487736, 0.2898056, 0.0771569], [0.0859513, -0.5899859, 0.5011089]]
)
# Half width at half maximum in degrees, and weight, of each channel's Gaussians, as in the code.
GAUSSIANS: tuple[tuple[tuple[float, float], ...], ...] = (
    ((0.05, 1.00327), (0.225, 0.114416), (7.0, -0.117686)),
    ((0.0685, 0.616725), (0.826, 0.383275)),
    ((0.0920, 0.567885), (0.6451, 0.432115)),
)
LEAST_SAMPLES_PER_DEGREE = 224.0
# The filters run over pixels; beyond this a picture of a million takes minutes.
LEAST_PIXELS_PER_DEGREE, MOST_PIXELS_PER_DEGREE = 0.01, 2000.0
_SEEN_DELTA_E = 20.0


def kernels_1996(pixels_per_degree: float, support_deg: float = 1.0) -> tuple[Floats, ...]:
    """Return the kernels of each channel: one row for each Gaussian, (Gaussians, pixels).

    The filter of a channel is the sum over its rows k of abs(k) down the columns times k along the rows.

    Parameters
    ----------
    pixels_per_degree
        The pixels in a degree of visual angle, 0.01 to 2000.
    support_deg
        How wide the kernels are, in degrees of visual angle: 1 in the code.

    Returns
    -------
    tuple of ndarray
        Of black-white, red-green and blue-yellow, each with an odd number of columns.

    Raises
    ------
    StimulusError
        If the pixels per degree are not 0.01 to 2000, or the support is not 0.1 to 60 degrees.

    Examples
    --------
    >>> [kernel.shape for kernel in kernels_1996(45.0)]
    [(3, 45), (2, 45), (2, 45)]
    """
    if not LEAST_PIXELS_PER_DEGREE <= pixels_per_degree <= MOST_PIXELS_PER_DEGREE:
        raise StimulusError.of(
            f"the pictures are seen at {pixels_per_degree:.4g} pixels per degree, and the filters of 1996 are computed "
            f"for {LEAST_PIXELS_PER_DEGREE:g} to {MOST_PIXELS_PER_DEGREE:g}",
            "check the viewing distance, or leave out 's-cielab-1996'",
        )
    if not 0.1 <= support_deg <= 60.0:
        raise StimulusError(f"filters are {support_deg:g}° wide; they can be 0.1° to 60° wide")
    finer = max(1, int(np.ceil(LEAST_SAMPLES_PER_DEGREE / pixels_per_degree)))
    density = pixels_per_degree * finer
    half = (int(np.ceil(density * support_deg / 2)) * 2 - 1) // 2
    at = np.arange(-half, half + 1)
    triangle = 1.0 - np.abs(np.arange(1 - finer, finer)) / finer
    kept = np.arange(-(half // finer), half // finer + 1) * finer
    kernels = []
    for gaussians in GAUSSIANS:
        rows = []
        for half_width_deg, weight in gaussians:
            gaussian = 0.5 ** ((at / (half_width_deg * density)) ** 2)
            gaussian *= np.sign(weight) * np.sqrt(abs(weight)) / gaussian.sum()
            spread = np.convolve(gaussian, triangle)
            rows.append(spread[kept + half + finer - 1])
        kernels.append(np.array(rows))
    return tuple(kernels)


def seen_1996(picture: NDArray[np.floating], pixels_per_degree: float, support_deg: float = 1.0) -> NDArray[np.float64]:
    """Return a picture as the filters of 1996 leave it.

    Parameters
    ----------
    picture
        XYZ, (height, width, 3), in any unit.
    pixels_per_degree, support_deg
        As of `kernels_1996`.

    Returns
    -------
    ndarray
        XYZ in the unit of the picture, (height, width, 3); the code leaves what falls below 0, and so does this.

    Raises
    ------
    StimulusError
        As of `kernels_1996`.

    Examples
    --------
    >>> checks = np.indices((64, 64)).sum(axis=0)[..., None] % 2 * np.array([95.0, 100.0, 109.0])
    >>> np.round(seen_1996(checks, 100.0)[32, 32]).tolist()
    [48.0, 50.0, 55.0]
    """
    opponent = np.asarray(picture, dtype=np.float64) @ OPPONENT_FROM_XYZ.T
    seen = np.empty_like(opponent)
    for channel, kernels in enumerate(kernels_1996(pixels_per_degree, support_deg)):
        seen[..., channel] = _filtered(opponent[..., channel], kernels)
    return np.asarray(seen @ np.linalg.inv(OPPONENT_FROM_XYZ).T)


class SCielab1996(MapMeasure):
    """The mean of ΔE*ab of 1976 over the pixels of both pictures as the filters of 1996 leave them.

    ``support_deg`` is how wide the filters are: 1° in the code, which cuts off the widest Gaussian.
    """

    name = "s-cielab-1996"
    title = "S-CIELAB (1996)"
    unit = "ΔE"
    better = "lower"
    identical = 0.0
    source = "Zhang1996"
    map_title = "ΔE*ab of what the filters of 1996 leave"
    map_highest = 20.0
    symmetric = True

    def __init__(self, support_deg: float = 1.0) -> None:
        self.support_deg = support_deg

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return ΔE*ab of each pixel, float32 (height, width). Raises StimulusError."""
        white, density = viewing.cielab_white_XYZ, viewing.pixels_per_degree
        height, width = reference_XYZ.shape[:2]
        columns = kernels_1996(density, self.support_deg)[0].shape[1]
        # A kernel longer than the picture takes all of it at once.
        margin = columns if columns < height else height
        errors = np.empty((height, width), dtype=np.float32)
        for wanted, read, inner in bands_with_margin(errors.shape, margin):
            pictures = (seen_1996(picture[read], density, self.support_deg) for picture in (reference_XYZ, test_XYZ))
            first, second = (xyz_to_lab(seen[inner], white) for seen in pictures)
            errors[wanted] = np.sqrt(np.sum((first - second) ** 2, axis=-1))
        return errors

    def measure(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> EyeMeasured:
        """Return the mean and the map, and how many pixels lie above ΔE 20, the figure that the code's example has."""
        errors = self.error_map(reference_XYZ, test_XYZ, viewing)
        above = int(np.count_nonzero(errors > _SEEN_DELTA_E))
        said = f"{above} of {errors.size} pixels differ by more than ΔE*ab {_SEEN_DELTA_E:g}"
        return EyeMeasured(self.pooled(errors.ravel()), errors, (said,))


def _filtered(plane: Floats, kernels: Floats) -> Floats:
    """Return a plane filtered; it is mirrored for half a kernel, or for half its own length where that is shorter."""
    from scipy.signal import fftconvolve

    size = kernels.shape[1]
    across = [size // 2 if size < length else length // 2 for length in plane.shape]
    padded = np.pad(plane, [(each, each) for each in across], mode="symmetric")
    done = fftconvolve(padded, np.abs(kernels).T @ kernels, mode="full")
    first = [each + size // 2 for each in across]
    return np.asarray(done[first[0] : first[0] + plane.shape[0], first[1] : first[1] + plane.shape[1]])
