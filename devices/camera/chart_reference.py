"""The 24 colours of the ColorChecker in the light that falls on it: where nobody measured the chart itself.

The colours under D50 (devices/patches/colorchecker.csv) are adapted to the light by Bradford's transform [Lam1985] as
colour-science has it. A chart differs from the published one, and fades; its own readings are better.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour.spaces import XYZ_from_xyY
from devices.errors import DeviceError
from devices.patches.colorchecker import colorchecker_xyY
from documents import Finding

Floats = NDArray[np.float64]

_D50_XY = (0.345703, 0.358539)


def colorchecker_XYZ(white_XYZ_cd_m2: ArrayLike) -> tuple[tuple[str, ...], Floats]:
    """Return the names and XYZ (24, 3) in cd/m² of a ColorChecker whose white patch has ``white_XYZ_cd_m2`` (3,).

    Raises
    ------
    DeviceError
        If the white is not three finite numbers above 0.
    """
    from colour.adaptation import matrix_chromatic_adaptation_VonKries

    white = np.asarray(white_XYZ_cd_m2, dtype=np.float64)
    if white.shape != (3,) or not np.all(np.isfinite(white) & (white > 0)):
        raise DeviceError(Finding(f"the white patch is {white.tolist()}", remedy="give its X,Y,Z in cd/m²"))
    names, xyY = colorchecker_xyY()
    XYZ = XYZ_from_xyY(xyY)
    brightest = XYZ[np.argmax(XYZ[:, 1])]
    # The patch, not a perfect white, was measured: it is taken to be as little coloured in this light as under D50.
    d50 = XYZ_from_xyY([*_D50_XY, 1.0])
    light = white / brightest * d50
    matrix = np.asarray(matrix_chromatic_adaptation_VonKries(d50, light, transform="Bradford"))
    adapted = XYZ @ matrix.T
    return names, np.asarray(adapted * white[1] / adapted[np.argmax(xyY[:, 2]), 1])
