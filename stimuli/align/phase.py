"""The shift at which two textures agree, from the phases of their spectra, and whether they agree at all.

Phase correlation [Kuglin1975]: the product of one spectrum with the other's conjugate, each frequency brought to nearly
the same weight, has a peak at the shift. Frequencies that hold less than the median do not carry the texture but its
noise, and weigh less. Textures that have nothing in common have phases at random: the surface is then Gaussian noise,
whose floor is measured on the surface itself, away from the peak. The chance that the highest of its cells rises as far
as the peak did is the false alarm by which a shift is accepted or refused.

Two fields of sparkles that have nothing in common still match where the brightest of one is laid onto the brightest of
the other, and a phase correlation, which expects noise of many small parts, takes that for a shift. So `agreement` asks
each square of eight pixels on its own: its correlation, drawn to 0 where it holds next to nothing, counts once however
bright it is. Their sum over the root of their squares' sum is about normal where squares agree no oftener than they
disagree, and rises to the root of their number where all agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from documents.arrays import Floats32

# Cells about a peak that belong to it: a blurred texture has a broad one.
_PEAK_PX = 6
# Frequencies that hold less than this share of the mean hold what the window leaks, in the same phase in any picture.
_LEAST_SHARE = 0.01

SIDE_PX = 8
# Set by measurement: the highest of all shifts of sparse fields with nothing in common (tests/stress).
LEAST_AGREEMENT = 7.5
LEAST_SHARE = 0.55
_FINE_PX = 9
_DRAW_MEDIAN, _DRAW_MEAN = 3.0, 0.003


@dataclass(frozen=True, slots=True)
class Peak:
    """A peak of a phase correlation.

    ``shift_px`` is whole, across and down; ``height`` is in standard deviations of the floor; ``false_alarm`` is the
    chance that noise alone rises as high anywhere. ``rival_px`` and ``rival_share`` are the place and the height of the
    next peak, the latter as a share of this one, and ``rival_false_alarm`` its chance.
    """

    shift_px: tuple[int, int]
    height: float
    false_alarm: float
    rival_px: tuple[int, int]
    rival_share: float
    rival_false_alarm: float


def hann(length: int) -> Floats32:
    """Return Hann's window (length,), above 0 at both ends."""
    return np.sin(np.pi * (np.arange(length) + 0.5) / length, dtype=np.float64).astype(np.float32) ** 2


def correlation(reference: Floats32, moving: Floats32) -> Floats32:
    """Return the phase correlation of windowed textures (..., height, width), no shift in its first cell."""
    from scipy.fft import irfft2, rfft2

    product = np.conj(rfft2(reference)) * rfft2(moving)
    power = np.abs(product)
    typical = np.median(power, axis=(-2, -1), keepdims=True)
    typical = typical + _LEAST_SHARE * power.mean(axis=(-2, -1), keepdims=True)
    product /= np.maximum(power + typical, np.finfo(np.float32).tiny)
    return np.asarray(irfft2(product, s=reference.shape[-2:]), dtype=np.float32)


def find_peak(surface: Floats32, most_px: tuple[int, int]) -> Peak:
    """Return the highest peak of `correlation`'s ``surface`` (height, width) within ``most_px``, across and down."""
    height, width = surface.shape
    reach = (min(most_px[0], (width - 1) // 2), min(most_px[1], (height - 1) // 2))
    rows, columns = np.arange(-reach[1], reach[1] + 1), np.arange(-reach[0], reach[0] + 1)
    near = surface[np.ix_(rows % height, columns % width)].copy()
    cells = near.size
    # The floor is that of the whole surface: a narrow search would leave too few cells to know it by.
    row, column = np.unravel_index(int(near.argmax()), near.shape)
    peak = float(near[row, column])
    floor = _floor(surface, int(rows[row]), int(columns[column]))
    _blank(near, int(row), int(column))
    rival_row, rival_column = np.unravel_index(int(near.argmax()), near.shape)
    rival = float(near[rival_row, rival_column])
    heights = [height_at / floor if floor > 0 else 0.0 for height_at in (peak, rival)]
    # The tail of the normal distribution.
    alarms = [min(1.0, cells * 0.5 * math.erfc(height_at / math.sqrt(2.0))) for height_at in heights]
    return Peak(
        shift_px=(int(columns[column]), int(rows[row])),
        height=heights[0],
        false_alarm=alarms[0],
        rival_px=(int(columns[rival_column]), int(rows[rival_row])),
        rival_share=max(0.0, rival / peak) if peak > 0 and np.isfinite(rival) else 0.0,
        rival_false_alarm=alarms[1] if np.isfinite(rival) else 1.0,
    )


def _floor(surface: Floats32, row: int, column: int) -> float:
    """Return the root of the mean square of ``surface`` beyond the cells about its peak: near by or everywhere.

    The greater of the two is taken. Windows overlap most where there is no shift, and the noise is highest there.
    """
    height, width = surface.shape
    size = min(_PEAK_PX, height // 8, width // 8)
    about = _around(surface, row, column, size, size)
    near = _around(surface, row, column, max(height // 8, size + 2), max(width // 8, size + 2))
    square, cells = float(np.vdot(about, about)), about.size
    floors = [(float(np.vdot(part, part)) - square) / (part.size - cells) for part in (surface, near)]
    return float(np.sqrt(max(0.0, *floors)))


def _around(surface: Floats32, row: int, column: int, rows: int, columns: int) -> Floats32:
    height, width = surface.shape
    down, across = np.arange(row - rows, row + rows + 1), np.arange(column - columns, column + columns + 1)
    return surface[np.ix_(down % height, across % width)]


def _blank(near: Floats32, row: int, column: int) -> None:
    top, left = max(0, row - _PEAK_PX), max(0, column - _PEAK_PX)
    near[top : row + _PEAK_PX + 1, left : column + _PEAK_PX + 1] = -np.inf


def agreement(reference: Floats32, moving: Floats32, shift_px: tuple[int, int]) -> tuple[float, float]:
    """Return how far squares of two textures (height, width) agree at a whole shift, and how far they must."""
    height, width = reference.shape
    across, down = shift_px
    left, right = max(0, -across), min(width, width - across)
    top, bottom = max(0, -down), min(height, height - down)
    if min(right - left, bottom - top) < SIDE_PX:
        return 0.0, LEAST_AGREEMENT
    reference_squares = _squares(reference[top:bottom, left:right])
    moving_squares = _squares(moving[top + down : bottom + down, left + across : right + across])
    power = np.sqrt(
        np.einsum("ijkl,ijkl->ik", reference_squares, reference_squares)
        * np.einsum("ijkl,ijkl->ik", moving_squares, moving_squares)
    )
    typical = _DRAW_MEDIAN * float(np.median(power)) + _DRAW_MEAN * float(power.mean()) + np.finfo(np.float32).tiny
    each = np.einsum("ijkl,ijkl->ik", reference_squares, moving_squares) / (power + typical)
    size = float(np.sqrt(np.sum(each**2)))
    needed = min(LEAST_AGREEMENT, LEAST_SHARE * float(np.sqrt(each.size)))
    return (float(each.sum()) / size if size > 0 else 0.0), needed


def _squares(plane: Floats32) -> Floats32:
    """Return squares (rows, SIDE_PX, columns, SIDE_PX) of the finest of ``plane``, each less its mean.

    Only the finest: what is left of a local mean about one sparkle would make its neighbours agree too.
    """
    from scipy.ndimage import uniform_filter

    plane = plane - uniform_filter(plane, _FINE_PX, mode="nearest")
    height, width = (length // SIDE_PX for length in plane.shape)
    squares = plane[: height * SIDE_PX, : width * SIDE_PX].reshape(height, SIDE_PX, width, SIDE_PX)
    return np.asarray(squares - squares.mean(axis=(1, 3), keepdims=True), dtype=np.float32)
