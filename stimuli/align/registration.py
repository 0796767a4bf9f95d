"""Where one picture lies against another: the shift between them, with its uncertainty.

The shift is found on textures in two stages: whole pixels by phase correlation, which also says whether the pictures
have anything in common, then a fraction by least squares. Pictures of more than four million pixels are averaged down
for the first stage.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents.arrays import Floats32
from documents.text import JsonResult
from stimuli.align.phase import LEAST_AGREEMENT, Peak, agreement, correlation, find_peak, hann
from stimuli.align.planes import LOCAL_MEAN_PX, Region, binned, checked_region, is_flat, light_plane, same_size, texture
from stimuli.align.subpixel import MARGIN_PX, MOST_PIXELS, ShiftFit, refine
from stimuli.errors import StimulusError

# Accepted by chance less than once in a million pairs that have nothing in common.
FALSE_ALARM = 1e-6
MOST_RIVAL_SHARE = 0.8
_ELSE = "give the shift or a bound for it, or mark points, or choose a region with texture"


@dataclass(frozen=True, slots=True)
class Registration(JsonResult):
    """Where ``moving`` lies against ``reference``.

    ``shift_px`` (across, down) is a thing's place in the moving picture minus its place in the reference, with
    ``standard_error_px``. ``correlation`` is that of the two textures once the shift is undone, at most 1.
    ``peak_height`` is the phase correlation's peak in standard deviations of its floor, ``false_alarm`` the chance that
    pictures with nothing in common reach it, ``rival_share`` the next peak's height as a share of it.
    ``homography`` (3, 3) takes a place of the reference to the moving picture, where four corners were given: the shift
    is then what was left after it.
    """

    shift_px: tuple[float, float]
    standard_error_px: tuple[float, float]
    correlation: float
    peak_height: float
    false_alarm: float
    rival_share: float
    homography: tuple[tuple[float, float, float], ...] | None = None
    json_optional: ClassVar = ("homography",)


def register(
    reference: NDArray[Any],
    moving: NDArray[Any],
    *,
    luminance_weights: ArrayLike | None = None,
    region: Region | None = None,
    most_px: tuple[int, int] | None = None,
    corners: tuple[ArrayLike, ArrayLike] | None = None,
    false_alarm: float = FALSE_ALARM,
) -> Registration:
    """Return where ``moving`` lies against ``reference``, to a fraction of a pixel.

    Parameters
    ----------
    reference, moving
        Linear light, (height, width) or (height, width, 3).
    luminance_weights
        (3,): what the channels weigh; without it, the second channel is taken, which is Y of XYZ.
    region
        The part of the reference to look for: first column, first row, column and row after the last.
    most_px
        The largest shift to look for, across and down; without it, nearly half of the picture.
    corners
        Four or more places (n, 2) in the reference and the same places in the moving picture: the moving picture is
        first brought onto the reference by the homography through them. The two may then differ in size.
    false_alarm
        The probability of accepting two pictures that have nothing in common.

    Returns
    -------
    Registration
        The shift in pixels, its standard error, and how certain it is.

    Raises
    ------
    StimulusError
        If a picture is flat, too small, or holds NaN; if the sizes differ; if the two have nothing in common, or repeat
        so that several shifts fit as well; if there is no shift to a fraction of a pixel.

    Examples
    --------
    >>> texture = np.random.default_rng(1).uniform(1, 20, (128, 136))
    >>> registration = register(texture[:, :128], texture[:, 5:133])
    >>> round(registration.shift_px[0], 3)
    -5.0
    """
    reference_plane = light_plane(reference, luminance_weights, "reference")
    moving_plane = light_plane(moving, luminance_weights, "moving")
    homography = None
    if corners is not None:
        from stimuli.align.homography import homography_from_points
        from stimuli.align.warping import warp

        homography = homography_from_points(*corners)
        moving_plane = warp(
            moving_plane[:, :, None], homography, (reference_plane.shape[1], reference_plane.shape[0])
        ).picture[:, :, 0]
    same_size(reference_plane, moving_plane, ("reference", "moving"))
    registration = register_planes(
        reference_plane, moving_plane, region=region, most_px=most_px, false_alarm=false_alarm
    )
    if homography is None:
        return registration
    return replace(registration, homography=tuple((float(row[0]), float(row[1]), float(row[2])) for row in homography))


def register_planes(
    reference: Floats32,
    moving: Floats32,
    *,
    region: Region | None = None,
    most_px: tuple[int, int] | None = None,
    false_alarm: float = FALSE_ALARM,
    names: tuple[str, str] = ("reference", "moving"),
) -> Registration:
    """Do what `register` does for planes of light (height, width), float32, of one size, checked already."""
    place = checked_region(region, reference.shape)
    reference_texture, moving_texture = texture(reference), texture(moving)
    part = (slice(place[1], place[3]), slice(place[0], place[2]))
    for fine, light, name in ((reference_texture[part], reference[part], names[0]), (moving_texture, moving, names[1])):
        if is_flat(fine, light):
            raise StimulusError.of(f"the {name} picture is flat: there is nothing in it to align by", _ELSE)
    peak, bin_px = _coarse(reference_texture, moving_texture, place, most_px)
    if peak.false_alarm > false_alarm:
        raise StimulusError.of(
            f"the {names[0]} and the {names[1]} picture have nothing in common that rises above noise: the best shift "
            f"stands {peak.height:.1f} standard deviations high, which {peak.false_alarm:.2g} of noise pictures reach",
            _ELSE,
        )
    start = _start(reference_texture, moving_texture, place, peak, bin_px)
    agreed, needed = _agreement(reference_texture, moving_texture, place, start)
    if agreed < needed:
        raise StimulusError.of(
            f"the {names[0]} and the {names[1]} picture agree in too few places: at the best shift, "
            f"({start[0]:.4g}, {start[1]:.4g}) px, their agreement is {agreed:.1f} and must be {needed:.1f}",
            _ELSE,
        )
    if peak.rival_share > MOST_RIVAL_SHARE and peak.rival_false_alarm <= false_alarm:
        shifts = " and ".join(f"({bin_px * at[0]}, {bin_px * at[1]})" for at in (peak.shift_px, peak.rival_px))
        raise StimulusError.of(f"the pictures repeat: shifts of {shifts} px fit nearly as well", _ELSE)
    fit = refine_within(reference_texture, moving_texture, place, start)
    if not fit.converged:
        raise StimulusError.of(
            f"no shift to a fraction of a pixel was found near ({start[0]:.4g}, {start[1]:.4g}) px",
            "give the shift, or mark points, or choose a region that lies in one plane",
        )
    shift = (fit.shift_px[0] + 0.0, fit.shift_px[1] + 0.0)
    return Registration(shift, fit.standard_error_px, fit.correlation, peak.height, peak.false_alarm, peak.rival_share)


def refine_within(
    reference: Floats32, moving: Floats32, place: Region, start_px: tuple[float, float], most_pixels: int = MOST_PIXELS
) -> ShiftFit:
    """Refine the shift of two textures (height, width) from ``start_px`` on, by what lies in ``place`` alone.

    Interpolation looks a few pixels beyond ``place``, where there are any. Along the pictures' own edges, where the
    local mean knew one side only, sixteen pixels are left out, or an eighth of a small picture.
    """
    height, width = reference.shape
    across, down = (round(component) for component in start_px)
    left, right = _reach(place[0], place[2], across, width)
    top, bottom = _reach(place[1], place[3], down, height)
    fit = refine(
        reference[top : max(top, bottom), left : max(left, right)],
        moving[top + down : max(top, bottom) + down, left + across : max(left, right) + across],
        (start_px[0] - across, start_px[1] - down),
        most_pixels,
    )
    return replace(fit, shift_px=(fit.shift_px[0] + across, fit.shift_px[1] + down))


def _reach(first: int, last: int, shift: int, length: int) -> tuple[int, int]:
    """Return what of one axis to refine by: ``first`` to ``last``, cut where the pictures end, and the margins."""
    edge = min(LOCAL_MEAN_PX // 2, length // 8)
    begin, end = max(0, -shift), min(length, length - shift)
    return (
        max(begin, max(first, begin + edge) - MARGIN_PX),
        min(end, min(last, end - edge) + MARGIN_PX),
    )


def _agreement(
    reference: Floats32, moving: Floats32, place: Region, start_px: tuple[float, float]
) -> tuple[float, float]:
    """Return `agreement` within ``place`` alone."""
    across, down = (round(at) for at in start_px)
    left, right = max(place[0], -across), min(place[2], reference.shape[1] - across)
    top, bottom = max(place[1], -down), min(place[3], reference.shape[0] - down)
    if min(right - left, bottom - top) < 1:
        return 0.0, LEAST_AGREEMENT
    return agreement(
        reference[top:bottom, left:right], moving[top + down : bottom + down, left + across : right + across], (0, 0)
    )


def _coarse(reference: Floats32, moving: Floats32, place: Region, most_px: tuple[int, int] | None) -> tuple[Peak, int]:
    """Return the phase correlation's peak, in bins, and how many pixels a bin is."""
    bin_px = int(np.ceil(np.sqrt(reference.size / MOST_PIXELS)))
    height, width = (length // bin_px for length in reference.shape)
    left, top, right, bottom = (round(edge / bin_px) for edge in place)
    right, bottom = min(right, width), min(bottom, height)
    whole = (right - left, bottom - top) == (width, height)
    # A part may lie anywhere in the moving picture, whose middle must then not weigh more than the rest.
    across, down = (hann(width), hann(height)) if whole else (_tapered(width), _tapered(height))
    second = binned(moving, bin_px) * across * down[:, None]
    first = np.zeros((height, width), dtype=np.float32)
    first[top:bottom, left:right] = binned(reference, bin_px)[top:bottom, left:right]
    first[top:bottom, left:right] *= hann(right - left) * hann(bottom - top)[:, None]
    reach = (width, height) if most_px is None else (-(-most_px[0] // bin_px), -(-most_px[1] // bin_px))
    return find_peak(correlation(first, second), reach), bin_px


def _start(reference: Floats32, moving: Floats32, place: Region, peak: Peak, bin_px: int) -> tuple[float, float]:
    """Return where to look for the fraction: the peak, brought within less than a pixel where pixels were binned."""
    if bin_px == 1:
        return float(peak.shift_px[0]), float(peak.shift_px[1])
    left, top, right, bottom = (round(edge / bin_px) for edge in place)
    small = binned(reference, bin_px), binned(moving, bin_px)
    inside = (left, top, min(right, small[0].shape[1]), min(bottom, small[0].shape[0]))
    fit = refine_within(*small, inside, (float(peak.shift_px[0]), float(peak.shift_px[1])))
    return fit.shift_px[0] * bin_px, fit.shift_px[1] * bin_px


def _tapered(length: int) -> Floats32:
    """Return ones (length,) that fall to 0 over a sixteenth of the length at either end."""
    edge = max(1, length // 16)
    taper = np.ones(length, dtype=np.float32)
    taper[:edge] = hann(2 * edge)[:edge]
    taper[-edge:] = taper[:edge][::-1]
    return taper
