"""One channel's curve from pairs of code and light, by nonlinear least squares (thesis Expressions 3.4 to 3.7, 3.14).

Forward, light = (gain·code + offset)^gamma + lift; inverse, code = gain·((light − lift)^gamma − offset). Light is
divided by its largest value first, and the curve is fitted by what it gives at full drive, its offset, gamma and lift,
which keeps the problem alike for every unit and lets it converge from poor starts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

Floats = NDArray[np.float64]
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
    codes, lights = np.asarray(code, dtype=np.float64), np.asarray(light, dtype=np.float64)
    free = np.array(FREE[kind])
    if codes.shape != lights.shape or codes.ndim != 1:
        raise DeviceError(f"codes and light must be two equally long lists, not {codes.shape} and {lights.shape}")
    if not (np.all(np.isfinite(codes)) and np.all(np.isfinite(lights))):
        raise DeviceError("codes and light must be finite")
    if len(np.unique(codes)) <= free.sum():
        raise DeviceError(f"{kind} needs more than {free.sum()} different codes; there are {len(np.unique(codes))}")
    full = float(lights.max())
    if full <= 0:
        raise DeviceError("the channel gives no light")
    scale = full if kind != "gamma" else 1.0  # the simple gamma has no gain that could carry a unit
    x, y = (lights / scale, codes) if inverse else (codes, lights / scale)
    problem = _inverse_problem if inverse else _forward_problem
    best = None
    typical = np.array([start_gamma]) if start_gamma else np.array([1.0, 1.8, 2.6])
    for gamma in 1.0 / typical if inverse and not start_gamma else typical:
        result = _least_squares(problem, x, y, free, np.array([1.0, 0.0, gamma, 0.0]))
        if best is None or result.cost < best.cost:
            best = result
        if best.cost < 1e-24 * len(x):
            break
    assert best is not None
    return _channel_fit(best, problem, x, y, free, kind, inverse, scale)


def _forward_problem(p: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Light and its derivatives (n, 4) by drive at full code, offset, gamma and lift."""
    full, offset, gamma, lift = p
    drive = np.maximum((full - offset) * x + offset, 0.0)
    lit = drive > _TINY
    safe = np.where(lit, drive, 1.0)
    power = np.where(lit, safe**gamma, 0.0)
    slope = np.where(lit, gamma * power / safe, 0.0)
    return power + lift, np.stack([slope * x, slope * (1.0 - x), power * np.log(safe), np.ones_like(x)], axis=1)


def _inverse_problem(p: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Code and its derivatives (n, 4) by gain, offset, gamma and lift."""
    gain, offset, gamma, lift = p
    drive = np.maximum(x - lift, 0.0)
    lit = drive > _TINY
    safe = np.where(lit, drive, 1.0)
    power = np.where(lit, safe**gamma, 0.0)
    by_lift = np.where(lit, -gain * gamma * power / safe, 0.0)
    return gain * (power - offset), np.stack(
        [power - offset, np.full_like(x, -gain), gain * power * np.log(safe), by_lift], axis=1
    )


def _least_squares(problem: _Problem, x: Floats, y: Floats, free: NDArray[np.bool_], start: Floats) -> OptimizeResult:
    from scipy.optimize import least_squares

    def whole(p: Floats) -> Floats:
        q = start.copy()
        q[free] = p
        return q

    def residuals(p: Floats) -> Floats:
        return np.asarray(problem(whole(p), x)[0] - y)

    def jacobian(p: Floats) -> Floats:
        return np.asarray(problem(whole(p), x)[1][:, free])

    return least_squares(
        residuals,
        np.clip(start, _LOW, _HIGH)[free],
        jac=jacobian,
        bounds=(_LOW[free], _HIGH[free]),
        x_scale="jac",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
        max_nfev=200,
    )


def _channel_fit(
    result: OptimizeResult,
    problem: _Problem,
    x: Floats,
    y: Floats,
    free: NDArray[np.bool_],
    kind: Kind,
    inverse: bool,
    scale: float,
) -> ChannelFit:
    p = np.array([1.0, 0.0, 1.0, 0.0])
    p[free] = result.x
    predicted, jacobian = problem(p, x)
    jacobian = jacobian[:, free]
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
    edge = (np.abs(result.x - _LOW[free]) < 1e-6) | (np.abs(result.x - _HIGH[free]) < 1e-6)
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
