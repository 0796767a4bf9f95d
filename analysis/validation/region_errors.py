"""How sure a region's differences are: the covariances of two means carried through to what is reckoned from them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Of the colour, as the step of the slopes: far above rounding, far below where a slope changes.
_STEP = 1e-4
# The length of a difference that lies within its own error has a skew distribution, and no standard error of use.
LEAST_Z = 2.0


def standard_errors(
    reckon: Callable[[Floats], Floats],
    photo_XYZ: Floats,
    rendering_XYZ: Floats,
    photo_covariance: Floats | None,
    rendering_covariance: Floats | None,
) -> Floats | None:
    """Return the standard errors (m,) of ``reckon`` (6,) -> (m,), of both XYZ in one; to first order.

    The two are taken as independent: where both pictures show one texture at the same places, this is too much rather
    than too little. None without covariances.
    """
    if photo_covariance is None or rendering_covariance is None:
        return None
    covariance = np.zeros((6, 6))
    covariance[:3, :3], covariance[3:, 3:] = photo_covariance, rendering_covariance
    at = np.concatenate([photo_XYZ, rendering_XYZ])
    size = np.repeat([np.abs(photo_XYZ).max(), np.abs(rendering_XYZ).max()], 3)
    slopes = []
    for place in range(6):
        step = np.zeros(6)
        step[place] = _STEP * size[place]
        slopes.append((reckon(at + step) - reckon(at - step)) / (2 * step[place]))
    slope = np.array(slopes)
    return np.asarray(np.sqrt(np.maximum(np.einsum("im,ij,jm->m", slope, covariance, slope), 0.0)))


def of_length(length: float, se: float | None) -> float | None:
    """Return the standard error of a length such as ΔE00, None where the length is below two of them."""
    return se if se is not None and np.isfinite(se) and length >= LEAST_Z * se else None
