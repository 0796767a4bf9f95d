"""Which view of the photograph each eye of the rendering shows: its own, the other eye's, or both the same.

Four ways are tried: each eye its own view, the eyes exchanged, the left view twice, the right view twice. For each way,
one shift for both eyes is found by phase correlation of both pairs of views at once [Kuglin1975], and both are compared
there by their local contrast, place by place. A way is taken in place of the right one only if views agree better by
more than a margin and by more than chance, from the scatter between places. Views of other flakes agree in no way, and
which eye is which is then not known from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from documents import in_threads
from documents.arrays import Floats, Floats32
from documents.text import JsonResult
from stimuli.align.phase import correlation, find_peak, hann

# The luminance of both eyes, left and right, float32 (height, width) each, in cd/m².
ViewPair = tuple[Floats32, Floats32]
Way = Literal["own", "exchanged", "left twice", "right twice"]

# The photograph's view, 0 for left, that the rendering's left and right eye show.
WAYS: dict[Way, tuple[int, int]] = {
    "own": (0, 1),
    "exchanged": (1, 0),
    "left twice": (0, 0),
    "right twice": (1, 1),
}
# A way must agree by this much more than the right one, and by so many standard errors, and agree by this much at all.
_MARGIN, _MARGIN_Z, _LEAST_AGREEMENT = 0.05, 4.0, 0.2
# And in both eyes as well as the better eye of the right way: else depth is another, and eyes are not exchanged.
_AS_WELL = 0.02
_CELLS = 8
# Squares of the local mean, and the blur that makes a fraction of a pixel count less.
LOCAL_MEAN_PX, _BLUR_SD_PX = 17, 1.0


@dataclass(frozen=True, slots=True)
class EyeIdentity(JsonResult):
    """The ``way`` in which the rendering's eyes show the photograph's views, None where nothing agrees.

    ``agreement`` is the correlation of local contrasts under that way, ``agreement_own`` under the right one,
    ``advantage_z`` their difference in standard errors; ``left`` and ``right`` are the way's agreement in either eye of
    the rendering. ``shift_px`` is how far the rendering lies off, across and down, under the way.
    """

    way: Way | None
    agreement: float
    agreement_own: float
    advantage_z: float
    left: float
    right: float
    shift_px: tuple[float, float]


def identify_eyes(photo: ViewPair, rendering: ViewPair) -> EyeIdentity:
    """Return which views the rendering's eyes show; all are luminances (height, width) of one size, left and right."""
    contrasts = in_threads(local_contrast, (*photo, *rendering))
    first, second = contrasts[:2], contrasts[2:]
    window = np.outer(hann(photo[0].shape[0]), hann(photo[0].shape[1]))
    surfaces = {
        (view, eye): correlation(first[view] * window, second[eye] * window) for view in (0, 1) for eye in (0, 1)
    }
    agreed: dict[Way, _Agreed] = {}
    height, width = photo[0].shape
    for tried, (left, right) in WAYS.items():
        peak = find_peak(surfaces[left, 0] + surfaces[right, 1], (width // 2, height // 2))
        agreed[tried] = _Agreed(
            _cell_sums(first[left], second[0], peak.shift_px),
            _cell_sums(first[right], second[1], peak.shift_px),
            peak.shift_px,
        )
    own = agreed["own"]
    way: Way = max(WAYS, key=lambda one: _agreement(agreed[one].both))
    best = agreed[way]
    apart, error = _difference(best.both, own.both)
    z = apart / error if error > 0 else (math.inf if apart > 0 else 0.0)
    as_well = min(best.each) >= max(own.each) - _AS_WELL
    if way != "own" and not (apart > _MARGIN and z > _MARGIN_Z and as_well):
        way, best, z = "own", own, 0.0
    agreement = _agreement(best.both)
    shift = (float(best.shift_px[0]), float(best.shift_px[1]))
    known = max(best.each) > _LEAST_AGREEMENT
    return EyeIdentity(way if known else None, agreement, _agreement(own.both), z, *best.each, shift)


@dataclass(frozen=True, eq=False, slots=True)
class _Agreed:
    """Sums over cells (3, cells) of either eye under one way, at one shift for both."""

    left: Floats
    right: Floats
    shift_px: tuple[int, int]

    @property
    def both(self) -> Floats:
        return self.left + self.right

    @property
    def each(self) -> tuple[float, float]:
        return _agreement(self.left), _agreement(self.right)


def local_contrast(luminance: Floats32) -> Floats32:
    """Return (Y − m) / (Y + m), blurred, m the mean about each pixel: between −1 and 1, however bright a sparkle is."""
    from scipy.ndimage import gaussian_filter, uniform_filter

    mean = uniform_filter(luminance, min(LOCAL_MEAN_PX, *luminance.shape), mode="nearest")
    both = luminance + mean
    contrast = np.divide(luminance - mean, both, out=np.zeros_like(both), where=both > 0)
    return np.asarray(gaussian_filter(contrast, _BLUR_SD_PX, mode="nearest"), dtype=np.float32)


def _cell_sums(one: Floats32, other: Floats32, shift_px: tuple[int, int]) -> Floats:
    """Return the sums of products and squares (3, cells) of one and of the other, which lies ``shift_px`` off.

    Cells are of the whole picture; those beyond the other's edge are empty.
    """
    across, down = shift_px
    height, width = one.shape
    top, bottom = max(0, -down), min(height, height - down)
    left, right = max(0, -across), min(width, width - across)
    moved = np.zeros_like(one)
    moved[top:bottom, left:right] = other[top + down : bottom + down, left + across : right + across]
    kept = np.zeros_like(one)
    kept[top:bottom, left:right] = one[top:bottom, left:right]
    rows, columns = (np.linspace(0, length, _CELLS + 1).astype(int)[:-1] for length in (height, width))
    sums = []
    for product in (kept * moved, kept * kept, moved * moved):
        by_row = np.add.reduceat(product.astype(np.float64), rows, axis=0)
        sums.append(np.add.reduceat(by_row, columns, axis=1).ravel())
    return np.asarray(sums)


def _agreement(sums: Floats) -> float:
    product, one, other = sums.sum(axis=1)
    return float(product / np.sqrt(one * other)) if one * other > 0 else 0.0


def _difference(sums: Floats, own: Floats) -> tuple[float, float]:
    """Return by how much one way agrees better than the right one, and its standard error by the jackknife."""
    count = sums.shape[1]
    left_out = np.array(
        [_agreement(np.delete(sums, cell, axis=1)) - _agreement(np.delete(own, cell, axis=1)) for cell in range(count)]
    )
    error = np.sqrt((count - 1) / count * np.sum((left_out - left_out.mean()) ** 2))
    return _agreement(sums) - _agreement(own), float(error)
