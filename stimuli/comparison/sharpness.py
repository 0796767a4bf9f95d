"""How much blurrier one picture is than another, from their spectra, which no shift changes.

A Gaussian blur of standard deviation σ multiplies a spectrum's power by exp(−4π²σ²f²) at f cycles per pixel: σ² is the
slope of the logarithm of both powers' ratio. The sharper picture, blurred by as much, is then registered as well as two
pictures of one sharpness are.
"""

from __future__ import annotations

import numpy as np

from documents.arrays import Floats, Floats32
from stimuli.align.phase import hann
from stimuli.align.planes import texture

_RINGS = 96
# Frequencies are used where the blurrier picture has so many times the power of the highest ones, which is noise.
_ABOVE_NOISE = 4.0
# Where less than this share of the power is left, the rest is what the window leaks.
_LEAST_RATIO = 1e-3
_LEAST_RINGS = 4
# Of the logarithm's variance, what a blur may leave: noise in one picture alone leaves more.
_MOST_LEFT = 0.05
# A blur by less is nothing to registration.
LEAST_BLUR_PX = 1.0
# A blur beyond this leaves nothing to register by.
_MOST_BLUR_PX = 16.0


def blur_between(photo: Floats32, rendering: Floats32) -> float:
    """Return by how many pixels' standard deviation the rendering is blurrier, negative if the photograph is.

    0 where it is next to nothing, or not known. Planes of luminance, (height, width) each.
    """
    first, second = _power(photo), _power(rendering)
    frequency = (np.arange(_RINGS) + 0.5) / (2 * _RINGS)
    floors = [float(np.median(power[-_RINGS // 8 :])) for power in (first, second)]
    # Beside what is coarse, the blurrier one has less that is fine.
    shares = [
        floor / max(float(power[1:4].mean()), 1e-300) for floor, power in zip(floors, (first, second), strict=True)
    ]
    blurrier, floor = (second, floors[1]) if shares[1] < shares[0] else (first, floors[0])
    used = (blurrier > _ABOVE_NOISE * floor) & (first > 0) & (second > 0)
    used[0] = False
    ratio = np.where(used, second, 1.0) / np.where(used, first, 1.0)
    # From the lowest on, up to where one of both has nothing left.
    used &= (ratio > _LEAST_RATIO * ratio[1:3].max()) & (ratio < ratio[1:3].min() / _LEAST_RATIO)
    last = int(np.argmin(used[1:])) + 1 if not used[1:].all() else _RINGS
    if last - 1 < _LEAST_RINGS:
        return 0.0
    at = slice(1, last)
    square, weight = frequency[at] ** 2, frequency[at]
    slope = _slope(square, np.log(ratio[at]), weight)
    blur = float(np.sqrt(abs(slope)) / (2 * np.pi))
    return float(np.copysign(blur, -slope)) if LEAST_BLUR_PX <= blur <= _MOST_BLUR_PX else 0.0


def _slope(x: Floats, y: Floats, weight: Floats) -> float:
    """Return the slope of a line through points (n,), 0 where they do not lie along one."""
    x, y = (values - np.average(values, weights=weight) for values in (x, y))
    slope = float(np.sum(weight * x * y) / np.sum(weight * x**2))
    left, whole = float(np.sum(weight * (y - slope * x) ** 2)), float(np.sum(weight * y**2))
    return slope if left <= _MOST_LEFT * whole else 0.0


def blurred(plane: Floats32, sd_px: float) -> Floats32:
    """Return a plane blurred by a Gaussian of a standard deviation; as it is where that is not above 0."""
    if sd_px <= 0:
        return plane
    import cv2

    return np.asarray(cv2.GaussianBlur(plane, (0, 0), sd_px, borderType=cv2.BORDER_REPLICATE), dtype=np.float32)


def _power(plane: Floats32) -> Floats:
    """Return the mean power of a plane's texture in rings of frequency up to half a cycle per pixel, (rings,)."""
    height, width = plane.shape
    spectrum = np.abs(np.fft.rfft2(texture(plane) * np.outer(hann(height), hann(width)))) ** 2
    distance = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width)[None, :])
    ring = np.minimum((distance * 2 * _RINGS).astype(np.int64), _RINGS)
    total, count = (np.bincount(ring.ravel(), weight, _RINGS + 1) for weight in (spectrum.ravel(), None))
    return np.asarray(total[:_RINGS] / np.maximum(count[:_RINGS], 1))
