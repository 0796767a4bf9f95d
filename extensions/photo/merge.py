"""The light that several exposures of one scene saw, by maximum likelihood under the noise of the sensor.

Of exposure i a photosite gives y_i = t_i x + noise, with the variance g t_i x + r²: photons, and reading. The estimate
weighs each exposure by its inverse variance, x = Σ (t_i y_i / v_i) / Σ (t_i² / v_i), v_i at x itself, found by
iteration [Granados2010]; its variance, 1 / Σ (t_i² / v_i), is the Cramér-Rao bound where photons are many. With photon
noise alone it is Σ y_i / Σ t_i, for any gain [Hanji2020].

A full photosite says only that its light was at least so much. Left out, it would leave the values that noise has
lowered, and the estimate would be up to a third of its standard error too low, or, if the shorter exposures decide what
is left out, too high. So its likelihood is that of a censored value [Tobin1958], Φ((t_i x − full) / √v_i), which counts
where the exposure is nearly full and is nothing far beyond.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents.arrays import Floats
from extensions.photo.noise import NoiseModel
from stimuli.errors import StimulusError

Bools = NDArray[np.bool_]

# So many that a further one changes nothing by a thousandth of the standard error, as test_bracket.py shows.
_ROUNDS = 3
_CENSORED_ROUNDS = 5
# Photosites worked on at a time: their values of all exposures stay in the processor's cache.
_BLOCK = 1 << 13
# A photosite that is full although it should be so many standard deviations below is hot, or hit: it is left out.
_CLEAR = 6.0


@dataclass(frozen=True, eq=False, slots=True)
class Merged:
    """The merged values, in shares of full scale at the shortest exposure, all of one shape.

    ``value`` and ``standard_error`` are float64; the latter is NaN where the noise is not known. ``saturated`` marks
    values that no exposure saw below full: they are lower bounds. ``exposures`` counts those that have a part in each.
    """

    value: Floats
    standard_error: Floats
    saturated: Bools
    exposures: NDArray[np.int64]


def merge_exposures(
    values: Sequence[ArrayLike],
    saturated: Sequence[ArrayLike],
    relative_exposures: Sequence[float],
    noise: NoiseModel | None = None,
    *,
    full: float = 1.0,
    alone: ArrayLike | None = None,
    reference: int = 0,
) -> Merged:
    """Return what several exposures saw, weighed by their noise.

    Parameters
    ----------
    values
        For each exposure the linear values in shares of full scale, black 0; all of one shape, such as (height, width).
    saturated
        For each exposure where the sensor was full, of that shape.
    relative_exposures
        Each exposure beside the first, which is 1; ascending.
    noise
        The sensor's gain and read noise; None weighs by photon noise of unknown gain.
    full
        The share of full scale from which photosites are full, 0 to 1.
    alone
        Where one exposure alone counts, of that shape: ``reference``, or the longest below it that is not full.
    reference
        The number of that exposure, from 0.

    Returns
    -------
    Merged
        Values in shares of full scale at the first exposure, their standard errors, and where none was below full.

    Raises
    ------
    StimulusError
        If the shapes or numbers do not go together, or the exposures do not ascend from 1.

    Examples
    --------
    >>> merged = merge_exposures([[0.1, 0.6], [0.41, 1.0]], [[False, False], [False, True]], [1, 4])
    >>> merged.value.round(3).tolist(), merged.exposures.tolist()
    ([0.102, 0.6], [2, 1])
    """
    y = [np.asarray(part, dtype=np.float64) for part in values]
    is_full = [np.asarray(part, dtype=np.bool_) for part in saturated]
    t = [float(part) for part in relative_exposures]
    _check(y, is_full, t, reference)
    shape = y[0].shape
    only = None if alone is None else np.asarray(alone, dtype=np.bool_).ravel()
    values_, full_ = [part.ravel() for part in y], [part.ravel() for part in is_full]
    value, error, count = np.empty(y[0].size), np.full(y[0].size, np.nan), np.zeros(y[0].size, np.int64)
    times = np.array(t)[:, None]
    model = noise if noise is not None and noise.is_any else None
    for first in range(0, y[0].size, _BLOCK):
        part = slice(first, first + _BLOCK)
        of, marks = np.stack([one[part] for one in values_]), np.stack([one[part] for one in full_])
        value[part], error[part], count[part] = _merged(
            of, marks, times, model, full, None if only is None else only[part], reference
        )
    return Merged(value.reshape(shape), error.reshape(shape), (count == 0).reshape(shape), count.reshape(shape))


def _merged(
    y: Floats, is_full: Bools, t: Floats, noise: NoiseModel | None, full: float, only: Bools | None, reference: int
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return value, standard error and number of exposures, (n,); ``y`` and ``is_full`` are (exposures, n)."""
    use = ~is_full
    if only is not None:
        _one_alone(use, is_full, only, reference)
    count = use.sum(axis=0)
    seen = count > 0
    weight = use * t
    # Photon noise alone: its weights do not depend on the light.
    x = np.divide((use * y).sum(axis=0), weight.sum(axis=0), out=np.zeros(y.shape[1]), where=seen)
    # What is full at every exposure is at least what the shortest one recorded.
    if noise is None:
        return np.where(seen, x, y[0]), np.full_like(x, np.nan), count
    for _ in range(_ROUNDS):
        by_variance = weight / _variance(x, t, noise)
        information = (by_variance * t).sum(axis=0)
        x = np.divide((by_variance * y).sum(axis=0), information, out=x, where=seen)
    censored = is_full & seen & (t * x + _CLEAR * np.sqrt(_variance(x, t, noise)) >= full)
    # Beyond six standard deviations above full, that a photosite is full says nothing.
    censored &= t * x - _CLEAR * np.sqrt(_variance(x, t, noise)) <= full
    if only is not None:
        censored &= ~only
    information = (weight * t / _variance(x, t, noise)).sum(axis=0)
    near = np.flatnonzero(censored.any(axis=0))
    if len(near):
        x[near], information[near] = _censored(x[near], y[:, near], weight[:, near], censored[:, near], t, noise, full)
    error = np.full_like(x, np.nan)
    np.divide(1.0, information, out=error, where=seen & (information > 0))
    return np.where(seen, x, y[0]), np.sqrt(error), count


def _censored(
    x: Floats, y: Floats, weight: Floats, censored: Bools, t: Floats, noise: NoiseModel, full: float
) -> tuple[Floats, Floats]:
    """Return values (n,) and their information where some exposures count as censored: Newton's method from ``x``."""
    from scipy.special import log_ndtr

    for last in [False] * _CENSORED_ROUNDS + [True]:
        variance = _variance(x, t, noise)
        deviation = np.sqrt(variance)
        z = (t * x - full) / deviation
        hazard = np.exp(-0.5 * z**2 - log_ndtr(z)) / np.sqrt(2 * np.pi)
        information = (weight * t / variance + censored * (t / deviation) ** 2 * hazard * (hazard + z)).sum(axis=0)
        if not last:
            score = weight / variance * (y - t * x) + censored * t / deviation * hazard
            x = x + score.sum(axis=0) / information
    return x, information


def _check(y: Sequence[Floats], full: Sequence[Bools], t: Sequence[float], reference: int) -> None:
    if not len(y) == len(full) == len(t) > 0 or not 0 <= reference < len(y):
        raise StimulusError.of(
            f"{len(y)} pictures, {len(full)} saturation maps and {len(t)} exposures", "give one of each for an exposure"
        )
    if any(part.shape != y[0].shape for part in (*y, *full)):
        shapes = ", ".join(str(part.shape) for part in y)
        raise StimulusError.of(f"the pictures have the shapes {shapes}", "give pictures of one size")
    if abs(t[0] - 1) > 1e-9 or any(not later >= earlier for earlier, later in pairwise(t)):
        raise StimulusError.of(f"the exposures are {t}", "begin with 1 for the shortest, and ascend")


def _variance(x: Floats, t: Floats, noise: NoiseModel) -> Floats:
    """Return the variance of each exposure's value, (exposures, n); never 0, so that it can be divided by."""
    floor = noise.read**2 if noise.read > 0 else noise.gain * 1e-12
    return np.asarray(noise.gain * t * np.maximum(x, 0.0) + floor)


def _one_alone(use: Bools, is_full: Bools, alone: Bools, reference: int) -> None:
    """Leave of each place in ``alone`` the reference exposure, or the longest of the shorter ones that is not full."""
    open_ = alone.copy()
    for number in range(len(use) - 1, -1, -1):
        if number > reference:
            use[number] &= ~alone
            continue
        chosen = open_ & ~is_full[number]
        use[number] = np.where(alone, chosen, use[number])
        open_ &= ~chosen
