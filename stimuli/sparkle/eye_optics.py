"""The optics of a mean human eye, by its pupil, for pictures of what its retina receives [Watson2013].

A camera's picture is seen by an observer's own eye, which spreads its light again: this is for looking at a plate as
an eye does, not for pictures that are shown to one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.scene import Camera

WAVELENGTH_NM = 555.0


def eye_mtf(cycles_per_degree: NDArray[np.float64], pupil_mm: float) -> NDArray[np.float64]:
    """Return the eye's modulation transfer, 1 at 0, at each frequency, for a pupil of 2 to 6 mm in white light.

    (1 + (u/u₁)²)^−0.62 · √D with u₁ = 21.95 − 5.512 d + 0.3922 d² and D the transfer of a perfect lens of pupil d.
    """
    first = 21.95 - 5.512 * pupil_mm + 0.3922 * pupil_mm**2
    limit = pupil_mm * np.pi * 1e6 / (WAVELENGTH_NM * 180.0)
    share = np.minimum(cycles_per_degree / limit, 1.0)
    perfect = 2.0 / np.pi * (np.arccos(share) - share * np.sqrt(1.0 - share**2))
    return np.asarray((1.0 + (cycles_per_degree / first) ** 2) ** -0.62 * np.sqrt(np.maximum(perfect, 0.0)))


def through_the_eye(luminance: NDArray[np.float32], camera: Camera) -> NDArray[np.float32]:
    """Return ``luminance`` (rows, columns) on the camera's grid as an eye of the camera's pupil spreads it.

    Outside of the plate it is dark, and light that falls there is lost.
    """
    from scipy.fft import fftfreq, irfft2, next_fast_len, rfft2, rfftfreq

    if camera.pupil_mm is None:
        return luminance
    px_per_degree = camera.resolution_px_per_mm * camera.distance_mm * np.tan(np.radians(1.0))
    rows, columns = luminance.shape
    margin = int(np.ceil(px_per_degree))
    shape = next_fast_len(rows + margin, real=True), next_fast_len(columns + margin, real=True)
    down = fftfreq(shape[0]) * px_per_degree
    across = rfftfreq(shape[1]) * px_per_degree
    transfer = eye_mtf(np.hypot(across[None, :], down[:, None]), camera.pupil_mm).astype(np.float32)
    spread = irfft2(rfft2(luminance, shape) * transfer, shape)[:rows, :columns]
    return np.maximum(spread, np.float32(0)).astype(np.float32)
