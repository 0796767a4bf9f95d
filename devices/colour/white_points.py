"""Reference whites of CIELAB, as XYZ of luminance 1."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching.cie_2006_xyz import colorimetric_observer
from devices.colour_matching.observers import DEFAULT_OBSERVER
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


def white_point(name: str, luminance_cd_m2: float, observer: str = DEFAULT_OBSERVER) -> NDArray[np.float64]:
    """Return the XYZ, shape (3,), of a white by name (``WHITE_POINTS_XYZ``), at a luminance in cd/m².

    Parameters
    ----------
    name
        A key of ``WHITE_POINTS_XYZ``, such as ``d65``.
    luminance_cd_m2
        Its luminance, above 0.
    observer
        The colorimetric observer. For CIE 1931 2° the white is the tabulated one; for others it is summed from the
        illuminant's spectrum, ``icc-d50`` being D50.

    Returns
    -------
    ndarray
        XYZ in cd/m², shape (3,).

    Raises
    ------
    DeviceError
        If there is no such white or observer, or the luminance is not a finite number above 0.

    Examples
    --------
    >>> white_point("d65", 100.0).round(2).tolist()
    [95.05, 100.0, 108.88]
    >>> white_point("d65", 100.0, "CIE 1964 10").round(2).tolist()
    [94.81, 100.0, 107.3]
    """
    if name not in WHITE_POINTS_XYZ:
        raise DeviceError(f"there is no white '{name}'; expected one of: {', '.join(WHITE_POINTS_XYZ)}")
    if not (np.isfinite(luminance_cd_m2) and luminance_cd_m2 > 0):
        raise DeviceError(f"a white's luminance is {luminance_cd_m2} cd/m²; it must be a finite number above 0")
    if observer == DEFAULT_OBSERVER:
        return np.array(WHITE_POINTS_XYZ[name]) * luminance_cd_m2
    # Importing all of colour-science takes a second; only other observers wait for it.
    from colour.colorimetry.datasets import SDS_ILLUMINANTS

    light = SDS_ILLUMINANTS[name.removeprefix("icc-").upper()]
    waves = np.arange(360.0, 831.0)
    known = np.asarray(light.wavelengths, dtype=np.float64)
    spectrum = np.interp(waves, known, np.asarray(light.values, dtype=np.float64), left=0.0, right=0.0)
    XYZ = spectrum @ colorimetric_observer(observer).functions_at(waves)
    return np.asarray(XYZ / XYZ[1] * luminance_cd_m2)
