"""The shift, or the shift, turn and growth, that squares ask for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stimuli.comparison.squares import Field, move

Floats = NDArray[np.float64]

# A rotation or a scale is undone if it moves the picture's corners by more, and by more than its errors explain.
LEAST_TURN_PX, LEAST_TURN_Z = 0.06, 4.0


@dataclass(frozen=True, eq=False, slots=True)
class Similarity:
    """``values``: shift across and down, relative growth, rotation in radians; their covariance, and of the shift."""

    values: Floats
    covariance: Floats
    shift: Floats
    shift_covariance: Floats

    def turns(self, shape: tuple[int, ...]) -> bool:
        """Whether rotation or growth is more than noise, and moves the corners by more than next to nothing."""
        half = 0.5 * float(np.hypot(shape[0], shape[1]))
        for value, variance in zip(self.values[2:], np.diag(self.covariance)[2:], strict=True):
            if abs(value) * half > LEAST_TURN_PX and abs(value) > LEAST_TURN_Z * float(np.sqrt(variance)):
                return True
        return False

    def matrix(self, turned: bool, shape: tuple[int, ...]) -> Floats:
        """Return it as a matrix (3, 3): all of it if ``turned``, else the shift alone."""
        if not turned:
            return move(self.shift)
        x, y, growth, angle = self.values
        centre = middle(shape)
        linear = (1.0 + growth) * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        found = np.eye(3)
        found[:2, :2] = linear
        found[:2, 2] = centre + (x, y) - linear @ centre
        return found

    def errors(self, turned: bool) -> Floats:
        """Return the standard errors (4,) of what `matrix` undoes; infinite for what it does not."""
        if turned:
            return np.asarray(np.sqrt(np.diag(self.covariance)))
        return np.concatenate([np.sqrt(np.diag(self.shift_covariance)), [np.inf, np.inf]])


def fit_similarity(field: Field, shape: tuple[int, ...]) -> Similarity:
    """Fit both by least squares, weighted by the squares' errors, without squares that stray from the others."""
    at = field.middle_px - middle(shape)
    zero, one = np.zeros(len(at)), np.ones(len(at))
    rows = np.concatenate(
        [np.stack([one, zero, at[:, 0], -at[:, 1]], axis=1), np.stack([zero, one, at[:, 1], at[:, 0]], axis=1)]
    )
    said = field.moved_px.T.ravel()
    # Standard errors below a hundredth are not to be believed; those along an edge are large, and weigh nothing.
    weight = 1.0 / (np.minimum(field.standard_error_px.T.ravel(), 1e3) ** 2 + 0.01**2)
    values, covariance = _weighted(rows, said, weight)
    shift, shift_covariance = _weighted(rows[:, :2], said, weight)
    return Similarity(values, covariance, shift, shift_covariance)


def _weighted(rows: Floats, said: Floats, weight: Floats) -> tuple[Floats, Floats]:
    kept = np.ones(len(said), dtype=bool)
    values = np.zeros(rows.shape[1])
    covariance = np.full((rows.shape[1], rows.shape[1]), np.inf)
    for _ in range(4):
        normal = rows[kept].T @ (rows[kept] * weight[kept, None])
        if np.linalg.matrix_rank(normal) < len(normal):
            break
        inverse = np.linalg.inv(normal)
        values = inverse @ (rows[kept].T @ (said[kept] * weight[kept]))
        off = (said - rows @ values) * np.sqrt(weight)
        free = max(1, int(kept.sum()) - len(values))
        covariance = inverse * max(1.0, float(np.sum(off[kept] ** 2)) / free)
        usual = max(1.0, 1.4826 * float(np.median(np.abs(off))))
        now = np.abs(off) < 4.0 * usual
        if np.array_equal(now, kept) or now.sum() < len(values) + 2:
            break
        kept = now
    return np.asarray(values), np.asarray(covariance)


def middle(shape: tuple[int, ...]) -> Floats:
    """Return the place of a picture's middle, x and y."""
    return np.array([(shape[1] - 1) / 2.0, (shape[0] - 1) / 2.0])
