"""Disparities of both pairs in the same squares: where they lie, how deep they reach, and how one view is turned.

Scene depth cancels in the difference at one place. Sparse sparkles are now and then laid onto others: a square whose
vertical disparity strays from what roll and size explain is left out.
Errors are by the jackknife over places [Efron1981]: a measure is computed again without each place in both pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from documents.arrays import Floats
from stimuli.align.disparity import FALSE_ALARM, BlockSpread, DisparityReport, measure_disparity
from stimuli.align.phase import correlation, find_peak, hann
from stimuli.align.roll_scale import fit_roll_scale
from stimuli.comparison.eye_identity import ViewPair, local_contrast
from stimuli.pictures.rows import Mask


@dataclass(frozen=True, slots=True)
class EyesPair:
    """One measure of both pairs of views: their values, the rendering's minus the photograph's, and its error."""

    photo: float
    rendering: float
    difference: float
    standard_error: float


def jackknife(rows: Floats, measure: Callable[[Floats], float]) -> tuple[float, float]:
    """Return a measure of rows (n, k) and its standard error by leaving out one row at a time."""
    count = len(rows)
    without = np.array([measure(np.delete(rows, number, axis=0)) for number in range(count)])
    with np.errstate(invalid="ignore"):
        error = np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2))
    return measure(rows), float(error)


def jackknifed(
    photo: Floats, rendering: Floats, measures: Mapping[str, Callable[[Floats], float]]
) -> dict[str, EyesPair]:
    """Return measures of sums over squares (n, k) of both pairs, those that either has, with their errors."""
    totals = photo.sum(axis=0), rendering.sum(axis=0)
    count = len(photo)
    pairs = {}
    for name, measure in measures.items():
        values = [measure(total) for total in totals]
        if np.isnan(values).all():
            continue  # neither picture has what it measures
        without = np.array(
            [measure(totals[1] - rendering[number]) - measure(totals[0] - photo[number]) for number in range(count)]
        )
        error = float(np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2)))
        pairs[name] = EyesPair(values[0], values[1], values[1] - values[0], error)
    return pairs


Place = tuple[float, float]
# The disparity of a square across and down, and the variance of both together.
Disparities = Mapping[Place, tuple[float, float, float]]

# With fewer squares, nothing is known of depth, or of its scale.
LEAST_SQUARES, _LEAST_FOR_SCALE = 5, 10
# Relief is the spread between these percentiles, which are so many standard deviations of a normal law apart.
_RELIEF, _RELIEF_SD = (15.0, 85.0), 2.073
# Squares that stray by more than so many robust standard deviations, and px, were registered wrongly.
_STRAY, _STRAY_PX = 6.0, 1.0


def register_views(views: ViewPair, side: int) -> DisparityReport:
    """Return the disparities of squares of ``side`` pixels of the left view.

    They are found by local contrast: in light, the brightest sparkle of either view would be laid onto that of the
    other. One shift for the whole picture goes before, where it is large, since a square is looked for near its place.
    """
    left, right = map(local_contrast, views)
    height, width = left.shape
    window = np.outer(hann(height), hann(width))
    peak = find_peak(correlation(left * window, right * window), (width // 4, height // 8))
    shift = peak.shift_px[0]
    if abs(shift) < side // 8 or peak.false_alarm > FALSE_ALARM:
        return measure_disparity(left, right, block_px=side)
    moved = np.zeros_like(right)
    here, there = slice(max(0, -shift), width - max(0, shift)), slice(max(0, shift), width + min(0, shift))
    moved[:, here] = right[:, there]
    report = measure_disparity(left, moved, block_px=side)
    if not report.used:
        return report
    disparity = report.disparity_px + [shift, 0]
    return replace(report, disparity_px=disparity, horizontal={"px": BlockSpread.of(disparity[:, 0])})


def kept_squares(report: DisparityReport, counted: Mask) -> Disparities:
    """Return disparities and their variance by the middle of their square, of squares whose middle counts.

    Parallel views have no vertical disparity but that of roll and size: a square that strays from those was laid onto
    something else.
    """
    here = np.array([bool(counted[round(y), round(x)]) for x, y in report.middle_px.tolist()], dtype=bool)
    middle, disparity = report.middle_px[here], report.disparity_px[here]
    variance = np.sum(report.standard_error_px[here] ** 2, axis=1)
    if len(middle) >= LEAST_SQUARES:
        down = disparity[:, 1]
        turned = fit_roll_scale(middle, down, (report.block_px, report.block_px))
        if turned is not None:
            down = down - np.sin(np.radians(turned.roll_deg)) * middle[:, 0] - (turned.scale - 1) * middle[:, 1]
        off = np.abs(down - np.median(down))
        near = off <= max(_STRAY * _robust_sd(down), _STRAY_PX)
        middle, disparity, variance = middle[near], disparity[near], variance[near]
    rows = np.column_stack([middle, disparity, variance]).tolist()
    return {(x, y): (across, down, noise) for x, y, across, down, noise in rows}


def depth_measures(
    middle: Floats, across: Floats, down: Floats, variance: float, size_px: tuple[int, int], least_relief_px: float
) -> dict[str, EyesPair]:
    """Return the measures of disparity: middle, scale, what is left of its distribution, and roll.

    ``variance`` is the squares' own noise, of both pairs and axes together.
    """
    if len(middle) < LEAST_SQUARES:
        return {}
    measures = {}
    turned = fit_roll_scale(middle, down[:, 1] - down[:, 0], size_px)
    if turned is not None:
        each = [fit_roll_scale(middle, down[:, number], size_px) for number in (0, 1)]
        own = [0.0 if one is None else one.roll_deg for one in each]
        measures["roll"] = EyesPair(own[0], own[1], turned.roll_deg, turned.roll_se_deg)
        if abs(turned.roll_deg) > 3 * turned.roll_se_deg:
            # What roll does to disparities is its own, and no depth.
            angle, none = np.radians(turned.roll_deg), np.zeros(len(middle))
            from_middle = middle - (np.array(size_px) - 1) / 2
            across = across + np.column_stack([none, angle * from_middle[:, 1]])
            down = down - np.column_stack([none, angle * from_middle[:, 0]])
    for name, values in (("disparity across", across), ("disparity down", down)):
        apart = values[:, 1] - values[:, 0]
        error = 1.2533 * _robust_sd(apart) / np.sqrt(len(apart))
        medians = np.median(values, axis=0)
        measures[name] = EyesPair(float(medians[0]), float(medians[1]), float(np.median(apart)), float(error))
    relief = [float(np.diff(np.percentile(values, _RELIEF))[0]) / _RELIEF_SD for values in across.T]
    measures["relief"] = EyesPair(relief[0], relief[1], relief[1] - relief[0], 0.0)
    off = across[:, 1] - across[:, 0]
    if relief[0] >= least_relief_px and len(middle) >= _LEAST_FOR_SCALE:
        off, apart = _off_the_line(across), off
        scale, error = jackknife(across[_near(off) | _near(apart)], _slope)
        measures["depth scale"] = EyesPair(1.0, scale, scale - 1.0, error)
    rows = np.column_stack([off, down[:, 1] - down[:, 0]])
    left, error = jackknife(rows, lambda kept: np.sqrt(max(0.0, _trimmed_square(kept) - variance)))
    measures["disparity left"] = EyesPair(0.0, left, left, error)
    return measures


def _robust_sd(values: Floats) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _near(values: Floats) -> Mask:
    away = np.abs(values - np.median(values))
    return np.asarray(away <= max(_STRAY * _robust_sd(values), 1e-9))


def _slope(pairs: Floats) -> float:
    """Return how much the second number (n, 2) rises with the first, both of one error: Deming's line [Deming1943]."""
    (xx, xy), (_, yy) = np.cov(pairs.T)
    if xy == 0:
        return 0.0 if yy <= xx else float("inf")
    return float((yy - xx + np.hypot(yy - xx, 2 * xy)) / (2 * xy))


def _off_the_line(pairs: Floats) -> Floats:
    """Return how far each second number (n, 2) lies from a straight line on the first, by medians [Theil1950]."""
    first, second = pairs.T
    one, other = np.triu_indices(len(pairs), 1)
    run = first[other] - first[one]
    far = np.abs(run) > 0.5 * float(np.std(first)) + 1e-12
    slope = float(np.median((second[other] - second[one])[far] / run[far])) if far.any() else 1.0
    off = second - slope * first
    return np.asarray(off - np.median(off))


def _trimmed_square(off: Floats) -> float:
    """Return the mean square (n, 2) about the medians, without the farthest twentieth."""
    square = np.sort(np.sum((off - np.median(off, axis=0)) ** 2, axis=1))
    return float(square[: max(LEAST_SQUARES - 1, int(np.ceil(0.95 * len(square))))].mean())


def squares_of(shape: tuple[int, ...], side: int, counted: Mask) -> list[Place]:
    """Return the middles of the squares that `measure_disparity` looks at, of those that count."""
    height, width = shape
    rows, columns = height // side, width // side
    top, left = (height - rows * side) // 2, (width - columns * side) // 2
    half = (side - 1) / 2
    middles = [
        (left + column * side + half, top + row * side + half) for row in range(rows) for column in range(columns)
    ]
    return [(x, y) for x, y in middles if counted[round(y), round(x)]]


def filled_in(
    own: Disparities,
    other: Disparities,
    squares: list[Place],
) -> Floats:
    """Return the disparity (n, 2) of each square: its own, or the other pair's, or the nearest square's."""
    known = [own.get(place, other.get(place)) for place in squares]
    from_place = np.array(
        [place for place, one in zip(squares, known, strict=True) if one is not None], dtype=np.float64
    )
    values = np.array([one[:2] for one in known if one is not None], dtype=np.float64)
    if not len(values):
        return np.zeros((len(squares), 2))
    apart = np.hypot(*(np.array(squares)[:, None, :] - from_place[None]).transpose(2, 0, 1))
    return np.asarray(values[apart.argmin(axis=1)])
