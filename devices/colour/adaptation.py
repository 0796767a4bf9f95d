"""Chromatic adaptation: XYZ under one white as they look under another, each response scaled on its own (von Kries).

    XYZ' = M⁻¹ · diag(D · R'w/Rw + 1 − D) · M · XYZ,   Rw = M · white

M turns XYZ into the responses that adapt. ``von-kries`` takes the cones of Hunt, Pointer and Estévez, as the thesis
does (Expressions 2.9 and 2.10); ``bradford`` [Lam1985] and ``cat16`` [Li2017] take sharper ones. D is the degree of
adaptation: 1 is complete, 0 leaves the light as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError

AdaptationMethod = Literal["cat16", "von-kries", "bradford"]

_RESPONSES: Mapping[str, NDArray[np.float64]] = MappingProxyType(
    {
        "cat16": np.array(
            [[0.401288, 0.650173, -0.051461], [-0.250268, 1.204414, 0.045854], [-0.002079, 0.048952, 0.953127]]
        ),
        "von-kries": np.array([[0.40024, 0.70760, -0.08081], [-0.22630, 1.16532, 0.04570], [0.0, 0.0, 0.91822]]),
        "bradford": np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]),
    }
)


def adaptation_matrix(
    from_white_XYZ: ArrayLike, to_white_XYZ: ArrayLike, method: AdaptationMethod = "cat16", degree: float = 1.0
) -> NDArray[np.float64]:
    """Return the matrix of a chromatic adaptation between two whites.

    Parameters
    ----------
    from_white_XYZ, to_white_XYZ
        XYZ of the two whites, shape (3,), in any unit. Where they differ in luminance, light is scaled with it: give
        both the same Y, and a white keeps its luminance.
    method
        ``cat16`` [Li2017], ``von-kries`` (thesis, Expression 2.10) or ``bradford`` [Lam1985].
    degree
        How complete the adaptation is, 0 to 1.

    Returns
    -------
    ndarray
        The matrix A, shape (3, 3): ``XYZ @ A.T`` looks under the second white as XYZ does under the first.

    Raises
    ------
    DeviceError
        If there is no such method, the degree is not 0 to 1, or a white is not three finite numbers with Y above 0 to
        which all three responses are above 0.

    Examples
    --------
    >>> d50, d65 = [96.42, 100.0, 82.52], [95.05, 100.0, 108.88]
    >>> (adaptation_matrix(d50, d65, "cat16") @ d50).round(6).tolist()
    [95.05, 100.0, 108.88]
    """
    if method not in _RESPONSES:
        raise DeviceError(f"there is no adaptation '{method}'; expected one of: {', '.join(_RESPONSES)}")
    if not 0.0 <= degree <= 1.0:
        raise DeviceError(f"the degree of adaptation is {degree}; it must be 0 to 1")
    responses = _RESPONSES[method]
    before, after = (_responses_to(white, responses) for white in (from_white_XYZ, to_white_XYZ))
    gains = degree * after / before + (1.0 - degree)
    return np.asarray(np.linalg.inv(responses) @ np.diag(gains) @ responses)


def bradford_matrix(from_white_XYZ: ArrayLike, to_white_XYZ: ArrayLike) -> NDArray[np.float64]:
    """Return the chromatic adaptation matrix of Bradford's transform: `adaptation_matrix` with ``bradford``.

    Parameters
    ----------
    from_white_XYZ, to_white_XYZ
        XYZ of the two whites, shape (3,), in any unit.

    Returns
    -------
    ndarray
        The matrix A, shape (3, 3): ``XYZ @ A.T`` looks under the second white as XYZ does under the first. Source:
        [Lam1985].

    Examples
    --------
    >>> d50, d65 = [96.42, 100.0, 82.52], [95.05, 100.0, 108.88]
    >>> (bradford_matrix(d50, d65) @ d50).round(6).tolist()
    [95.05, 100.0, 108.88]
    """
    return adaptation_matrix(from_white_XYZ, to_white_XYZ, "bradford")


def _responses_to(white_XYZ: ArrayLike, responses: NDArray[np.float64]) -> NDArray[np.float64]:
    white = np.asarray(white_XYZ, dtype=np.float64)
    if white.shape != (3,) or not np.all(np.isfinite(white)) or white[1] <= 0:
        raise DeviceError(f"a white needs three finite numbers with Y above 0, not {white.tolist()}")
    found = responses @ white
    if np.any(found <= 0):
        raise DeviceError(f"the eye cannot adapt to {white.tolist()}: it is no light, or too saturated to be a white")
    return np.asarray(found)
