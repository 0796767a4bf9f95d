"""Whether a grating is seen: contrast sensitivity by frequency, luminance and size, and the acuity for colour.

Barten's model of the eye [Barten1999]: photon noise, neural noise and lateral inhibition in front of an optical
modulation transfer; for an average observer of 20 to 30 years, both eyes, a sine grating that is looked at for a
tenth of a second. Sensitivity is one over the modulation (max − min) / (max + min) that half of the looks detect; the
thesis asks for it in Section 2.4.2. The acuity for colour is that of its Section 2.4.3 [Mullen1985]: gratings of
constant luminance are not seen as coloured above 11 cycles per degree.

The expressions are those of colour-science, which the tests compare with; here they stand in full so that starting does
not wait for its import.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError
from documents.arrays import Floats

CHROMATIC_CYCLES_PER_DEGREE = 11.0
"""No grating of constant luminance, red-green or yellow-blue, is seen in colour above it [Mullen1985]."""
# The typical eye of [Barten1999]: signal to noise, integration in s, degrees, cycles, quantum efficiency, photons per
# (s·deg²·troland) of a display's light, s·deg², cycles per degree; blur at 0 in degrees, and with the pupil per mm.
_K, _T, _X_MAX, _N_MAX, _EFFICIENCY, _PHOTONS = 3.0, 0.1, 12.0, 15.0, 0.03, 1.2274e6
_NEURAL, _U0, _BLUR_DEG, _BLUR_DEG_PER_MM = 3e-8, 7.0, 0.5 / 60.0, 0.08 / 60.0


def contrast_sensitivity(
    cycles_per_degree: ArrayLike, luminance_cd_m2: ArrayLike, field_deg: ArrayLike = 10.0, eyes: int = 2
) -> Floats:
    """Return the contrast sensitivity of the eye: one over the least modulation of a sine grating that is seen.

    Parameters
    ----------
    cycles_per_degree
        The spatial frequency, above 0, any shape.
    luminance_cd_m2
        The mean luminance in cd/m², above 0; it broadcasts.
    field_deg
        The side of the square field that the grating fills, in degrees, above 0; it broadcasts.
    eyes
        2, or 1 for one eye, whose sensitivity is √2 less.

    Returns
    -------
    ndarray
        Sensitivity, of the broadcast shape: 100 is a threshold of 1 %. Below 1 nothing is seen at any contrast.

    Raises
    ------
    DeviceError
        If a frequency, luminance or field is not a finite number above 0, or the eyes are not 1 or 2.

    Examples
    --------
    >>> contrast_sensitivity([1.0, 4.0, 30.0], 100.0).round(1).tolist()
    [413.9, 668.5, 27.3]
    """
    u = _positive("spatial frequency", cycles_per_degree, "cycles per degree")
    light = _positive("luminance", luminance_cd_m2, "cd/m²")
    field = _positive("field", field_deg, "degrees")
    if eyes not in (1, 2):
        raise DeviceError(f"a grating is seen with {eyes} eyes; write 2, or 1")
    pupil_mm = 5.0 - 3.0 * np.tanh(0.4 * np.log10(light * field**2 / 40.0**2))
    # Trolands, less what comes in at the edge of the pupil (Stiles and Crawford).
    trolands = np.pi * pupil_mm**2 / 4.0 * light * (1.0 - (pupil_mm / 9.7) ** 2 + (pupil_mm / 12.4) ** 4)
    blur_deg = np.hypot(_BLUR_DEG, _BLUR_DEG_PER_MM * pupil_mm)
    optics = np.exp(-2.0 * np.pi**2 * blur_deg**2 * u**2)
    area = 1.0 / field**2 + 1.0 / _X_MAX**2 + u**2 / _N_MAX**2
    noise = 1.0 / (_EFFICIENCY * _PHOTONS * trolands) + _NEURAL / -np.expm1(-((u / _U0) ** 2))
    return np.asarray(optics / _K / np.sqrt(2.0 / _T * area * noise) / np.sqrt(2.0 / eyes))


def visible(
    contrast: ArrayLike, cycles_per_degree: ArrayLike, luminance_cd_m2: ArrayLike, field_deg: ArrayLike = 10.0
) -> NDArray[np.bool_]:
    """Return whether a grating is seen by both eyes of an average observer.

    Parameters
    ----------
    contrast
        Its modulation, (max − min) / (max + min) of the luminance, 0 to 1.
    cycles_per_degree, luminance_cd_m2, field_deg
        As of `contrast_sensitivity`.

    Returns
    -------
    ndarray
        True where half of the looks, or more, detect it; of the broadcast shape.

    Raises
    ------
    DeviceError
        As of `contrast_sensitivity`, or if a contrast is not 0 to 1.

    Examples
    --------
    >>> visible(0.01, [4.0, 30.0], luminance_cd_m2=100.0).tolist()
    [True, False]
    """
    modulation = np.asarray(contrast, dtype=np.float64)
    if not np.all((modulation >= 0) & (modulation <= 1)):
        raise DeviceError("a contrast is (max − min) / (max + min) of the luminance, 0 to 1")
    return np.asarray(modulation * contrast_sensitivity(cycles_per_degree, luminance_cd_m2, field_deg) >= 1.0)


def finest_visible(luminance_cd_m2: float, contrast: float = 1.0, field_deg: float = 10.0) -> float:
    """Return the highest spatial frequency that is seen, in cycles per degree; 0 where none is.

    Parameters
    ----------
    luminance_cd_m2, field_deg
        As of `contrast_sensitivity`.
    contrast
        The modulation of the grating, above 0, up to 1.

    Returns
    -------
    float
        Cycles per degree.

    Raises
    ------
    DeviceError
        As of `visible`.

    Examples
    --------
    >>> round(finest_visible(100.0), 1), round(finest_visible(0.1), 1)
    (48.5, 27.9)
    """
    frequencies = np.geomspace(0.05, 200.0, 2001)
    seen = np.flatnonzero(visible(contrast, frequencies, luminance_cd_m2, field_deg))
    if not seen.size:
        return 0.0
    low, high = float(frequencies[seen[-1]]), float(frequencies[min(seen[-1] + 1, 2000)])
    for _ in range(40):
        middle = 0.5 * (low + high)
        if visible(contrast, middle, luminance_cd_m2, field_deg):
            low = middle
        else:
            high = middle
    return low


@dataclass(frozen=True, slots=True)
class FinestDetail:
    """The finest detail of a display, lines one pixel wide, as it is seen from where the observer sits.

    ``display_cycles_per_degree`` is the frequency of such lines, ``least_contrast`` the modulation at which they are
    seen on half of the white's light (above 1: not at all), ``eye_cycles_per_degree`` the highest frequency that is
    seen at full contrast.
    """

    display_cycles_per_degree: float
    least_contrast: float
    eye_cycles_per_degree: float

    @classmethod
    def of(cls, pixels_per_degree: float, white_cd_m2: float) -> FinestDetail:
        """Return it for a display of so many pixels per degree, and its white. Raises DeviceError."""
        nyquist, mean = pixels_per_degree / 2.0, white_cd_m2 / 2.0
        sensitivity = float(contrast_sensitivity(nyquist, mean))
        threshold = 1.0 / sensitivity if sensitivity > 0 else np.inf
        return cls(nyquist, threshold, finest_visible(mean))

    def sentences(self) -> tuple[str, ...]:
        """Return sentences for a person at the rig."""
        lines = f"lines one pixel wide ({self.display_cycles_per_degree:.3g} cycles per degree)"
        if self.least_contrast > 1.0:
            luminance = f"{lines} are too fine to be seen at any contrast"
        else:
            luminance = f"{lines} are seen from a contrast of {100.0 * self.least_contrast:.2g} %"
        width = self.display_cycles_per_degree / CHROMATIC_CYCLES_PER_DEGREE
        colour = (
            f"differences of colour alone are seen in lines {width:.2g} pixels wide or more"
            if width > 1.0
            else "differences of colour alone are seen down to one pixel"
        )
        return luminance, colour


def _positive(what: str, values: ArrayLike, unit: str) -> Floats:
    numbers = np.asarray(values, dtype=np.float64)
    bad = ~(np.isfinite(numbers) & (numbers > 0))
    if np.any(bad):
        raise DeviceError(f"a {what} is {numbers[bad].ravel()[0]:g} {unit}; it must be a finite number above 0")
    return numbers
