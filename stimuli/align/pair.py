"""A pair from parallel cameras, brought to zero parallax at the sample's plane and cropped to what both views show.

Section 4.4.2 of the thesis. The whole pixels of the shift are a matter of where each view is cropped: those pixels are
copies. What is left, half a pixel at most, is shared: each view is interpolated by half of it, so that neither eye's
picture is softer than the other's. Less than a hundredth of a pixel is let be.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stimuli.align.disparity import BLOCK_PX, DisparityReport, Viewing, measure_disparity
from stimuli.align.homography import shift_from_points
from stimuli.align.interpolate import Interpolation, cut, reach_px, transfer
from stimuli.align.planes import LEAST_SIDE_PX, Region, light_plane, same_size
from stimuli.align.registration import register_planes
from stimuli.errors import StimulusError
from stimuli.pictures.stereo_image import Eye, StereoImage, XYZImage

Method = Literal["correlation", "points", "offset"]
Step = Mapping[str, Any]

LEAST_FRACTION_PX = 0.01


@dataclass(frozen=True, eq=False, slots=True)
class PairAlignment:
    """An aligned pair: ``left`` and ``right``, float32 (height, width, 3), and what was done to them.

    ``shift_px`` and ``vertical_px`` are where the plane lay in the right view minus where it lay in the left one.
    ``residual_px`` is the uncertainty of the shift: with marked points the root of their mean squared distance, by
    correlation its standard error, for a given offset None. ``crop`` says, for each eye, where its part begins (across,
    down, in pixels of the view, a fraction where it was interpolated) and its size (width, height).
    """

    left: XYZImage
    right: XYZImage
    shift_px: float
    vertical_px: float
    residual_px: float | None
    crop: Mapping[Eye, tuple[float, float, int, int]]
    disparity: DisparityReport
    steps: tuple[Step, ...]

    @property
    def stereo(self) -> StereoImage:
        """The pair as a picture for two eyes."""
        return StereoImage(self.left, self.right)

    def flat(self, eye: Eye) -> StereoImage:
        """Return the flat version: what ``eye`` sees, for both."""
        return StereoImage.flat(self.left if eye == "left" else self.right)

    def flat_from_centre(
        self,
        centre: XYZImage,
        left: XYZImage,
    ) -> tuple[StereoImage, Step]:
        """Return the flat version from a ``centre`` view, cropped to the same part of the plane, and its step.

        ``left`` is the left view as it was before `align_pair`: the centre view is registered against it. Where the
        part ends with the centre view, its last pixels are interpolated from the edge.

        Raises
        ------
        StimulusError
            As `register`, or if the part reaches beyond the centre view.
        """
        planes = [light_plane(view, None, name) for view, name in ((left, "left"), (centre, "centre"))]
        same_size(planes[0], planes[1], ("left", "centre"))
        x, y, width, height = self.crop["left"]
        registration = register_planes(planes[0], planes[1], names=("left", "centre"))
        start = (_tidy(x + registration.shift_px[0]), _tidy(y + registration.shift_px[1]))
        if min(start) < 0 or start[0] + width > centre.shape[1] or start[1] + height > centre.shape[0]:
            raise StimulusError.of(
                f"the part that both eyes see begins at {start} px in the centre view, and reaches beyond it",
                "check the shift, or leave the centre view out and name an eye for the flat version",
            )
        picture, negative = cut(np.asarray(centre, dtype=np.float32), start, (width, height), "sinc")
        step = {
            "step": "flat",
            "view": "center",
            "registration": registration.to_json(),
            "crop": {"start_px": list(start), "size_px": [width, height]},
            "negative_px_set_to_0": negative,
        }
        return StereoImage.flat(picture), step


def align_pair(
    left: NDArray[Any],
    right: NDArray[Any],
    method: Method = "correlation",
    *,
    offset_px: tuple[float, float] | None = None,
    points: tuple[ArrayLike, ArrayLike] | None = None,
    region: Region | None = None,
    most_px: tuple[int, int] | None = None,
    luminance_weights: ArrayLike | None = None,
    correct_vertical: bool = True,
    whole_pixels: bool = False,
    interpolation: Interpolation = "sinc",
    block_px: int = BLOCK_PX,
    viewing: Viewing | None = None,
) -> PairAlignment:
    """Return the two views of a sample, aligned so that its plane has zero parallax, and cropped to what both show.

    Parameters
    ----------
    left, right
        Linear light, (height, width, 3): XYZ in cd/m², or RGB.
    method
        ``offset``: by ``offset_px``. ``points``: by ``points``. ``correlation``: by phase correlation of ``region``, as
        `register` does, no further than ``most_px``.
    offset_px
        The plane's place in the right view minus that in the left one, across and down, in pixels.
    points
        Places (n, 2) on the plane in the left view, and the same in the right one: x and y in pixels.
    region
        The part of the left view that lies in the plane: first column, first row, column and row after the last.
        Without it the whole view is taken.
    most_px
        The largest shift to look for, across and down.
    luminance_weights
        (3,): what channels weigh where textures are compared; without it, Y of XYZ.
    correct_vertical
        Whether the vertical shift is undone too. It is measured in any case.
    whole_pixels
        Whether to stop at whole pixels, so that nothing is interpolated; up to half a pixel of parallax is then left.
    interpolation
        ``sinc``, ``cubic`` or ``linear``, for the fraction of a pixel.
    block_px
        The side of the squares whose disparities are measured.
    viewing
        How the pair is seen, so that disparities are reported in millimetres and minutes of arc too.

    Returns
    -------
    PairAlignment
        Both views, the shift that was undone, its uncertainty, the disparities that are left, and the steps.

    Raises
    ------
    StimulusError
        If the sizes differ, a value is NaN, a picture is too small, what the method needs is missing, the plane cannot
        be found (see `register`), or too little is common to both views.

    Examples
    --------
    >>> texture = np.random.default_rng(1).uniform(1, 20, (160, 208, 3)).astype(np.float32)
    >>> aligned = align_pair(texture[:, :200], texture[:, 6:206])
    >>> round(aligned.shift_px, 3), aligned.left.shape
    (-6.0, (160, 194, 3))
    >>> bool((aligned.left == aligned.right).all())
    True
    """
    reach_px(interpolation)
    planes = light_plane(left, luminance_weights, "left"), light_plane(right, luminance_weights, "right")
    if left.ndim != 3 or right.ndim != 3:
        raise StimulusError.of("a pair to align has one channel", "give (height, width, 3), XYZ or RGB")
    same_size(left, right, ("left", "right"))
    details: dict[str, Any] = {}
    residual: float | None = None
    if method == "offset":
        shift = _given(offset_px)
    elif method == "points":
        if points is None:
            raise StimulusError.of("no points are given", "mark the same places of the plane in both views")
        marked = shift_from_points(*points, planes[0].shape)
        shift, residual = marked.shift_px, marked.residual_px
        details = {name: getattr(marked, name) for name in ("pairs", "residual_px", "worst_px", "worst_pair")}
    elif method == "correlation":
        registration = register_planes(planes[0], planes[1], region=region, most_px=most_px, names=("left", "right"))
        shift, residual = registration.shift_px, float(np.hypot(*registration.standard_error_px))
        details = {"region": None if region is None else list(region), "registration": registration.to_json()}
    else:
        raise StimulusError.of(f"method is {method!r}", "one of " + ", ".join(map(repr, get_args(Method))))
    del planes
    undone = (shift[0], shift[1] if correct_vertical else 0.0)
    starts, size, fraction = _crops(undone, left.shape, whole_pixels, interpolation)
    pictures: list[XYZImage] = []
    negative: dict[Eye, int] = {}
    views: tuple[tuple[NDArray[Any], Eye], ...] = ((left, "left"), (right, "right"))
    for view, eye in views:
        picture, below = cut(np.asarray(view, dtype=np.float32), starts[eye], size, interpolation)
        pictures.append(picture)
        negative[eye] = below
    disparity = measure_disparity(
        pictures[0],
        pictures[1],
        luminance_weights=luminance_weights,
        block_px=min(block_px, *size),
        viewing=viewing,
    )
    crop: dict[Eye, tuple[float, float, int, int]] = {
        "left": (*starts["left"], *size),
        "right": (*starts["right"], *size),
    }
    steps = (
        {"step": "align", "method": method, "shift_px": shift[0], "vertical_px": shift[1], **details},
        {
            "step": "crop",
            "size_px": list(size),
            "start_px": {eye: list(start) for eye, start in starts.items()},
            "vertical_corrected": correct_vertical,
        },
        _interpolated(fraction, interpolation, negative),
        {"step": "disparity", **disparity.to_json()},
    )
    return PairAlignment(pictures[0], pictures[1], shift[0], shift[1], residual, crop, disparity, steps)


def _crops(
    shift: tuple[float, float], shape: tuple[int, ...], whole_pixels: bool, interpolation: Interpolation
) -> tuple[dict[Eye, tuple[float, float]], tuple[int, int], tuple[float, float]]:
    """Return where each eye's part begins, its size (across, down), and the fraction that is interpolated."""
    begins: list[tuple[float, float]] = []
    size, fractions = [], []
    for amount, length in ((shift[0], shape[1]), (shift[1], shape[0])):
        whole = int(np.round(amount))
        fraction = 0.0 if whole_pixels else _tidy(amount - whole)
        # Interpolation beyond the edge would be a guess.
        margin = reach_px(interpolation) if fraction else 0
        first = max(0, -whole) + margin
        common = length - abs(whole) - 2 * margin
        if common < LEAST_SIDE_PX:
            raise StimulusError.of(
                f"a shift of {amount:g} px leaves {max(0, common)} of {length} pixels common to both views",
                f"at least {LEAST_SIDE_PX} are needed: give another shift",
            )
        begins.append((first - fraction / 2, first + whole + fraction / 2))
        size.append(common)
        fractions.append(fraction)
    starts: dict[Eye, tuple[float, float]] = {
        "left": (begins[0][0], begins[1][0]),
        "right": (begins[0][1], begins[1][1]),
    }
    return starts, (size[0], size[1]), (fractions[0], fractions[1])


def _interpolated(fraction: tuple[float, float], interpolation: Interpolation, negative: Mapping[Eye, int]) -> Step:
    """Return what moving both views by half of ``fraction`` cost: contrast of gratings, and pixels set to 0."""
    if not any(fraction):
        return {"step": "interpolate", "interpolation": None, "moved_px": [0.0, 0.0]}
    return {
        "step": "interpolate",
        "interpolation": interpolation,
        "moved_px": [part / 2 for part in fraction],
        "contrast_kept": {
            f"{cycles} cycles/px": [float(transfer(part / 2, cycles, interpolation)) for part in fraction]
            for cycles in (0.125, 0.25, 0.375)
        },
        "negative_px_set_to_0": dict(negative),
    }


def _given(offset_px: tuple[float, float] | None) -> tuple[float, float]:
    offset = np.asarray(() if offset_px is None else offset_px, dtype=np.float64)
    if offset.shape != (2,) or not np.isfinite(offset).all():
        raise StimulusError.of(f"offset_px is {offset_px}", "give the right view's shift, across and down, in pixels")
    return float(offset[0]), float(offset[1])


def _tidy(value: float) -> float:
    """Return ``value``, or the whole number that it differs from by less than is worth an interpolation."""
    whole = round(value)
    return float(whole) if abs(value - whole) < LEAST_FRACTION_PX else value
