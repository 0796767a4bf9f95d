"""The geometry of looking at a screen: angles, pixels and disparities.

Thesis Section 2.4.1, Expressions 2.11 and 2.12. The thesis asks for 60 pixels per degree where 60 cycles per degree
are resolved; a cycle needs two samples, so both figures are offered (`minimum_resolution` and `nyquist_resolution`).
Angles are in degrees, sizes in millimetres on the screen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from devices.errors import DeviceError
from documents.arrays import Floats

# The finest grating that normal vision resolves (Snellen 20/20: a stroke of one minute of arc).
CYCLES_PER_DEGREE = 60.0


def visual_angle_deg(size_mm: ArrayLike, distance_mm: float) -> Floats:
    """Return the angle that ``size_mm`` (any shape), seen square on, subtends at ``distance_mm`` (Expression 2.11).

    Parameters
    ----------
    size_mm
        The size on the screen, any shape.
    distance_mm
        The viewing distance, above 0.

    Returns
    -------
    ndarray
        The angle in degrees, of the shape of ``size_mm``.

    Raises
    ------
    DeviceError
        If the distance is not a finite number above 0.

    Examples
    --------
    >>> float(visual_angle_deg(150.0, 700.0).round(2))
    12.23
    """
    _refuse_not_positive("distance_mm", distance_mm)
    size = np.asarray(size_mm, dtype=np.float64)
    return np.asarray(np.degrees(2.0 * np.arctan(size / (2.0 * distance_mm))))


def size_mm(angle_deg: ArrayLike, distance_mm: float) -> Floats:
    """Return the size that subtends ``angle_deg`` (any shape, below 180) at ``distance_mm``; undoes `visual_angle_deg`.

    Parameters
    ----------
    angle_deg
        Visual angle in degrees, any shape, below 180.
    distance_mm
        The viewing distance, above 0.

    Returns
    -------
    ndarray
        The size on the screen in millimetres, of the shape of ``angle_deg``.

    Raises
    ------
    DeviceError
        If the distance is not a finite number above 0.

    Examples
    --------
    >>> size_mm([1.0, 12.23], 700.0).round(1).tolist()
    [12.2, 150.0]
    """
    _refuse_not_positive("distance_mm", distance_mm)
    angle = np.asarray(angle_deg, dtype=np.float64)
    return np.asarray(2.0 * distance_mm * np.tan(np.radians(angle) / 2.0))


def minimum_resolution(angle_deg: ArrayLike) -> Floats:
    """Return the thesis's MR for a picture of ``angle_deg``: its cycles at 60 cycles per degree (Expression 2.12).

    The thesis reads the figure as pixels. That many pixels show gratings of half the frequency;
    `nyquist_resolution` is what hides the pixel grid from 60 cycles per degree.

    Parameters
    ----------
    angle_deg
        Visual angle in degrees, any shape, at least 0.

    Returns
    -------
    ndarray
        Cycles, which the thesis takes as pixels, of the shape of ``angle_deg``.

    Examples
    --------
    >>> minimum_resolution([1.0, 20.0]).tolist()
    [60.0, 1200.0]
    """
    return np.asarray(np.asarray(angle_deg, dtype=np.float64) * CYCLES_PER_DEGREE)


def nyquist_resolution(angle_deg: ArrayLike) -> Floats:
    """Return the pixels that a picture of ``angle_deg`` needs to carry 60 cycles per degree: two per cycle.

    Parameters
    ----------
    angle_deg
        Visual angle in degrees, any shape, at least 0.

    Returns
    -------
    ndarray
        Pixels, not rounded, of the shape of ``angle_deg``.

    Examples
    --------
    >>> nyquist_resolution([1.0, 20.0]).tolist()
    [120.0, 2400.0]
    """
    return 2.0 * minimum_resolution(angle_deg)


def pixels_per_degree(pixel_pitch_mm: float, distance_mm: float) -> float:
    """Return how many pixels lie in the degree straight ahead of the observer.

    Parameters
    ----------
    pixel_pitch_mm
        The distance from pixel to pixel, above 0.
    distance_mm
        The viewing distance, above 0.

    Returns
    -------
    float
        Pixels per degree of visual angle.

    Raises
    ------
    DeviceError
        If the pitch or the distance is not a finite number above 0.

    Examples
    --------
    >>> round(pixels_per_degree(0.2768, 700.0), 1)
    44.1
    """
    return float(size_mm(1.0, distance_mm)) / _refuse_not_positive("pixel_pitch_mm", pixel_pitch_mm)


def mm_from_px(length_px: ArrayLike, pixel_pitch_mm: float) -> Floats:
    """Return millimetres for pixels (any shape) at a pitch.

    Parameters
    ----------
    length_px
        Length in pixels, any shape.
    pixel_pitch_mm
        The distance from pixel to pixel, above 0.

    Returns
    -------
    ndarray
        Length in millimetres, of the shape of ``length_px``.

    Raises
    ------
    DeviceError
        If the pitch is not a finite number above 0.

    Examples
    --------
    >>> mm_from_px([100, 1920], 0.2768).round(2).tolist()
    [27.68, 531.46]
    """
    return np.asarray(np.asarray(length_px, dtype=np.float64) * _refuse_not_positive("pixel_pitch_mm", pixel_pitch_mm))


def px_from_mm(length_mm: ArrayLike, pixel_pitch_mm: float) -> Floats:
    """Return pixels (not rounded) for millimetres (any shape) at a pitch.

    Parameters
    ----------
    length_mm
        Length in millimetres, any shape.
    pixel_pitch_mm
        The distance from pixel to pixel, above 0.

    Returns
    -------
    ndarray
        Length in pixels, not rounded, of the shape of ``length_mm``.

    Raises
    ------
    DeviceError
        If the pitch is not a finite number above 0.

    Examples
    --------
    >>> px_from_mm([27.68, 100.0], 0.2768).round(1).tolist()
    [100.0, 361.3]
    """
    return np.asarray(np.asarray(length_mm, dtype=np.float64) / _refuse_not_positive("pixel_pitch_mm", pixel_pitch_mm))


def disparity_arcmin(
    disparity_px: ArrayLike, pixel_pitch_mm: float, distance_mm: float, interpupillary_distance_mm: float = 65.0
) -> Floats:
    """Return the angular disparity, in minutes of arc, of points with a parallax on the screen.

    ``disparity_px`` (any shape) is the right eye's horizontal position minus the left eye's: positive lies behind the
    screen, and so does the angle, negative in front of it. It is the difference of the vergence angles towards the
    screen and towards the point, on the midline; at parallax equal to the eyes' distance the point is at infinity.

    Parameters
    ----------
    disparity_px
        The right eye's position minus the left eye's, any shape.
    pixel_pitch_mm
        The distance from pixel to pixel, above 0.
    distance_mm
        The viewing distance, above 0.
    interpupillary_distance_mm
        The distance between the eyes, above 0.

    Returns
    -------
    ndarray
        Minutes of arc, of the shape of ``disparity_px``.

    Raises
    ------
    DeviceError
        If the pitch, the distance or the eyes' distance is not a finite number above 0.

    Examples
    --------
    >>> disparity_arcmin([-1.0, 0.0, 1.0], 0.2768, 700.0).round(2).tolist()
    [-1.36, 0.0, 1.36]
    """
    _refuse_not_positive("distance_mm", distance_mm)
    eyes = _refuse_not_positive("interpupillary_distance_mm", interpupillary_distance_mm)
    parallax = mm_from_px(disparity_px, pixel_pitch_mm)
    return np.asarray(60.0 * (visual_angle_deg(eyes, distance_mm) - visual_angle_deg(eyes - parallax, distance_mm)))


def _refuse_not_positive(name: str, value: float) -> float:
    if not (np.isfinite(value) and value > 0):
        raise DeviceError(f"{name} is {value}; it must be a finite number above 0")
    return float(value)
