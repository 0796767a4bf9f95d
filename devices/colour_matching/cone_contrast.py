"""Cone contrasts, and the opponent axes of Derrington, Krauskopf and Lennie, of light against a background.

A. M. Derrington, J. Krauskopf, P. Lennie 1984, "Chromatic mechanisms in lateral geniculate nucleus of macaque"
[Derrington1984]; units and conversion as D. H. Brainard 1996, "Cone contrast and opponent modulation color spaces"
[Brainard1996]. With the contrasts c of the cones, and l and m the shares of L and M in the background's luminance:

    luminance  √3 · (l·c_L + m·c_M)
    red-green  √(l² + m²) · (c_L − c_M)
    blue       c_S − (l·c_L + m·c_M)

Each is 1 for the light that stirs its mechanism alone with a pooled contrast √(c_L² + c_M² + c_S²) of 1.

XYZ of the observers of CIE 170 are linear in their own cones, exactly. Those of CIE 1931 2° are not linear in any; for
them the cones are those of Smith and Pokorny [Smith1975], which were made for Judd's and Vos's correction of CIE 1931,
and which [Derrington1984] used: of broad lights, contrasts of L and M are exact to 0.02, and S is up to a tenth off.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from devices.colour_matching.cie_2006_xyz import colorimetric_observer, xyz_from_lms
from devices.colour_matching.observers import DEFAULT_OBSERVER
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats

# Smith and Pokorny 1975: L + M is the luminance Y.
_SMITH_POKORNY = np.array([[0.15514, 0.54312, -0.03286], [-0.15514, 0.45684, 0.03286], [0.0, 0.0, 0.01608]])


def lms_from_xyz(observer: str = DEFAULT_OBSERVER) -> Floats:
    """Return the matrix from XYZ to the excitations of the cones, scaled so that L + M is the luminance Y.

    Parameters
    ----------
    observer
        Whose XYZ: ``CIE 1931 2`` (cones of Smith and Pokorny), ``CIE 2015 2``, ``CIE 2015 10``, or
        ``CIE 2006 FIELD age AGE``.

    Returns
    -------
    ndarray
        Shape (3, 3); S is in a unit of its own, which contrasts do not depend on.

    Raises
    ------
    DeviceError
        If there is no such observer, or its cones are not known (CIE 1964 10°).

    Examples
    --------
    >>> LMS = lms_from_xyz() @ [95.05, 100.0, 108.88]
    >>> LMS.round(2).tolist()
    [65.48, 34.52, 1.75]
    """
    return _matrix(colorimetric_observer(observer).name).copy()


def cone_contrasts(xyz: ArrayLike, background_XYZ: ArrayLike, observer: str = DEFAULT_OBSERVER) -> Floats:
    """Return the contrasts of the L, M and S cones against a background: (excitation − background) / background.

    Parameters
    ----------
    xyz
        XYZ, shape (..., 3), in the unit of the background.
    background_XYZ
        XYZ of the background to which the eye is adapted, shape (3,).
    observer
        As of `lms_from_xyz`.

    Returns
    -------
    ndarray
        Contrasts of L, M and S, shape (..., 3); −1 is no light at all.

    Raises
    ------
    DeviceError
        As of `lms_from_xyz`, or if the background does not excite all three cones.

    Examples
    --------
    >>> cone_contrasts([104.555, 110.0, 119.768], [95.05, 100.0, 108.88]).round(6).tolist()
    [0.1, 0.1, 0.1]
    """
    matrix, background = _seen(background_XYZ, observer)
    return np.asarray(np.asarray(xyz, dtype=np.float64) @ matrix.T / background - 1.0)


def xyz_of_cone_contrasts(contrasts: ArrayLike, background_XYZ: ArrayLike, observer: str = DEFAULT_OBSERVER) -> Floats:
    """Return the XYZ of light of given cone contrasts: the inverse of `cone_contrasts`.

    Parameters
    ----------
    contrasts
        Contrasts of L, M and S, shape (..., 3), −1 or above.
    background_XYZ
        XYZ of the background, shape (3,).
    observer
        As of `lms_from_xyz`.

    Returns
    -------
    ndarray
        XYZ, shape (..., 3), in the unit of the background. Whether a display can show them is not asked.

    Raises
    ------
    DeviceError
        As of `cone_contrasts`, or if a contrast is below −1, which no light has, or not finite.

    Examples
    --------
    >>> background = [95.05, 100.0, 108.88]
    >>> stimulus = xyz_of_cone_contrasts([0.0, 0.0, 0.5], background)     # S cones alone
    >>> stimulus.round(2).tolist()
    [106.58, 100.0, 163.32]
    """
    matrix, background = _seen(background_XYZ, observer)
    wanted = np.asarray(contrasts, dtype=np.float64)
    bad = ~(np.isfinite(wanted) & (wanted >= -1.0 - 1e-12))
    if np.any(bad):
        raise DeviceError(
            Finding(f"a cone contrast is {wanted[bad][0]:g}", remedy="contrasts are −1 (no light) or above")
        )
    return np.asarray((1.0 + wanted) * background @ np.linalg.inv(matrix).T)


def dkl_from_xyz(xyz: ArrayLike, background_XYZ: ArrayLike, observer: str = DEFAULT_OBSERVER) -> Floats:
    """Return the coordinates on the axes of Derrington, Krauskopf and Lennie: luminance, red-green, blue.

    Parameters
    ----------
    xyz, background_XYZ, observer
        As of `cone_contrasts`.

    Returns
    -------
    ndarray
        Luminance, L − M and S − (L + M), shape (..., 3); each is 1 where light that stirs its mechanism alone has a
        pooled cone contrast of 1 [Brainard1996].

    Raises
    ------
    DeviceError
        As of `cone_contrasts`.

    Examples
    --------
    >>> dkl_from_xyz([104.555, 110.0, 119.768], [95.05, 100.0, 108.88]).round(6).tolist()
    [0.173205, 0.0, -0.0]
    """
    contrasts = cone_contrasts(xyz, background_XYZ, observer)
    return np.asarray(contrasts @ _mechanisms(background_XYZ, observer).T)


def xyz_of_dkl(dkl: ArrayLike, background_XYZ: ArrayLike, observer: str = DEFAULT_OBSERVER) -> Floats:
    """Return the XYZ of light at given coordinates of `dkl_from_xyz`: its inverse.

    Parameters
    ----------
    dkl
        Luminance, L − M and S − (L + M), shape (..., 3).
    background_XYZ, observer
        As of `cone_contrasts`.

    Returns
    -------
    ndarray
        XYZ, shape (..., 3), in the unit of the background.

    Raises
    ------
    DeviceError
        As of `xyz_of_cone_contrasts`.

    Examples
    --------
    >>> background = [95.05, 100.0, 108.88]
    >>> red = xyz_of_dkl([0.0, 0.08, 0.0], background)      # no change of luminance or of S cones
    >>> (cone_contrasts(red, background) * 100).round(2).tolist(), float(red[1].round(6))
    ([3.73, -7.08, 0.0], 100.0)
    """
    back = np.linalg.inv(_mechanisms(background_XYZ, observer))
    contrasts = np.asarray(dkl, dtype=np.float64) @ back.T
    return xyz_of_cone_contrasts(contrasts, background_XYZ, observer)


def dkl_direction(azimuth_deg: ArrayLike, elevation_deg: ArrayLike = 0.0) -> Floats:
    """Return the unit vector on the axes of `dkl_from_xyz` for an azimuth and an elevation [Derrington1984].

    Parameters
    ----------
    azimuth_deg
        In the plane of constant luminance: 0° towards more L and less M, 90° towards more S.
    elevation_deg
        Above that plane: 90° is brighter without a change of hue.

    Returns
    -------
    ndarray
        Luminance, L − M and S − (L + M), shape (..., 3), of length 1.

    Examples
    --------
    >>> dkl_direction([0.0, 90.0], [0.0, 0.0]).round(6).tolist()
    [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    azimuth, elevation = np.deg2rad(np.asarray(azimuth_deg, np.float64)), np.deg2rad(np.asarray(elevation_deg))
    flat = np.cos(elevation)
    return np.stack(np.broadcast_arrays(np.sin(elevation), flat * np.cos(azimuth), flat * np.sin(azimuth)), axis=-1)


@lru_cache(maxsize=32)
def _matrix(name: str) -> Floats:
    if name == DEFAULT_OBSERVER:
        return _SMITH_POKORNY
    observer = colorimetric_observer(name)
    age = 32.0 if name.startswith("CIE 2015") else observer.age_years
    if age is None:
        raise DeviceError(
            Finding(f"the cones of {name} are not known", remedy="use CIE 1931 2, CIE 2015 10 or CIE 2006 10 age 32")
        )
    matrix = xyz_from_lms(observer.field_deg, age)
    # L and M in units of their luminance.
    return np.asarray(np.diag([matrix[1, 0], matrix[1, 1], 1.0]) @ np.linalg.inv(matrix))


def _seen(background_XYZ: ArrayLike, observer: str) -> tuple[Floats, Floats]:
    """Return the matrix to the cones, and what the background excites in them."""
    matrix, background = lms_from_xyz(observer), np.asarray(background_XYZ, dtype=np.float64)
    if background.shape != (3,) or not np.all(np.isfinite(background)):
        raise DeviceError(f"a background needs three finite numbers, not {background.tolist()}")
    excited = matrix @ background
    if np.any(excited <= 0):
        raise DeviceError(
            Finding(
                f"the background {background.tolist()} excites L, M and S by {excited.round(4).tolist()}",
                remedy="contrasts need a background that excites all three: give XYZ of a real light, in cd/m²",
            )
        )
    return matrix, np.asarray(excited)


def _mechanisms(background_XYZ: ArrayLike, observer: str) -> Floats:
    """Return the matrix from cone contrasts to the three axes."""
    _, (long, middle, _) = _seen(background_XYZ, observer)
    l, m = long / (long + middle), middle / (long + middle)  # noqa: E741  # the paper's letters
    axes = np.array([[l, m, 0.0], [1.0, -1.0, 0.0], [-l, -m, 1.0]])
    return np.asarray(np.diag([np.sqrt(3.0), np.hypot(l, m), 1.0]) @ axes)
