"""Penalised likelihoods, one fit at a time by a general optimiser: the twin of fast profiles.

`SlowProfile` is Firth's logistic regression; `SlowLaw` any law, by the chances of its answers alone.
With rows x_r of a design, of which w_r answers say yes and v_r say no, it is the maximum of
Σ w log p + v log (1 − p) + ½ log det Σ (w + v) p (1 − p) x xᵀ [Firth1993]; intervals are all values of one coefficient
at which twice the loss is below the quantile of χ² [Heinze2002].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize
from scipy.special import erf, expit, log_expit

from documents.arrays import Floats


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


CHANCES: dict[str, Callable[[Any, Any], tuple[Any, ...]]] = {
    "bradley-terry": lambda d, k: (1 / (1 + np.exp(-d)), 1 / (1 + np.exp(d))),
    "thurstone": lambda d, k: ((1 + erf(d / np.sqrt(2))) / 2, (1 - erf(d / np.sqrt(2))) / 2),
    "davidson": lambda d, k: tuple(
        w / (np.exp(d / 2) + np.exp(-d / 2) + np.exp(k)) for w in (np.exp(d / 2), np.exp(-d / 2), np.exp(k))
    ),
    "rao-kupper": lambda d, k: (
        1 / (1 + np.exp(k - d)),
        1 / (1 + np.exp(k + d)),
        (np.exp(2 * k) - 1) / (1 + np.exp(k - d)) / (1 + np.exp(k + d)),
    ),
}


@dataclass(frozen=True)
class SlowLaw:
    """The likelihood of answers (R, 2 or 3: first, second, neither) with Jeffreys' prior; d = ``design`` @ β.

    The expected information is Σ N Σ ∇p ∇pᵀ / p, its gradients by complex steps. With ``ties`` the last β is k.
    """

    law: str
    design: Floats
    answers: Floats
    ties: bool

    def chances(self, beta: Any) -> Any:
        """Return the chances of each answer, shape (R, 2 or 3)."""
        effects, k = (beta[:-1], beta[-1]) if self.ties else (beta, 0.0)
        d = self.design @ effects
        return np.stack(CHANCES[self.law](d, k + 0 * d), axis=1)

    def loss(self, beta: Floats) -> float:
        """Return the negative penalised log likelihood; of Rao and Kupper's law the last is log k."""
        if self.ties:
            beta = np.r_[beta[:-1], np.exp(beta[-1]) if self.law == "rao-kupper" else beta[-1]]
        p = self.chances(beta)
        steps = 1e-30j * np.eye(len(beta))
        slopes = np.stack([self.chances(beta + step).imag / 1e-30 for step in steps], axis=-1)
        total = self.answers.sum(axis=1)
        information = np.einsum("rck,rcl,rc->kl", slopes, slopes, total[:, None] / p)
        plain = float(np.where(self.answers > 0, self.answers * np.log(p), 0).sum())
        return -plain - float(np.linalg.slogdet(information)[1]) / 2

    def best(self) -> Floats:
        """Return where the likelihood is largest."""
        return _least(self.loss, np.zeros(self.design.shape[1] + self.ties))

    def root(self, value: float = 0.0) -> float:
        """Return the signed root of the likelihood ratio of the first coefficient's ``value``."""
        best = self.best()
        rest = _least(lambda rest: self.loss(np.r_[value, rest]), best[1:])
        lost = self.loss(np.r_[value, rest]) - self.loss(best)
        return float(np.sign(best[0] - value) * np.sqrt(max(0.0, 2 * lost)))


def _least(loss: Callable[[Floats], float], start: Floats) -> Floats:
    return np.asarray(minimize(loss, start, jac="3-point", method="BFGS", options={"gtol": 1e-6, "maxiter": 200}).x)


def of_law(law: str, answers: Floats, i: int, j: int, *, ordered: bool) -> SlowLaw:
    """Return the profile of θ_i − θ_j, of ``answers`` (n, n, 3): row shown first, preferred, beaten or neither.

    Who was shown first does not matter unless ``ordered``.
    """
    n, ties = len(answers), law in ("davidson", "rao-kupper")
    others = [i, *(item for item in range(n) if item not in (i, j))]  # θ_j = 0
    rows, given = [], []
    for first in range(n):
        for second in range(n):
            if answers[first, second].any():
                row = [float(item == first) - float(item == second) for item in others]
                rows.append([*row, 1.0] if ordered else row)
                given.append(answers[first, second, : 3 if ties else 2])
    return SlowLaw(law, np.array(rows), np.array(given), ties)
