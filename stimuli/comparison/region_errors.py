"""How sure regions' differences are: the covariances of two means carried through to what is reckoned from them."""

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
    photo_covariance: Floats,
    rendering_covariance: Floats,
) -> Floats:
    """Return the standard errors (n, m) of ``reckon`` (..., 6) -> (..., m), of both XYZ in one; to first order.

    XYZ are (n, 3), covariances (n, 3, 3), NaN where they are not known. The two are taken as independent: where both
    pictures show one texture at the same places, this is too much rather than too little.
    """
    at = np.concatenate([photo_XYZ, rendering_XYZ], axis=1)
    size = [np.abs(one).max(axis=1, keepdims=True).repeat(3, axis=1) for one in (photo_XYZ, rendering_XYZ)]
    step = _STEP * np.concatenate(size, axis=1)
    steps = step[:, :, None] * np.eye(6)
    # (n, 6, m): how each number changes with each of the six.
    slope = (reckon(at[:, None] + steps) - reckon(at[:, None] - steps)) / (2 * step[:, :, None])
    variance = np.einsum("nim,nij,njm->nm", slope[:, :3], photo_covariance, slope[:, :3])
    variance += np.einsum("nim,nij,njm->nm", slope[:, 3:], rendering_covariance, slope[:, 3:])
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def of_length(length: float, se: float | None) -> float | None:
    """Return the standard error of a length such as ΔE00, None where the length is below two of them."""
    return se if se is not None and length >= LEAST_Z * se else None
