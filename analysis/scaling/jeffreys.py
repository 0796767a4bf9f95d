"""The log likelihood with ½ log det of the expected information: what tests of contrasts and their intervals climb.

For Bradley and Terry's and Davidson's laws the term is Firth's [Firth1993]; for the others it is Jeffreys' prior too,
which bounds the strengths by any law without ties [Kosmidis2021]. The parameters x of one set of counts are the n
strengths, then the law's own parameter k, then the order effect, where there are such. With a pair's information
w of its difference d, u of k and c of both, and V their covariance, the term's slope is

    ½ (∂w/∂d V_dd + 2 ∂c/∂d V_dk + ∂u/∂d V_kk)

by d, and the sum of the same by k.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from analysis.scaling.counts import Counts
from analysis.scaling.laws import DAVIDSON, LOGISTIC, Law, Slopes
from analysis.scaling.newton import border_of
from documents.arrays import Flags, Floats, Indices

RIDGE = 1e-14
BESIDE = 1e-5  # apart, differences give slopes to about 1e-10, and the likelihood to the square of that
EXPONENTIAL = (LOGISTIC, DAVIDSON)  # whose information does not depend on the answers


@dataclass(frozen=True, slots=True, eq=False)
class Jeffreys:
    """The penalised likelihoods of B sets of counts under one law.

    Attributes
    ----------
    counts, law
        What was answered, and the law.
    basis
        Shape (n, p): what the strengths are free to do, columns that are orthonormal and sum to 0, for a law without
        further parameters; None if each item has a strength of its own.
    """

    counts: Counts
    law: Law = LOGISTIC
    basis: Floats | None = None

    @property
    def parameters(self) -> int:
        """How many numbers x has: n + f."""
        return self.counts.n + (self.law.parameter is not None) + self.counts.ordered

    def rows(self, rows: Indices | Flags) -> Jeffreys:
        """Return the likelihoods of some of the sets of counts, of some more than once."""
        counts = self.counts
        won, lost, tied = (part[rows] for part in (counts.won, counts.lost, counts.tied))
        return replace(self, counts=Counts(counts.n, counts.first, counts.second, won, lost, tied, counts.ordered))

    def value(self, x: Floats) -> Floats:
        """Return the penalised likelihood at ``x`` (B, n + f), up to a constant, shape (B,)."""
        d, k = self._differences(x)
        with np.errstate(all="ignore"):
            plain = self.law.log_likelihood(self.counts, d, k).sum(axis=1)
            information = self._information(self._expected(d, k))
            free = information[:, 1:, 1:] if self.basis is None else self.basis.T @ information @ self.basis
            return np.asarray(plain + np.linalg.slogdet(free)[1] / 2)

    def inverse(self, x: Floats) -> Floats:
        """Return the pseudo-inverses of the information on what is free, shape (B, n + f, n + f)."""
        n, information = self.counts.n, self._information(self._expected(*self._differences(x)))
        size = np.einsum("kii->k", information[:, :n, :n])[:, None, None] / n
        information += RIDGE * size * np.eye(self.parameters)  # far out some weights are no longer distinguished from 0
        if self.basis is not None:
            return np.asarray(self.basis @ np.linalg.inv(self.basis.T @ information @ self.basis) @ self.basis.T)
        # H + c·11ᵀ is regular, and its inverse less 1 / (c n²) · 11ᵀ is H's pseudo-inverse.
        information[:, :n, :n] += size / n
        inverse = np.linalg.inv(information)
        inverse[:, :n, :n] -= 1 / (size * n)
        return np.asarray(inverse)

    def slope(self, x: Floats, inverse: Floats) -> Floats:
        """Return the gradient at ``x`` (B, n + f), the inverse information there being ``inverse``."""
        counts = self.counts
        d, k = self._differences(x)
        slopes = self.law.slopes(counts, d, k)
        variance = np.diagonal(inverse, axis1=1, axis2=2)
        first, second = counts.first, counts.second
        # V_dd of each pair's difference d = θ_i − θ_j, with the order effect where there is one.
        apart = variance[:, first] + variance[:, second] - 2 * inverse[:, first, second]
        if counts.ordered:
            apart = apart + variance[:, -1:] + 2 * (inverse[:, first, -1] - inverse[:, second, -1])
        if self.law is LOGISTIC:
            # w = N p (1 − p), so ∂w/∂d = w (1 − 2p) = −w tanh(d / 2).
            by_d = slopes.d - slopes.dd * apart / 2 * np.tanh(d / 2)
            flows = counts.net_flows(by_d, exact=False)
            return np.c_[flows, by_d.sum(axis=1)] if counts.ordered else flows
        own = counts.n if self.law.parameter else None
        with_k, of_k = np.zeros_like(apart), np.zeros((len(x), 1))
        if own is not None:
            with_k, of_k = inverse[:, first, own] - inverse[:, second, own], variance[:, own : own + 1]
            if counts.ordered:
                with_k = with_k + inverse[:, own, -1:]

        def bent(ahead: Slopes, behind: Slopes) -> Floats:
            # ½ (∂w V_dd + 2 ∂c V_dk + ∂u V_kk), each ∂ by a central difference.
            both = zip(ahead[1:], behind[1:], (apart, None, 2 * with_k, of_k), strict=True)
            changes = [(one - other) * size for one, other, size in both if size is not None]
            return np.asarray(sum(changes) / (4 * BESIDE))

        by_d = slopes.d + bent(self._expected(d + BESIDE, k), self._expected(d - BESIDE, k))
        columns = [counts.net_flows(by_d, exact=False)]
        if own is not None:
            by_k = slopes.k + bent(self._expected(d, k + BESIDE), self._expected(d, k - BESIDE))
            columns.append(by_k.sum(axis=1, keepdims=True))
        if counts.ordered:
            columns.append(by_d.sum(axis=1, keepdims=True))
        return np.concatenate(columns, axis=1)

    def _differences(self, x: Floats) -> tuple[Floats, Floats | float]:
        """Return the differences (B, m) and the law's parameter (B, 1)."""
        n = self.counts.n
        k = x[:, n : n + 1] if self.law.parameter else 0.0
        return self.counts.differences(x[:, :n], x[:, -1:] if self.counts.ordered else 0.0), k

    def _expected(self, d: Floats, k: Floats | float) -> Slopes:
        """Return the expected information of each pair; the slopes are not to be read."""
        counts = self.counts
        if self.law not in EXPONENTIAL:
            won, lost, tied = (counts.total * chance for chance in self.law.probabilities(d, k))
            counts = Counts(counts.n, counts.first, counts.second, won, lost, tied, counts.ordered)
        return self.law.slopes(counts, d, k)

    def _information(self, of_pairs: Slopes) -> Floats:
        """Return the information of x, shape (B, n + f, n + f)."""
        counts, n = self.counts, self.counts.n
        weights = counts.matrix(of_pairs.dd)
        strengths: Floats = np.negative(weights, order="C")
        strengths.reshape(-1, n * n)[:, :: n + 1] = weights.sum(axis=2)
        if self.parameters == n:
            return strengths
        border, corner, _ = border_of(counts, self.law, of_pairs)
        upper = np.concatenate([strengths, border], axis=2)
        return np.concatenate([upper, np.concatenate([border.transpose(0, 2, 1), corner], axis=2)], axis=1)
