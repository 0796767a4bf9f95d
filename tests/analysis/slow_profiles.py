"""Firth's penalised logistic regression, one fit at a time by a general optimiser: the twin of fast profiles.

With rows x_r of a design, of which w_r answers say yes and v_r say no, it is the maximum of
Σ w log p + v log (1 − p) + ½ log det Σ (w + v) p (1 − p) x xᵀ [Firth1993]; intervals are all values of one coefficient
at which twice the loss is below the quantile of χ² [Heinze2002].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize
from scipy.special import expit, log_expit

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SlowProfile:
    """Profiles of the coefficient in the first column of ``design`` (R, k), with ``yes`` and ``no`` (R,) answers."""

    design: Floats
    yes: Floats
    no: Floats

    def loss(self, beta: Floats) -> float:
        """Return the negative penalised log likelihood."""
        d = self.design @ beta
        weight = (self.yes + self.no) * expit(d) * expit(-d)
        information = (self.design * weight[:, None]).T @ self.design
        plain = self.yes @ log_expit(d) + self.no @ log_expit(-d)
        return float(-(plain + np.linalg.slogdet(information)[1] / 2))

    def slope(self, beta: Floats) -> Floats:
        """Return the gradient of `loss`."""
        d = self.design @ beta
        p, total = expit(d), self.yes + self.no
        weight = total * p * (1 - p)
        inverse = np.linalg.inv((self.design * weight[:, None]).T @ self.design)
        leverage = weight * np.einsum("rk,kl,rl->r", self.design, inverse, self.design)
        return np.asarray(-self.design.T @ (self.yes - total * p + leverage * (0.5 - p)))

    def best(self) -> Floats:
        """Return the coefficients of the maximum, shape (k,)."""
        start = np.zeros(self.design.shape[1])
        found = minimize(self.loss, start, jac=self.slope, method="BFGS", tol=1e-9)
        return np.asarray(found.x)

    def lost(self, value: float, best: Floats) -> float:
        """Return twice what the likelihood loses where the first coefficient is ``value``."""

        def full(rest: Floats) -> Floats:
            return np.asarray(np.r_[value, rest])

        def loss(rest: Floats) -> float:
            return self.loss(full(rest))

        def slope(rest: Floats) -> Floats:
            return np.asarray(self.slope(full(rest))[1:])

        if len(best) == 1:
            return 2 * (self.loss(np.array([value])) - self.loss(best))
        found = minimize(loss, best[1:], jac=slope, method="BFGS", tol=1e-9)
        return 2 * (float(found.fun) - self.loss(best))

    def root(self, value: float = 0.0) -> float:
        """Return the signed root of the likelihood ratio of ``value``; positive where the estimate is above it."""
        best = self.best()
        return float(np.sign(best[0] - value) * np.sqrt(max(0.0, self.lost(value, best))))

    def interval(self, reach: float) -> tuple[float, float]:
        """Return where the signed root is ``reach`` and -``reach``."""
        best = self.best()

        def end(side: float) -> float:
            far = 1.0
            while self.lost(best[0] + side * far, best) < reach**2:
                far *= 2
            return float(
                brentq(lambda off: self.lost(best[0] + side * off, best) - reach**2, 0.0, far, xtol=1e-11, rtol=1e-13)
            )

        return float(best[0]) - end(-1), float(best[0]) + end(1)


def of_pair(wins: Floats, i: int, j: int) -> SlowProfile:
    """Return the profile of θ_i − θ_j, of counts ``wins`` (n, n): row i over column j."""
    n = len(wins)
    rows, yes, no = [], [], []
    others = [i, *(item for item in range(n) if item not in (i, j))]  # θ_j = 0
    for first in range(n):
        for second in range(first + 1, n):
            if wins[first, second] + wins[second, first]:
                rows.append([float(item == first) - float(item == second) for item in others])
                yes.append(wins[first, second])
                no.append(wins[second, first])
    return SlowProfile(np.array(rows), np.array(yes), np.array(no))
