"""Reference whites of CIELAB, as XYZ of luminance 1."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from devices.errors import DeviceError

# The profile connection space of ICC.1:2022 (Section 7.2.16): D50 in fractions of 16 bits, the thesis's choice.
# The others: CIE 15:2018, Table T.3, for the 2° observer.
WHITE_POINTS_XYZ: Mapping[str, tuple[float, float, float]] = MappingProxyType(
    {
        "icc-d50": (0.964202880859375, 1.0, 0.8249053955078125),
        "d50": (0.96422, 1.0, 0.82521),
        "d65": (0.95047, 1.0, 1.08883),
        "a": (1.09850, 1.0, 0.35585),
        "e": (1.0, 1.0, 1.0),
    }
)


def white_point(name: str, luminance_cd_m2: float) -> NDArray[np.float64]:
    """Return the XYZ, shape (3,), of a white by name (``WHITE_POINTS_XYZ``), at a luminance in cd/m².

    Parameters
    ----------
    name
        A key of ``WHITE_POINTS_XYZ``, such as ``d65``.
    luminance_cd_m2
        Its luminance, above 0.

    Returns
    -------
    ndarray
        XYZ in cd/m², shape (3,).

    Raises
    ------
    DeviceError
        If there is no such white, or the luminance is not a finite number above 0.

    Examples
    --------
    >>> white_point("d65", 100.0).round(2).tolist()
    [95.05, 100.0, 108.88]
    """
    if name not in WHITE_POINTS_XYZ:
        raise DeviceError(f"there is no white '{name}'; expected one of: {', '.join(WHITE_POINTS_XYZ)}")
    if not (np.isfinite(luminance_cd_m2) and luminance_cd_m2 > 0):
        raise DeviceError(f"a white's luminance is {luminance_cd_m2} cd/m²; it must be a finite number above 0")
    return np.array(WHITE_POINTS_XYZ[name]) * luminance_cd_m2
