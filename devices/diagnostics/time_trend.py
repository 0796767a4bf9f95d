"""A smooth trend in repeated readings, as smooth as cross-validation makes it, and none where chance explains as much.

Readings of several patches share one trend, and each patch has its own level. Candidates: a straight line, exponentials
that settle (thesis Section 3.2.1.2, Figure 3.8 [Medina2016]), and cubic smoothing splines of several stiffnesses as
ridge regressions on cubic radial functions of time [Ruppert2003]. Each is judged by what it predicts of a reading left
out (for linear smoothers the residual over one minus its leverage). The best is taken only where its error, as a share
of that without a trend, is smaller than Gaussian noise at the same times gives with the stated probability.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents.arrays import Floats

Integers = NDArray[np.intp]
Basis = Callable[[Floats], Floats]

_MOST_KNOTS = 10
_TIME_CONSTANTS = (0.1, 0.3, 1.0)  # of the span of time
_STIFFNESSES = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6)
# Fewer readings beyond one of each patch leave no error to judge a trend by.
FEWEST_SPARE = 2
# Noise is drawn in batches, until it gains so often that the p-value lies far above the level.
_DRAWS, _BATCH, _FAR = 10_000, 500, 4
_NOTHING = 1e-12  # spread of values that is only rounding
_FULL_LEVERAGE = 1e-6
# Of the readings that are missed by most, this many are doubted; one in so many may be left out at most.
_LEVEL_WITHOUT_ODD = 0.2
_ODD, _DOUBTED, _ONE_IN, _FEWEST_TO_DOUBT = 0.25, 3, 5, 8


@dataclass(frozen=True, slots=True, eq=False)
class TimeTrend:
    """A trend over ``start``..``end`` (in the readings' time), constant before and after.

    ``error_before`` and ``error_after``: root mean square error of readings left out, without and with it, in the unit
    of the values. ``p_value``: how often noise alone gives as great a gain.
    """

    start: float
    end: float
    basis: Basis
    coefficients: Floats
    error_before: float
    error_after: float
    p_value: float

    def at(self, time: ArrayLike) -> Floats:
        """Return the trend at times of any shape (n,), shape (n,), from an arbitrary zero."""
        inside = (np.clip(np.asarray(time, dtype=np.float64), self.start, self.end) - self.start) / (
            self.end - self.start
        )
        return np.asarray(self.basis(inside) @ self.coefficients)


def trend_in_time(time: ArrayLike, values: ArrayLike, group: ArrayLike, level: float) -> TimeTrend | None:
    """Return the trend of ``values`` that cross-validation prefers, or None.

    Parameters
    ----------
    time
        Times, shape (n,), in any unit.
    values
        Shape (n,), in a unit in which noise is about the same everywhere.
    group
        Which patch each value is of, whole numbers of shape (n,). Patches read once say nothing.
    level
        How often, at most, noise alone may be taken for a trend.

    Returns
    -------
    TimeTrend or None
        None where there are too few readings, or where a trend predicts them no better than noise would let it.
    """
    when, value, patch = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64), np.asarray(group)
    kept = _without_odd(when, value, patch)
    smoothed = _smoothed(when[kept], value[kept], patch[kept])
    if smoothed is None:
        return None
    # To leave an odd reading out is a choice too, which noise could profit from.
    level = level if kept.all() else _LEVEL_WITHOUT_ODD * level
    p_value = smoothed.chance(level)
    before, after = (float(np.sqrt(np.mean(left**2))) for left in (smoothed.left_out_none, smoothed.left_out_best))
    if p_value > level or after >= before:
        return None
    best = smoothed.best
    return TimeTrend(smoothed.start, smoothed.end, best.basis, best.operator @ smoothed.rest, before, after, p_value)


def _without_odd(when: Floats, value: Floats, patch: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which readings to keep: a lid or a hand before the instrument must not hide a trend in the others.

    A reading is left out where the error of the others falls to a quarter without it; never the first or the last in
    time, where a trend bends by itself.
    """
    kept = np.ones(len(value), dtype=bool)
    for _ in range(len(value) // _ONE_IN):
        smoothed = _smoothed(when[kept], value[kept], patch[kept])
        if smoothed is None or len(smoothed.rows) < _FEWEST_TO_DOUBT:
            break
        rows = np.flatnonzero(kept)[smoothed.rows]
        inner = (when[rows] > smoothed.start) & (when[rows] < smoothed.end)
        worst = rows[np.argsort(np.where(inner, -np.abs(smoothed.left_out_best), np.inf), kind="stable")[:_DOUBTED]]
        errors = []
        for row in worst:
            fewer = kept.copy()
            fewer[row] = False
            other = _smoothed(when[fewer], value[fewer], patch[fewer])
            errors.append(np.inf if other is None else float(np.sqrt(np.mean(other.left_out_best**2))))
        if min(errors) >= _ODD * float(np.sqrt(np.mean(smoothed.left_out_best**2))):
            break
        kept[worst[int(np.argmin(errors))]] = False
    return kept


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A linear smoother: ``columns`` (n, p) times ``operator`` (p, n) gives the fitted values, with ``spare`` (n,)."""

    basis: Basis
    columns: Floats
    operator: Floats
    spare: Floats

    def left_out(self, rest: Floats) -> Floats:
        """Return the errors of readings left out, of values within patches (..., n)."""
        return np.asarray((rest - (rest @ self.operator.T) @ self.columns.T) / self.spare)


@dataclass(frozen=True, slots=True, eq=False)
class _Smoothed:
    """Values of the ``rows`` whose patches were read more than once, less their patches' levels, and what smooths them.

    ``best`` is the one of ``fits`` that predicts readings left out best.
    """

    start: float
    end: float
    rows: Integers
    member: Integers
    counts: Integers
    rest: Floats
    fits: tuple[_Fit, ...]
    best: _Fit

    @property
    def left_out_none(self) -> Floats:
        """The errors of readings left out, without a trend."""
        return np.asarray(self.rest / (1.0 - 1.0 / self.counts[self.member]))

    @property
    def left_out_best(self) -> Floats:
        """The errors of readings left out, with the best trend."""
        return self.best.left_out(self.rest)

    def chance(self, level: float) -> float:
        """Return how often noise at the same times gains as much by its own best trend; roughly, if far above it."""
        own = float(np.mean(self.left_out_best**2) / np.mean(self.left_out_none**2))
        generator = np.random.default_rng(1)
        drawn, gains = 0, 0
        while drawn < _DRAWS:
            noise = _within(generator.standard_normal((_BATCH, len(self.rest))), self.member, self.counts)
            plain = np.mean((noise / (1.0 - 1.0 / self.counts[self.member])) ** 2, axis=1)
            least = np.min([np.mean(fit.left_out(noise) ** 2, axis=1) for fit in self.fits], axis=0) / plain
            drawn, gains = drawn + _BATCH, gains + int(np.sum(least <= own))
            if gains > _FAR * (level * drawn + 1):
                break
        return (1 + gains) / (1 + drawn)


def _smoothed(when: Floats, value: Floats, patch: NDArray[Any]) -> _Smoothed | None:
    """Return every candidate fitted, or None where repeats are too few, at one time, or agree exactly."""
    _, member, counts = np.unique(patch, return_inverse=True, return_counts=True)
    rows = np.flatnonzero(counts[member] > 1)
    when, value = when[rows], value[rows]
    _, member, counts = np.unique(member[rows], return_inverse=True, return_counts=True)
    if len(value) - len(counts) < FEWEST_SPARE or np.ptp(when) <= 0:
        return None
    start, end = float(when.min()), float(when.max())
    inside = (when - start) / (end - start)
    rest = _within(value, member, counts)
    if float(np.abs(rest).max()) <= _NOTHING * max(1.0, float(np.abs(value).max())):
        return None
    fits = tuple(fit for own in _candidates(inside) for fit in _fits(*own, inside, member, counts))
    if not fits:
        return None
    best = min(fits, key=lambda fit: float(np.mean(fit.left_out(rest) ** 2)))
    return _Smoothed(start, end, rows, member, counts, rest, fits, best)


def _fits(basis: Basis, penalties: Floats, inside: Floats, member: Integers, counts: Integers) -> Iterator[_Fit]:
    """Yield the smoothers of a basis with each of its ``penalties`` (m, p), which can be solved for and leave some."""
    columns = _within(basis(inside).T, member, counts).T
    normal = columns.T @ columns + penalties[:, :, None] * np.eye(columns.shape[1])
    solved = np.linalg.matrix_rank(normal) == columns.shape[1]
    for operator in np.linalg.solve(normal[solved], columns.T):
        spare = np.asarray(1.0 - 1.0 / counts[member]) - np.einsum("np,pn->n", columns, operator)
        if spare.min() > _FULL_LEVERAGE:
            yield _Fit(basis, columns, operator, spare)


def _within(values: Floats, member: Integers, counts: Integers) -> Floats:
    """Return ``values`` (..., n) minus the mean of their patch."""
    members = (member[:, None] == np.arange(len(counts))).astype(np.float64)
    return np.asarray(values - (values @ members / counts)[..., member])


def _candidates(inside: Floats) -> list[tuple[Basis, Floats]]:
    """Return bases over time 0..1, columns (n, p), with ridge penalties (m, p), one of each column, to choose from."""
    out: list[tuple[Basis, Floats]] = [(_line, np.zeros((1, 1)))]
    out += [(_settling(constant), np.zeros((1, 1))) for constant in _TIME_CONSTANTS]
    unique = np.unique(inside)
    knots = np.quantile(unique, np.linspace(0, 1, min(_MOST_KNOTS, len(unique) // 2) + 2)[1:-1])
    if len(knots) > 1:
        basis = _spline(knots)
        strength = float(np.sum(basis(inside)[:, 1:] ** 2))
        out.append((basis, np.array([[0.0, *[share * strength] * len(knots)] for share in _STIFFNESSES])))
    return out


def _line(inside: Floats) -> Floats:
    return np.asarray(inside)[..., None]


def _settling(constant: float) -> Basis:
    return lambda inside: np.exp(-np.asarray(inside) / constant)[..., None]


def _spline(knots: Floats) -> Basis:
    """Return time and the radial cubics at ``knots``, turned so that equal ridge penalties bend them alike."""
    left, sizes, right = np.linalg.svd(np.abs(knots[:, None] - knots[None, :]) ** 3)
    turn = (left / np.sqrt(np.maximum(sizes, 1e-12 * sizes[0]))) @ right
    return lambda inside: np.concatenate(
        [np.asarray(inside)[..., None], (np.abs(np.asarray(inside)[..., None] - knots) ** 3) @ turn], axis=-1
    )
