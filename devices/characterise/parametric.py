"""Matrix, black and GOGO curves fitted together, for what the eye sees.

The primary matrix, the black and the free numbers of the three curves minimise the differences of all patches, each
measured as ΔE00 near the colour, with a loss that grows linearly for large ones (soft L1 at 1 ΔE00), so that one wrong
reading does not bend the model. The last offset of `ggo` and `gogo`, c in each channel, is the black M·c: a term of the
display model, in which black is then within reach of the codes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devices.characterise.channel_fit import Kind
from devices.characterise.descent import descend
from devices.characterise.patches import Patches
from devices.display.curves import ToneCurve
from devices.display.model import DisplayModel
from documents.arrays import Floats

# Eigenvalues of JᵀJ are exact to about 1e-15 of the largest: down to here, conditions to a thousandth.
_SMALL_EIGENVALUE = 1e-12

# Which of the curves' offsets and gammas are free, and whether there is a black. The gain is 1 − offset: the matrix
# carries the light of full drive.
_FREE: dict[Kind, tuple[bool, bool, bool]] = {
    "gamma": (False, True, False),
    "gog": (True, True, False),
    "ggo": (False, True, True),
    "gogo": (True, True, True),
}
_OFFSET, _GAMMA = (-0.5, 0.8), (0.3, 6.0)
# A black above this share of white is no black.
_MOST_BLACK = 0.5
_TINY = 1e-12
_COLOURS = ("red", "green", "blue")


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A fitted display model, with the numbers that were free and how well the readings determine them.

    ``condition`` is that of the Jacobian with columns of unit length. ``standard_errors`` names each free number of
    the curves, as ``red.gamma``; it is empty where there are too few readings for them.
    """

    model: DisplayModel
    free_numbers: int
    condition: float
    standard_errors: dict[str, float]
    at_bound: tuple[str, ...]


def fit_parametric(
    patches: Patches, kind: Kind, start: Floats | None = None, *, judged: bool = True
) -> tuple[Fitted, Floats]:
    """Fit ``kind``; return it and its numbers, which may ``start`` the fit to nearly the same patches.

    Condition and standard errors are found only where the fit is to be ``judged``.
    """
    problem = _Problem(patches, kind)
    p = descend(
        problem.residuals,
        problem.jacobian,
        problem.start() if start is None else start,
        bounds=problem.bounds(),
        last_gain=1e-8 if start is not None else 1e-13,
        steps=25 if start is not None else 100,
    )
    return problem.fitted(p, judged), p


class _Problem:
    """The numbers: matrix (9), offsets (3 or none), gammas (3), black (3 or none); light is in units of white's Y."""

    def __init__(self, patches: Patches, kind: Kind) -> None:
        self.patches = patches
        self.unit = float(patches.white[1])
        self.has_offset, _, self.has_black = _FREE[kind]
        self.gamma_at = 12 if self.has_offset else 9
        self.black_at = self.gamma_at + 3
        self.size = self.black_at + (3 if self.has_black else 0)

    def bounds(self) -> tuple[Floats, Floats]:
        low, high = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        if self.has_offset:
            low[9:12], high[9:12] = _OFFSET
        low[self.gamma_at : self.black_at], high[self.gamma_at : self.black_at] = _GAMMA
        low[self.black_at :], high[self.black_at :] = 0.0, _MOST_BLACK
        return low, high

    def start(self) -> Floats:
        """The gamma, alike for all channels, with which the best matrix leaves the least; then its numbers."""
        chances = []
        for gamma in (1.0, 1.4, 1.8, 2.2, 2.6, 3.2):
            black = np.clip(self.patches.black / self.unit, 1e-6, 0.1) if self.has_black else np.zeros(3)
            M = robust_matrix(self.patches.codes**gamma, self.patches.XYZ / self.unit - black)
            p = np.zeros(self.size)
            p[:9], p[self.gamma_at : self.black_at] = M.ravel(), gamma
            p[self.black_at :] = black[: self.size - self.black_at]
            chances.append((float(np.abs(self.residuals(p)).sum()), p))
        return min(chances, key=lambda chance: chance[0])[1]

    def parts(self, p: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        offset = p[9:12] if self.has_offset else np.zeros(3)
        black = p[self.black_at :] if self.has_black else np.zeros(3)
        return p[:9].reshape(3, 3), offset, p[self.gamma_at : self.black_at], black

    def light(self, offset: Floats, gamma: Floats) -> tuple[Floats, Floats, Floats]:
        """Light (n, 3), and its derivatives by its channel's offset and gamma."""
        codes = self.patches.codes
        drive = np.maximum((1.0 - offset) * codes + offset, 0.0)
        lit = drive > _TINY
        safe = np.where(lit, drive, 1.0)
        power = np.where(lit, safe**gamma, 0.0)
        return power, np.where(lit, gamma * power / safe, 0.0) * (1.0 - codes), power * np.log(safe)

    def residuals(self, p: Floats) -> Floats:
        M, offset, gamma, black = self.parts(p)
        light, _, _ = self.light(offset, gamma)
        return self.patches.residuals(self.unit * (black + light @ M.T)).ravel()

    def jacobian(self, p: Floats) -> Floats:
        M, offset, gamma, black = self.parts(p)
        light, by_offset, by_gamma = self.light(offset, gamma)
        A = self.patches.slopes(self.unit * (black + light @ M.T)) * self.unit
        by_light = A @ M  # (n, 3, 3): by each channel's light
        n = len(light)
        blocks = [(A[:, :, :, None] * light[:, None, None, :]).reshape(3 * n, 9)]
        if self.has_offset:
            blocks.append((by_light * by_offset[:, None, :]).reshape(3 * n, 3))
        blocks.append((by_light * by_gamma[:, None, :]).reshape(3 * n, 3))
        if self.has_black:
            blocks.append(A.reshape(3 * n, 3))
        return np.concatenate(blocks, axis=1)

    def names(self) -> list[str]:
        """The names of the numbers after the matrix."""
        names = [f"{c}.offset" for c in _COLOURS] if self.has_offset else []
        names += [f"{c}.gamma" for c in _COLOURS]
        return names + ([f"black.{axis}" for axis in "XYZ"] if self.has_black else [])

    def fitted(self, p: Floats, judged: bool) -> Fitted:
        M, offset, gamma, black = self.parts(p)
        red, green, blue = (ToneCurve(1.0 - b, b, g) for b, g in zip(offset.tolist(), gamma.tolist(), strict=True))
        model = DisplayModel(self.unit * black, self.unit * M, (red, green, blue))
        if not judged:
            return Fitted(model, self.size, 0.0, {}, ())
        J = self.jacobian(p)
        condition = condition_of(J)
        names = self.names()
        errors: dict[str, float] = {}
        spare = J.shape[0] - J.shape[1]
        if spare > 0 and np.isfinite(condition):
            left = np.abs(self.residuals(p))
            variance = (1.4826 * float(np.median(left))) ** 2 * J.shape[0] / spare
            deviations = np.sqrt(np.maximum(np.diag(np.linalg.pinv(J.T @ J)) * variance, 0.0))[9:]
            deviations[self.black_at - 9 :] *= self.unit
            errors = dict(zip(names, deviations.tolist(), strict=True))
        low, high = self.bounds()
        edge = ((p - low < 1e-6) & (low != 0)) | (high - p < 1e-6)  # a black of 0 is a black, not an edge
        return Fitted(model, self.size, condition, errors, tuple(np.array(names)[edge[9:]].tolist()))


def condition_of(J: Floats) -> float:
    """Return the condition of a Jacobian with its columns brought to unit length; infinite where one is 0.

    From the eigenvalues of JᵀJ, many times as fast as singular values; these where the condition is large.
    """
    norms = np.linalg.norm(J, axis=0)
    if not np.all(norms > 0):
        return float("inf")
    unit = J / norms
    eigenvalues = np.linalg.eigvalsh(unit.T @ unit)
    if eigenvalues[0] > _SMALL_EIGENVALUE * eigenvalues[-1]:
        return float(np.sqrt(eigenvalues[-1] / eigenvalues[0]))
    return float(np.linalg.cond(unit))


def robust_matrix(light: Floats, XYZ: Floats) -> Floats:
    """Return M (3, 3) with XYZ ≈ light · Mᵀ, both (n, 3), in least absolute distances, reweighted six times."""
    weight = np.ones(len(light))
    M: Floats = np.eye(3)
    for _ in range(6):
        M = np.asarray(np.linalg.lstsq(light * weight[:, None], XYZ * weight[:, None], rcond=None)[0].T)
        distance = np.linalg.norm(XYZ - light @ M.T, axis=1)
        weight = 1.0 / np.sqrt(np.maximum(distance, 1e-4 * np.abs(XYZ).max()))
    return M
