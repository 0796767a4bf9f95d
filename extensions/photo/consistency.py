"""Whether the photographs of a bracket show one scene in one light: measured exposures, moved objects, other scenes.

Neighbouring exposures are compared by blocks of photosites that are well exposed in both. Their sums give the ratio of
the exposures as the sensor saw it. A block whose light differs by more than noise explains, and by more than a
twentieth, shows something that moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from extensions.photo.noise import NEARLY_FULL, NoiseModel
from extensions.photo.shots import Shot, block_sums
from stimuli.develop import SensorImage

Mask = NDArray[np.bool_]

_LEAST_BLOCKS = 4
_INLIER = 0.1
_SAMPLES = 300_000
_CLIP = 4.0
# A block has moved beyond this many standard deviations of its sum, and beyond this share of its light.
_DEVIATIONS = 6.0
_LEAST_CHANGE = 0.05
# A tripod gives by such a part of a pixel.
_STEADY_PX = 0.3
# Black that is off by this share of full scale is no motion.
_BLACK = 3e-4
_LEAST_COUNT = 16
_CLEAR_LIGHT = 0.003
_LEAST_CONTRAST = 0.05


@dataclass(frozen=True, eq=False, slots=True)
class Compared:
    """Two neighbouring exposures by blocks, (rows, columns): sums over photosites well exposed in both, and how
    many."""

    shorter: Floats
    longer: Floats
    count: Floats

    def ratio(self) -> tuple[float, float] | None:
        """Return how many times the shorter's light the longer has, with its standard error; None if few compare."""
        size = self.count.max(initial=0.0)
        good = (self.count >= size) & (self.count > 0) & (self.shorter > _CLEAR_LIGHT * self.count)
        if np.count_nonzero(good) < _LEAST_BLOCKS:
            return None
        short, long = self.shorter[good], self.longer[good]
        bright = short >= np.median(short)
        short, long = short[bright], long[bright]
        ratio = float(np.median(long / short))
        if not ratio > 0:
            return None
        near = np.abs(long / short / ratio - 1) < _INLIER
        if np.count_nonzero(near) < max(2, 0.25 * len(near)):
            return ratio, float("nan")
        short, long = short[near], long[near]
        ratio = float(long.sum() / short.sum())
        error = float(np.sqrt(((long - ratio * short) ** 2).sum()) / short.sum())
        return ratio, error

    def correlation(self) -> float | None:
        """Return the correlation of the logarithms of their light, block by block; None if the scene has too little."""
        good = (self.count >= _LEAST_COUNT) & (self.shorter > _CLEAR_LIGHT * self.count) & (self.longer > 0)
        if np.count_nonzero(good) < _LEAST_BLOCKS**2:
            return None
        short, long = (np.log(part[good] / self.count[good]) for part in (self.shorter, self.longer))
        if min(short.std(), long.std()) < _LEAST_CONTRAST:
            return None
        return float(np.corrcoef(short, long)[0, 1])


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """Values at the same photosites of every exposure: of each colour a list of (n,) arrays, and where they are
    full."""

    values: tuple[list[Floats], ...]
    full: tuple[list[Mask], ...]


def compare_neighbours(shots: Sequence[Shot], t: Sequence[float]) -> tuple[list[Compared], Samples]:
    """Return how each exposure compares with the next longer one, and samples of the values for the noise."""
    sums: list[list[list[Floats]]] = [[[], [], []] for _ in shots[1:]]
    colours: list[list[list[Floats]]] = [[[] for _ in shots] for _ in range(3)]
    marks: list[list[list[Mask]]] = [[[] for _ in shots] for _ in range(3)]
    step = max(1, round(float(np.sqrt(np.prod(shots[0].shape) / 3 / _SAMPLES))))
    for rows in shots[0].bands():
        read = [shot.read(rows) for shot in shots]
        for number, (short, long) in enumerate(pairwise(read)):
            good = _comparable(short, t[number + 1] / t[number], shots[number + 1].level)
            for kept, part in zip(sums[number], (short[0] * good, long[0] * good, good), strict=True):
                kept.append(block_sums(part))
        for number, (values, full) in enumerate(read):
            places = _as(shots[number], values, full).planes()
            for colour, of_colour in enumerate(places):
                for place in of_colour:
                    colours[colour][number].append(values[place][::step, ::step].ravel().astype(np.float64))
                    marks[colour][number].append(full[place][::step, ::step].ravel())
    compared = [Compared(*(np.concatenate(part) for part in pair)) for pair in sums]
    samples = Samples(
        tuple([np.concatenate(parts) for parts in of_colour] for of_colour in colours),
        tuple([np.concatenate(parts) for parts in of_colour] for of_colour in marks),
    )
    return compared, samples


def colour_ratios(samples: Samples, number: int, ratio: float, level: float) -> list[float | None]:
    """Return for red, green and blue how many times the light of exposure ``number`` the next longer one has."""
    found: list[float | None] = []
    for values, full in zip(samples.values, samples.full, strict=True):
        short, long = values[number], values[number + 1]
        good = ~full[number] & ~full[number + 1] & (short * ratio < NEARLY_FULL * level) & (short > _CLEAR_LIGHT)
        good &= np.abs(long - ratio * short) < 0.5 * ratio * short
        found.append(float(long[good].sum() / short[good].sum()) if np.count_nonzero(good) >= 100 else None)
    return found


def moved_blocks(shots: Sequence[Shot], t: Sequence[float], noise: Sequence[NoiseModel | None]) -> list[Mask]:
    """Return for each exposure and the next longer one which blocks (rows, columns) differ by more than noise."""
    found: list[list[Mask]] = [[] for _ in shots[1:]]
    for rows in shots[0].bands():
        read = [shot.read(rows) for shot in shots]
        gain, read_noise = _noise_of(shots[0], read[0], noise)
        for number, (short, long) in enumerate(pairwise(read)):
            one, other = t[number], t[number + 1]
            # Beyond nearly full the longer exposure says no more than that it is.
            most = np.float32(NEARLY_FULL * shots[number + 1].level / other)
            dim, lit = (part[0] / np.float32(time) for part, time in ((short, one), (long, other)))
            good = (dim < most) | (lit < most)
            dim, lit = np.minimum(dim, most), np.minimum(lit, most)
            light = np.maximum((dim + lit) / 2, 0)
            variance = gain * light * np.float32(1 / one + 1 / other)
            variance += read_noise**2 * np.float32(1 / one**2 + 1 / other**2)
            off = (lit - dim) * good
            spread = np.float32(_CLIP) * np.sqrt(variance)
            # A single photosite, such as a hot one, does not make a block.
            clipped = np.abs(block_sums(np.clip(off, -spread, spread)))
            count = block_sums(good)
            beyond = clipped > _DEVIATIONS * np.sqrt(block_sums(variance * good))
            change = np.abs(block_sums(off))
            allowed = _LEAST_CHANGE * np.abs(block_sums(light * good)) + _BLACK * (1 / one + 1 / other) * count
            for slope in _slopes(light, light.ndim == 2):
                allowed += _STEADY_PX * np.abs(block_sums(slope * good))
            beyond &= change > allowed
            found[number].append(beyond & (count >= _LEAST_COUNT))
    return [np.concatenate(parts) for parts in found]


def camera_shift(shots: Sequence[Shot], t: Sequence[float], number: int) -> tuple[float, float, float]:
    """Return by how many pixels exposure ``number + 1`` lies to the right of and below ``number``, and how well.

    The shift explains the differences best by the slope of the light (least squares, [Lucas1981]); the third number is
    the share of their squares that it explains, 0 to 1. Shifts of several pixels come out as about one.
    """
    short, long = shots[number], shots[number + 1]
    normal, pull, total = np.zeros((2, 2)), np.zeros(2), 0.0
    for rows in short.bands():
        read = short.read(rows), long.read(rows)
        one, other = (
            _smooth(part[0] / np.float32(time)) for part, time in zip(read, t[number : number + 2], strict=True)
        )
        good = _comparable(read[0], t[number + 1] / t[number], long.level)
        light = np.asarray((one + other) / 2, np.float32)
        dim = np.maximum(light, 1e-3)
        slopes = [part / dim * good for part in _slopes(light, len(short.shape) == 2)]
        off = (other - one) / dim * good
        normal += [[float((p * q).sum()) for q in slopes] for p in slopes]
        pull -= [float((p * off).sum()) for p in slopes]
        total += float((off**2).sum())
    if not total > 0 or np.linalg.cond(normal) > 1e6:
        return 0.0, 0.0, 0.0
    shift = np.linalg.solve(normal, pull)
    return float(shift[0]), float(shift[1]), float(shift @ pull / total)


def _smooth(values: NDArray[np.float32]) -> NDArray[np.float32]:
    from scipy.ndimage import gaussian_filter

    # Of a mosaic each colour by itself would be needed; its blur of two photosites is nearly that of grey.
    return np.asarray(gaussian_filter(values, (2, 2, 0)[: values.ndim], mode="nearest"))


def _slopes(light: NDArray[np.float32], is_mosaic: bool) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return how the light rises to the right and downwards, for each pixel, by photosites of the same colour."""
    step = 2 if is_mosaic else 1
    across, down = np.zeros_like(light), np.zeros_like(light)
    across[:, step:-step] = (light[:, 2 * step :] - light[:, : -2 * step]) / (2 * step)
    down[step:-step] = (light[2 * step :] - light[: -2 * step]) / (2 * step)
    return across, down


def _comparable(short: tuple[NDArray[np.float32], Mask], ratio: float, level: float) -> Mask:
    """Return where the longer exposure is expected well below full."""
    values, full = short
    return ~full & (values * np.float32(ratio) < np.float32(NEARLY_FULL * level))


def _noise_of(
    shot: Shot, read: tuple[NDArray[np.float32], Mask], noise: Sequence[NoiseModel | None]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    gain, read_noise = np.zeros_like(read[0]), np.zeros_like(read[0])
    for places, model in zip(_as(shot, *read).planes(), noise, strict=True):
        for place in places:
            gain[place], read_noise[place] = (model.gain, model.read) if model is not None else (0.0, 0.0)
    # Codes are whole numbers: without any noise they still differ by some.
    return gain, np.maximum(read_noise, np.float32(1e-5))


def _as(shot: Shot, values: NDArray[np.float32], full: Mask) -> SensorImage:
    return replace(shot.sensor, values=values, saturated=full)
