"""The numbers with the least soft L1 loss: Gauss and Newton's steps, damped where they would go uphill.

A soft L1 loss of residuals r is Σ √(1 + r²) − 1 [Charbonnier1994]: squares of small ones, the size of large ones. The
steps solve normal equations, many times as fast as the singular values of SciPy's solver, its slow twin in the tests.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from documents.arrays import Floats

_MOST_DAMPING = 1e6


def descend(
    residuals: Callable[[Floats], Floats],
    jacobian: Callable[[Floats], Floats],
    start: Floats,
    *,
    bounds: tuple[Floats, Floats] | None = None,
    last_gain: float = 1e-4,
    steps: int = 15,
) -> Floats:
    """Return the numbers (k,) near ``start`` (k,) whose ``residuals`` (n,), with a ``jacobian`` (n, k), lose the least.

    A step that gains less than the share ``last_gain`` of the loss is the last, and the last of ``steps`` in any case.
    A number that would leave its ``bounds`` is held there for the step.
    """
    low, high = bounds or (np.full(len(start), -np.inf), np.full(len(start), np.inf))
    p = np.clip(start, low, high)
    left = residuals(p)
    loss = float(_soft_l1(left).sum())
    damping = 1e-9
    for _ in range(steps):
        J = jacobian(p)
        weight = 1.0 / np.sqrt(1.0 + left**2)
        H = (J * weight[:, None]).T @ J
        slope = J.T @ (weight * left)
        held = ((p <= low) & (slope > 0)) | ((p >= high) & (slope < 0))
        H[held], H[:, held], slope[held] = 0.0, 0.0, 0.0
        scale = np.maximum(np.diag(H), 1e-12)
        while damping < _MOST_DAMPING:
            new = np.clip(p - _solved(H, damping * scale, slope), low, high)
            new_left = residuals(new)
            new_loss = float(_soft_l1(new_left).sum())
            if new_loss <= loss:
                break
            damping = max(10.0 * damping, 1e-6)
        else:
            return p
        gained = loss - new_loss
        p, left, loss, damping = new, new_left, new_loss, 0.1 * damping
        if gained < last_gain * loss + 1e-24:
            break
    return p


def _solved(H: Floats, more: Floats, slope: Floats) -> Floats:
    """Return (H + diag(more))⁻¹ · slope, by numbers brought to one scale so that none drowns in another."""
    size = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-12))
    scaled = H * size[:, None] * size[None, :]
    scaled[np.diag_indices_from(scaled)] = 1.0 + more * size**2
    return np.asarray(size * np.linalg.solve(scaled, size * slope))


def _soft_l1(left: Floats) -> Floats:
    return np.asarray(left**2 / (np.sqrt(1.0 + left**2) + 1.0))
