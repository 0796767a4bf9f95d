"""What is added to the log likelihood so that strengths stay finite: nothing, Firth's term, or a Gaussian prior.

- `Firth` [Firth1993] adds ½ log det H on the vectors that sum to zero (Jeffreys' prior), for the Bradley-Terry model.
  Its gradient is that of the plain likelihood with h/2 wins added on both sides of each pair, the pair's leverage being
  h_ij = v_ij var(θ_i − θ_j): the fit is a sequence of plain Newton steps on counts that are updated with θ.
- `Gaussian` adds −Σ θ² / (2 σ²): each strength is normal about 0 with standard deviation σ. On strengths that sum to
  zero the curvature is I/σ², which is 1/(n σ²) added to the weight of every pair.

The covariance of a penalised fit is the inverse of the curvature on the vectors that sum to zero, as without a
penalty: with a Gaussian prior it is (H + I/σ²)⁻¹ less σ²/n in every entry, the variance of the mean strength. Answers
say nothing about that mean; only differences of strengths are identified [Firth2004], and their variances are the same
either way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.covariance import laplacian
from analysis.scaling.counts import Counts
from analysis.scaling.laws import Slopes
from documents.arrays import Floats


class Penalty(Protocol):
    """A term beside the log likelihood, and when a fit with it has converged."""

    @property
    def precision(self) -> float:
        """1/σ², what each strength's own information gains."""
        ...

    @property
    def most_iterations(self) -> int:
        """Newton steps after which a fit stops without having converged."""
        ...

    @property
    def has_constant_curvature(self) -> bool:
        """Whether the term is quadratic in the strengths, or nothing."""
        ...

    def slopes(self, counts: Counts, d: Floats, slopes: Slopes) -> Slopes:
        """Return the slopes of the penalised likelihood from those of the plain one at differences ``d`` (B, m)."""
        ...

    def value(self, counts: Counts, theta: Floats, slopes: Callable[[], Slopes]) -> Floats:
        """Return what is added to the log likelihood at ``theta`` (B, n), shape (B,), up to a constant."""
        ...

    def slack(self, size: Floats) -> Floats:
        """Return by how much a value of ``size`` (B,), Σ|terms|, may fall by rounding alone."""
        ...

    def has_settled(self, size: Floats, last_size: Floats) -> NDArray[np.bool_]:
        """Say whether steps of ``size``, relative to θ where that is above 1, mean convergence.

        ``last_size`` is NaN at the first step.
        """
        ...


@dataclass(frozen=True, slots=True)
class NoPenalty:
    """The plain likelihood.

    A fit has converged once the largest entry of a step is below 1e-10; or below 1e-6 and the next, by the last two,
    would be below 1e-14, since Newton's steps shrink quadratically; or below 1e-6 and no longer halved: rounding then
    is all that moves it, as happens where an item won against one that is stronger by far.
    """

    precision: float = 0.0
    most_iterations: int = 200
    has_constant_curvature: bool = True

    def slopes(self, counts: Counts, d: Floats, slopes: Slopes) -> Slopes:
        """Return the slopes as they are."""
        return slopes

    def value(self, counts: Counts, theta: Floats, slopes: Callable[[], Slopes]) -> Floats:
        """Return 0."""
        return np.zeros(len(theta))

    def slack(self, size: Floats) -> Floats:
        """Return some units in the last place."""
        return 1e-14 * size

    def has_settled(self, size: Floats, last_size: Floats) -> NDArray[np.bool_]:
        """Newton's steps shrink fast: those that do not are rounding."""
        small: NDArray[np.bool_] = size <= 1e-6
        if not small.any():
            return small
        rounding, shrinking = size > last_size / 2, size * size * size <= 1e-14 * last_size * last_size
        return (size <= 1e-10) | (small & (rounding | shrinking))


@dataclass(frozen=True, slots=True)
class Gaussian(NoPenalty):
    """A normal prior on each strength; ``precision`` is 1/σ², σ in the units of the strengths."""

    @classmethod
    def of_sd(cls, prior_sd: float) -> Gaussian:
        """Return the prior with standard deviation ``prior_sd``, above zero."""
        return cls(prior_sd**-2)

    def value(self, counts: Counts, theta: Floats, slopes: Callable[[], Slopes]) -> Floats:
        """Return −Σ θ² / (2 σ²)."""
        return np.asarray(-(theta**2).sum(axis=1) * (self.precision / 2))


@dataclass(frozen=True, slots=True)
class Firth(NoPenalty):
    """Firth's penalty, for `analysis.scaling.laws.Logistic` and counts without order."""

    most_iterations: int = 1000
    has_constant_curvature: bool = False

    def slopes(self, counts: Counts, d: Floats, slopes: Slopes) -> Slopes:
        """Return the slopes with half the leverage of each pair as further wins on both sides."""
        weight = slopes.dd
        spread = laplacian.contrast_variances(laplacian.pseudo_inverse(counts.matrix(weight)))
        leverage = weight * spread[:, counts.first, counts.second]
        total = counts.total
        more = np.divide(leverage * weight, total, out=np.zeros_like(weight), where=total > 0)
        return Slopes(slopes.d - leverage / 2 * np.tanh(d / 2), weight + more)

    def value(self, counts: Counts, theta: Floats, slopes: Callable[[], Slopes]) -> Floats:
        """Return ½ log det H, the determinant taken on the vectors that sum to zero."""
        weights = counts.matrix(slopes().dd)
        information: Floats = np.negative(weights, order="C")
        n = counts.n
        information.reshape(-1, n * n)[:, :: n + 1] = weights.sum(axis=2)
        # Leaving out one row and column divides the determinant by n, a constant.
        return np.asarray(np.linalg.slogdet(information[:, 1:, 1:])[1] / 2)

    def slack(self, size: Floats) -> Floats:
        """Return more than rounding of the likelihood: the determinant is less exact."""
        return 1e-12 * (1 + size)

    def has_settled(self, size: Floats, last_size: Floats) -> NDArray[np.bool_]:
        """Steps shrink by a constant factor at the end, so they are followed down to rounding.

        Beside pairs compared 1e9 times and separated, rounding alone makes steps of 1e-9.
        """
        return np.asarray((size <= 1e-12) | ((size <= 1e-8) & (size >= last_size)))


NO_PENALTY: Penalty = NoPenalty()
FIRTH: Penalty = Firth()
