"""One channel's curve from pairs of code and light, by nonlinear least squares (thesis Expressions 3.4 to 3.7, 3.14).

Forward, light = (gain·code + offset)^gamma + lift; inverse, code = gain·((light − lift)^gamma − offset). Light is
divided by its largest value first, and the curve is fitted by what it gives at full drive, its offset, gamma and lift,
which keeps the problem alike for every unit and lets it converge from poor starts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError
from documents.arrays import Floats

_Problem = Callable[[Floats, Floats], tuple[Floats, Floats]]
Kind = Literal["gog", "gogo", "ggo", "gamma"]
KINDS: tuple[Kind, ...] = ("gamma", "gog", "ggo", "gogo")
COEFFICIENTS = ("gain", "offset", "gamma", "lift")
# Which of the four coefficients each model leaves free.
FREE: dict[Kind, tuple[bool, bool, bool, bool]] = {
    "gamma": (False, False, True, False),
    "gog": (True, True, True, False),
    "ggo": (True, False, True, True),
    "gogo": (True, True, True, True),
}
_LOW, _HIGH = np.array([0.05, -0.9, 0.1, -0.5]), np.array([4.0, 0.9, 10.0, 0.5])
_MOST_STEPS = 300
# A step of this share of the coefficients, or one that no damping makes go downhill, is the last.
_LAST_STEP, _MOST_DAMPING = 1e-12, 1e10
# A drive this low gives no measurable light; powers below it are kept finite.
_TINY = 1e-12


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """Coefficients in the order of ``COEFFICIENTS``, for light in its own unit, and how far to trust them.

    ``standard_errors``: shape (4,), 0 where a coefficient is not free. ``condition``: of the Jacobian with columns of
    unit length; above about 1000 the coefficients trade against each other. ``at_bound``: a coefficient ended at the
    edge of what is allowed.
    """

    kind: Kind
    inverse: bool
    coefficients: Floats
    standard_errors: Floats
    condition: float
    r2: float
    at_bound: bool

    def __call__(self, x: ArrayLike) -> Floats:
        """Return light for codes, or codes for light where the fit is of the inverse, of any shape."""
        given = np.asarray(x, dtype=np.float64)
        gain, offset, gamma, lift = self.coefficients
        if self.inverse:
            return np.asarray(gain * (np.maximum(given - lift, 0.0) ** gamma - offset))
        return np.asarray(np.maximum(gain * given + offset, 0.0) ** gamma + lift)


def fit_channel(
    code: ArrayLike, light: ArrayLike, kind: Kind, *, inverse: bool = False, start_gamma: float | None = None
) -> ChannelFit:
    """Fit ``kind`` to light, shape (n,), at codes, shape (n,), in 0..1; from code to light, or ``inverse``.

    Raises
    ------
    DeviceError
        If shapes disagree, a number is not finite, there are fewer different codes than coefficients, or there is no
        light.
    """
    return fit_channels([(code, light)], kind, inverse=inverse, start_gamma=start_gamma)[0]


def fit_channels(
    pairs: Sequence[tuple[ArrayLike, ArrayLike]],
    kind: Kind,
    *,
    inverse: bool = False,
    start_gamma: float | None = None,
) -> list[ChannelFit]:
    """Do as `fit_channel` for each pair of codes and light: those of one length at once, many times as fast."""
    free = np.array(FREE[kind])
    problem = _inverse_problem if inverse else _forward_problem
    checked = [_checked(code, light, kind) for code, light in pairs]
    # The simple gamma has no gain that could carry a unit.
    scales = [float(light.max()) if kind != "gamma" else 1.0 for _, light in checked]
    xy = [
        (light / scale, code) if inverse else (code, light / scale)
        for (code, light), scale in zip(checked, scales, strict=True)
    ]
    typical = np.array([start_gamma]) if start_gamma else np.array([1.0, 1.8, 2.6])
    gammas = 1.0 / typical if inverse and not start_gamma else typical
    out: list[ChannelFit | None] = [None] * len(xy)
    for length in {len(x) for x, _ in xy}:
        rows = [row for row, (x, _) in enumerate(xy) if len(x) == length]
        x = np.repeat(np.stack([xy[row][0] for row in rows]), len(gammas), axis=0)
        y = np.repeat(np.stack([xy[row][1] for row in rows]), len(gammas), axis=0)
        start = np.tile([1.0, 0.0, 1.0, 0.0], (len(x), 1))
        start[:, 2] = np.tile(gammas, len(rows))
        p, cost = _least_squares(problem, x, y, free, start)
        for place, row in enumerate(rows):
            starts = slice(place * len(gammas), (place + 1) * len(gammas))
            best = p[starts][int(np.argmin(cost[starts]))]
            out[row] = _channel_fit(best, problem, *xy[row], free, kind, inverse, scales[row])
    return [fit for fit in out if fit is not None]


def _checked(code: ArrayLike, light: ArrayLike, kind: Kind) -> tuple[Floats, Floats]:
    codes, lights = np.asarray(code, dtype=np.float64), np.asarray(light, dtype=np.float64)
    free = sum(FREE[kind])
    if codes.shape != lights.shape or codes.ndim != 1:
        raise DeviceError(f"codes and light must be two equally long lists, not {codes.shape} and {lights.shape}")
    if not (np.all(np.isfinite(codes)) and np.all(np.isfinite(lights))):
        raise DeviceError("codes and light must be finite")
    if len(np.unique(codes)) <= free:
        raise DeviceError(f"{kind} needs more than {free} different codes; there are {len(np.unique(codes))}")
    if lights.max() <= 0:
        raise DeviceError("the channel gives no light")
    return codes, lights


def _forward_problem(p: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Light (m, n) and its derivatives (m, n, 4) by drive at full code, offset, gamma and lift, (m, 4)."""
    full, offset, gamma, lift = p.T[:, :, None]
    drive = np.maximum((full - offset) * x + offset, 0.0)
    lit = drive > _TINY
    safe = np.where(lit, drive, 1.0)
    power = np.where(lit, safe**gamma, 0.0)
    slope = np.where(lit, gamma * power / safe, 0.0)
    return power + lift, np.stack([slope * x, slope * (1.0 - x), power * np.log(safe), np.ones_like(x)], axis=2)


def _inverse_problem(p: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Code (m, n) and its derivatives (m, n, 4) by gain, offset, gamma and lift, (m, 4)."""
    gain, offset, gamma, lift = p.T[:, :, None]
    drive = np.maximum(x - lift, 0.0)
    lit = drive > _TINY
    safe = np.where(lit, drive, 1.0)
    power = np.where(lit, safe**gamma, 0.0)
    by_lift = np.where(lit, -gain * gamma * power / safe, 0.0)
    return gain * (power - offset), np.stack(
        [power - offset, np.broadcast_to(-gain, x.shape), gain * power * np.log(safe), by_lift], axis=2
    )


def _least_squares(
    problem: _Problem, x: Floats, y: Floats, free: NDArray[np.bool_], start: Floats
) -> tuple[Floats, Floats]:
    """Return the coefficients (m, 4) that make of x (m, n) the least squares of y (m, n), and these sums (m,).

    Levenberg and Marquardt's steps, damped by each problem's own; a coefficient that would leave its bounds is held
    there for the step.
    """
    low, high, count = _LOW[free], _HIGH[free], int(free.sum())
    p = start.copy()
    p[:, free] = np.clip(start[:, free], low, high)
    moving = np.arange(len(p))
    damping = np.full(len(p), 1e-3)
    left = problem(p, x)[0] - y
    cost = (left**2).sum(axis=1)
    for _ in range(_MOST_STEPS):
        now, at = p[moving][:, free], x[moving]
        value, J = problem(p[moving], at)
        J = J[:, :, free]
        slope = np.einsum("mnk,mn->mk", J, value - y[moving])
        H = np.einsum("mnk,mnl->mkl", J, J)
        held = ((now <= low) & (slope > 0)) | ((now >= high) & (slope < 0))
        slope = np.where(held, 0.0, slope)
        H = np.where(held[:, :, None] | held[:, None, :], 0.0, H)
        scale = np.maximum(np.einsum("mkk->mk", H), 1e-30) * (1.0 + damping[moving])[:, None]
        H[:, np.arange(count), np.arange(count)] = np.where(held, 1.0, scale)
        new = p[moving].copy()
        new[:, free] = np.clip(now - np.linalg.solve(H, slope[:, :, None])[:, :, 0], low, high)
        new_cost = ((problem(new, at)[0] - y[moving]) ** 2).sum(axis=1)
        better = new_cost <= cost[moving]
        step = np.abs(new[:, free] - now).max(axis=1) / (1e-3 + np.abs(now).max(axis=1))
        p[moving[better]], cost[moving[better]] = new[better], new_cost[better]
        damping[moving] *= np.where(better, 0.1, 10.0)
        damping[moving] = np.maximum(damping[moving], 1e-15)
        moving = moving[~((better & (step < _LAST_STEP)) | (damping[moving] > _MOST_DAMPING))]
        if not len(moving):
            break
    return p, cost


def _channel_fit(
    p: Floats,
    problem: _Problem,
    x: Floats,
    y: Floats,
    free: NDArray[np.bool_],
    kind: Kind,
    inverse: bool,
    scale: float,
) -> ChannelFit:
    made, by = problem(p[None], x[None])
    predicted, jacobian = made[0], by[0][:, free]
    residual = y - predicted
    spread = float(((y - y.mean()) ** 2).sum())
    norms = np.linalg.norm(jacobian, axis=0)
    safe = np.where(norms > 0, norms, 1.0)
    condition = float(np.linalg.cond(jacobian / safe)) if np.all(norms > 0) else float("inf")
    variance = float(residual @ residual) / max(len(y) - int(free.sum()), 1)
    covariance = np.zeros((4, 4))
    covariance[np.ix_(free, free)] = variance * np.linalg.pinv(jacobian.T @ jacobian)
    coefficients, turn = _in_unit(p, inverse, scale)
    errors = np.sqrt(np.maximum(np.diag(turn @ covariance @ turn.T), 0.0))
    edge = (np.abs(p - _LOW)[free] < 1e-6) | (np.abs(p - _HIGH)[free] < 1e-6)
    r2 = 1.0 - float(residual @ residual) / spread if spread > 0 else float("nan")
    return ChannelFit(kind, inverse, coefficients, errors, condition, r2, bool(edge.any()))


def _in_unit(p: Floats, inverse: bool, scale: float) -> tuple[Floats, Floats]:
    """Turn what was fitted to light ÷ ``scale`` into coefficients for light; also their derivatives (4, 4)."""
    turn = np.eye(4)
    first, offset, gamma, lift = p
    if inverse:
        k = scale**-gamma
        # code = first·((light/scale − lift)^γ − offset) = first·k·((light − lift·scale)^γ − offset/k)
        turn[0, 0], turn[0, 2] = k, -first * k * np.log(scale)
        turn[1, 1], turn[1, 2] = 1.0 / k, offset / k * np.log(scale)
        turn[3, 3] = scale
        return np.array([first * k, offset / k, gamma, lift * scale]), turn
    k = scale ** (1.0 / gamma)
    by_gamma = -k * np.log(scale) / gamma**2
    turn[0, 0], turn[0, 1], turn[0, 2] = k, -k, (first - offset) * by_gamma
    turn[1, 1], turn[1, 2] = k, offset * by_gamma
    turn[3, 3] = scale
    return np.array([(first - offset) * k, offset * k, gamma, lift * scale]), turn
