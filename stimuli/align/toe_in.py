"""Pairs taken with the cameras turned inwards, made as if they had stood parallel, and the keystone that this undoes.

Section 4.4.2 of the thesis, Figure 4.6. Turned cameras see the sample's plane as trapezia that lean against each other:
a corner stands higher for one eye than for the other, which tires the eyes. What a rotation does to a picture does not
depend on what is before the camera, so that one homography undoes it, K R K'⁻¹ [Hartley2003]. The parallel frustum is
shifted (off axis) so that the point at which both cameras aimed stays in the middle, and its scale there stays as it
was. A plane through that point, parallel to the base, then has no parallax; `align_pair` takes it to any other plane.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.display import disparity_arcmin, mm_from_px, visual_angle_deg
from documents.arrays import Floats
from documents.text import JsonResult
from stimuli.align.disparity import Viewing
from stimuli.align.homography import common_part, mapped
from stimuli.align.planes import light_plane, same_size
from stimuli.align.warping import warp
from stimuli.errors import StimulusError
from stimuli.pictures.stereo_image import Eye, StereoImage, XYZImage

Corners = tuple[float, float, float, float]
MOST_DEG = 45.0


@dataclass(frozen=True, slots=True)
class Keystone(JsonResult):
    """The disparities that the turned cameras gave the picture's corners: top left, top right, bottom left and right.

    The right eye's place minus the left eye's, of points on the plane at which the cameras aimed: without the turn, all
    are 0. Minutes of arc are known with a `Viewing`, else None.
    """

    vertical_px: Corners
    horizontal_px: Corners
    vertical_arcmin: Corners | None = None
    horizontal_arcmin: Corners | None = None
    json_optional: ClassVar = ("vertical_arcmin", "horizontal_arcmin")


@dataclass(frozen=True, eq=False, slots=True)
class RectifiedPair:
    """A pair as parallel cameras would have taken it, cropped to what both saw, and the keystone that was undone.

    ``crop`` is the part kept: first column, first row, column and row after the last.
    """

    left: XYZImage
    right: XYZImage
    keystone: Keystone
    crop: tuple[int, int, int, int]
    steps: tuple[Mapping[str, Any], ...]

    @property
    def stereo(self) -> StereoImage:
        """The pair as a picture for two eyes."""
        return StereoImage(self.left, self.right)


def focal_px(width_px: int, field_of_view_deg: float) -> float:
    """Return the focal length, in pixels, of a picture ``width_px`` wide that spans ``field_of_view_deg`` across.

    Parameters
    ----------
    width_px
        The width of the picture, in pixels.
    field_of_view_deg
        The angle that the picture spans across, above 0 and below 180 degrees.

    Returns
    -------
    float
        The focal length in pixels.

    Examples
    --------
    >>> round(focal_px(2000, 90.0), 6)
    1000.0
    """
    if not 0.0 < field_of_view_deg < 180.0:
        raise StimulusError.of(f"field_of_view_deg is {field_of_view_deg}", "give an angle above 0 and below 180")
    return float(width_px / 2.0 / np.tan(np.radians(field_of_view_deg) / 2.0))


def toe_in_homography(eye: Eye, toe_in_deg: float, focal_length_px: float, size_px: tuple[int, int]) -> Floats:
    """Return the homography (3, 3) from the parallel camera's picture to that of the camera of ``eye``, turned inwards.

    The principal point is the middle of a picture of ``size_px``, across and down.
    """
    angle = np.radians(toe_in_deg) * (1.0 if eye == "left" else -1.0)
    middle = ((size_px[0] - 1) / 2.0, (size_px[1] - 1) / 2.0)
    scale = focal_length_px * np.cos(angle)
    turned = np.array([[np.cos(angle), 0.0, -np.sin(angle)], [0.0, 1.0, 0.0], [np.sin(angle), 0.0, np.cos(angle)]])
    taken = np.array([[focal_length_px, 0.0, middle[0]], [0.0, focal_length_px, middle[1]], [0.0, 0.0, 1.0]])
    parallel = np.array([[scale, 0.0, middle[0] - scale * np.tan(angle)], [0.0, scale, middle[1]], [0.0, 0.0, 1.0]])
    homography = taken @ turned @ np.linalg.inv(parallel)
    return np.asarray(homography / homography[2, 2])


def keystone(
    toe_in_deg: float, focal_length_px: float, size_px: tuple[int, int], viewing: Viewing | None = None
) -> Keystone:
    """Return the disparities that cameras turned inwards by ``toe_in_deg`` each give the corners of ``size_px``."""
    _check(toe_in_deg, focal_length_px)
    right, bottom = size_px[0] - 1.0, size_px[1] - 1.0
    corners = np.array([[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]])
    left_places, right_places = (
        mapped(toe_in_homography(eye, toe_in_deg, focal_length_px, size_px), corners) for eye in ("left", "right")
    )
    across, down = (right_places - left_places).T
    if viewing is None:
        return Keystone(_four(down), _four(across))
    pitch, distance, eyes = viewing.pixel_pitch_mm, viewing.distance_mm, viewing.interpupillary_distance_mm
    return Keystone(
        _four(down),
        _four(across),
        _four(60.0 * visual_angle_deg(mm_from_px(down, pitch), distance)),
        _four(disparity_arcmin(across, pitch, distance, eyes)),
    )


def rectify_toe_in(
    left: NDArray[Any],
    right: NDArray[Any],
    toe_in_deg: float,
    focal_length_px: float,
    *,
    viewing: Viewing | None = None,
) -> RectifiedPair:
    """Return a pair, linear XYZ or RGB (height, width, 3), as parallel cameras would have taken it.

    Parameters
    ----------
    left, right
        The views as the turned cameras took them, linear XYZ or RGB in any unit, of one shape (height, width, 3).
    toe_in_deg
        How far each camera is turned inwards: half of the angle between them, from 0 to below 45 degrees.
    focal_length_px
        Of both cameras, in pixels; `focal_px` gives it for a field of view.
    viewing
        Pixel pitch, distance and eyes, with which the keystone is also known in minutes of arc.

    Returns
    -------
    RectifiedPair
        Both views, float32, cropped to what both saw, and the keystone that was undone.

    Raises
    ------
    StimulusError
        If the sizes differ, a value is NaN, the angle or the focal length cannot be, or nothing common is left.

    Examples
    --------
    >>> light = np.full((200, 300, 3), 5.0, np.float32)
    >>> pair = rectify_toe_in(light, light, toe_in_deg=3.0, focal_length_px=focal_px(300, 40.0))
    >>> pair.left.shape == pair.right.shape, [round(corner) for corner in pair.keystone.vertical_px]
    (True, [4, -4, -4, 4])
    """
    _check(toe_in_deg, focal_length_px)
    for view, name in ((left, "left"), (right, "right")):
        if light_plane(view, None, name).ndim != 2 or view.ndim != 3:
            raise StimulusError.of(f"the {name} picture has one channel", "give (height, width, 3), XYZ or RGB")
    same_size(left, right, ("left", "right"))
    height, width = left.shape[:2]
    eyes: tuple[Eye, Eye] = ("left", "right")
    homographies = [toe_in_homography(eye, toe_in_deg, focal_length_px, (width, height)) for eye in eyes]
    crop = common_part(homographies, width, height, "check toe_in_deg and the focal length")
    moved = np.array([[1.0, 0.0, crop[0]], [0.0, 1.0, crop[1]], [0.0, 0.0, 1.0]])
    size = (crop[2] - crop[0], crop[3] - crop[1])
    warped = [
        warp(np.asarray(view, dtype=np.float32), homography @ moved, size)
        for view, homography in zip((left, right), homographies, strict=True)
    ]
    undone = keystone(toe_in_deg, focal_length_px, (width, height), viewing)
    step = {
        "step": "rectify_toe_in",
        "toe_in_deg": toe_in_deg,
        "focal_length_px": focal_length_px,
        "keystone": undone.to_json(),
        "crop": list(crop),
        "negative_px_set_to_0": {eye: view.negative_px for eye, view in zip(eyes, warped, strict=True)},
    }
    return RectifiedPair(warped[0].picture, warped[1].picture, undone, crop, (step,))


def _check(toe_in_deg: float, focal_length_px: float) -> None:
    if not 0.0 <= toe_in_deg < MOST_DEG:
        raise StimulusError.of(
            f"toe_in_deg is {toe_in_deg}", f"the angle of each camera, from 0 to below {MOST_DEG:g} degrees"
        )
    if not (np.isfinite(focal_length_px) and focal_length_px > 0):
        raise StimulusError.of(f"focal_length_px is {focal_length_px}", "give a finite number above 0, in pixels")


def _four(values: Floats) -> Corners:
    first, second, third, fourth = (float(value) for value in values)
    return first, second, third, fourth
