"""Covariances clustered by observer that keep their level with few observers, many sets of strengths at once.

With observer s moving the strengths by d_s (n,), C the model's covariance and H its pseudo-inverse, there are

- the sandwich S = Σ d_s d_sᵀ: right whatever observers differ by, and very uncertain with few of them;
- the scaled covariance φ C, φ = tr(HS)/(n − 1): certain, and right if all contrasts vary by the same multiple of C;
- the shrinkage covariance V = (1 − λ) S + λ φ C between the two. λ minimises the expected squared distance to the truth
  [Ledoit2004], with the truth's own spread estimated as for normal data [Srivastava2005]:

      λ = (τ + t²)/ν / (q − t²/(n − 1)),  t = tr(HS), q = tr(HSHS), τ = ν²/((ν − 1)(ν + 2)) (q − t²/ν)

  with ν degrees of freedom, one less than observers if they answered alike, and is then multiplied by 1 − 2/(ν + 1):
  few observers cannot show that they differ about a few items only, and too large a λ then reports false differences
  (`benchmarks/interval_coverage.py`). With two observers the factor is that of three, 1/3: the sandwich of two is zero
  for every contrast about which they happen to agree, and reports false differences in 6 to 8 % of studies.

The degrees of freedom of a contrast's variance follow Satterthwaite [Satterthwaite1946]: twice the square of its mean
over its variance, by the moments of a Wishart matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from analysis.covariance.laplacian import contrast_variances
from documents.arrays import Floats

Clustered = Literal["shrinkage", "scaled", "sandwich"]
CLUSTERED: tuple[Clustered, ...] = get_args(Clustered)


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Covariances of B sets of n strengths, clustered by observer, and how certain they are.

    Attributes
    ----------
    kind
        Which of the three.
    covariance
        Shape (B, n, n): on strengths that sum to zero.
    model
        Shape (B, n, n) or (1, n, n): C.
    share, scale
        Shape (B,): λ (0 for the sandwich, 1 for the scaled covariance) and φ.
    freedom
        ν: one less than the number of observers, or than their effective number where some answered more.
    dimensions
        Shape (B,): estimate of tr(HΣ)²/tr((HΣ)²), Σ being the true covariance: n − 1 if all contrasts vary by the same
        multiple of C, 1 if one varies alone.
    best
        Shape (B, n, n): what draws of Σ start from: the shrinkage covariance; the scaled one for ``scaled``.
    """

    kind: Clustered
    covariance: Floats
    model: Floats
    share: Floats
    scale: Floats
    freedom: float
    dimensions: Floats
    best: Floats

    def degrees_of_freedom(self, contrasts: Floats | None = None, freedom: Floats | float | None = None) -> Floats:
        """Return the degrees of freedom of the variance of each contrast, shape (B, k); at most 1e6.

        Parameters
        ----------
        contrasts
            Shape (k, n), or (B, k, n): weights of the strengths; by default all pairs i < j in the order of
            ``numpy.triu_indices``, for which nothing of that size is made.
        freedom
            ν of each contrast, shape (k,), where they differ.
        """
        nu = self.freedom if freedom is None else freedom
        rank = self.model.shape[-1] - 1
        share = self.share[:, None]
        if self.kind == "sandwich":
            number = len(np.triu_indices(rank + 1, 1)[0]) if contrasts is None else contrasts.shape[-2]
            return np.broadcast_to(np.asarray(nu, dtype=np.float64), (len(self.covariance), number))
        if self.kind == "scaled":
            number = (rank + 1) * rank // 2 if contrasts is None else contrasts.shape[-2]
            return np.broadcast_to(nu * self.dimensions[:, None], (len(self.covariance), number))
        product = pseudo_inverses(self.model) @ self.covariance
        own, model, twice = (
            _variances(part, contrasts) for part in (self.covariance, self.model, self.covariance @ product)
        )
        squares = np.einsum("bij,bji->b", product, product)
        scaled = model**2 * squares[:, None] / rank**2
        spread = (1 - share) ** 2 * own**2 + share**2 * scaled + 2 * share * (1 - share) * model * twice / rank
        ratio = np.divide(own**2, spread, out=np.ones_like(own), where=spread > 0)
        return np.asarray(np.minimum(nu * ratio, MOST))

    def largest(self, samples: int, random: np.random.Generator) -> Floats:
        """Draw the largest |t| of all pairs when no two strengths differ, ascending; shape (samples,). B is 1.

        Each draw has its own estimates and its own covariance, estimated from ν normal contributions as this one was
        from observers': the largest |t| is then as far out as it is in a study.
        """
        rank = self.model.shape[-1] - 1
        draws = max(2, round(self.freedom))
        values, vectors = np.linalg.eigh(self.best[0])
        root = vectors[:, 1:] * np.sqrt(np.maximum(values[1:], 0))
        information = pseudo_inverses(self.model)
        largest = np.empty(samples)
        size = max(1, BLOCK_NUMBERS // ((rank + 1) * max(rank + 1, draws)))
        for start in range(0, samples, size):
            many = min(size, samples - start)
            theta = random.standard_normal((many, rank)) @ root.T
            pulled = random.standard_normal((many, draws, rank)) @ (root.T / np.sqrt(draws))
            own = shrink(self.model, pulled, self.kind, freedom=draws, information=information)
            error = np.sqrt(contrast_variances(own.covariance))
            apart = np.abs(theta[:, :, None] - theta[:, None, :])
            t = np.divide(apart, error, out=np.zeros_like(apart), where=error > 0)
            largest[start : start + many] = t.max(axis=(1, 2))
        return np.sort(largest)


MOST = 1e6
BLOCK_NUMBERS = 2_000_000


def shrink(
    model: Floats,
    pulled: Floats,
    kind: Clustered = "shrinkage",
    *,
    freedom: float,
    information: Floats | None = None,
    products: Floats | None = None,
    at_least_model: bool = False,
) -> Spread:
    """Return the covariance of ``kind`` of B sets of strengths.

    Parameters
    ----------
    model
        Shape (B, n, n) or (1, n, n): C, on strengths that sum to zero.
    pulled
        Shape (B, S, n): d_s of each observer, corrected for their number, so that S = Σ d_s d_sᵀ.
    freedom
        ν, above zero.
    information
        Shape as ``model``: H, if it is at hand.
    products
        Shape (B, S, S): d_s H d_t of every two observers, or (B, n, n): H S, if they are at hand.
    at_least_model
        Take φ for 1 where it is below: answers vary at least as the law says.
    """
    n = model.shape[-1]
    rank = n - 1
    if products is None:
        information = pseudo_inverses(model) if information is None else information
        few = pulled.shape[1] <= n
        products = pulled @ information @ pulled.transpose(0, 2, 1) if few else information @ _squared(pulled)
    trace, square = np.einsum("bss->b", products), np.einsum("bst,bts->b", products, products)
    nu = max(freedom, 1.0)
    even = trace**2 / rank  # the least that tr((HΣ)²) can be, if all contrasts vary alike; trace² is the most
    correction = nu**2 / ((nu - 1) * (nu + 2)) if nu > 1 else np.inf
    with np.errstate(invalid="ignore"):
        squares = np.clip(np.nan_to_num(correction * (square - trace**2 / nu), posinf=np.inf), even, trace**2)
    dimensions = np.divide(trace**2, squares, out=np.full_like(trace, rank), where=squares > 0)
    scale = trace / rank
    if at_least_model:
        scale = np.maximum(scale, 1.0)
    distance = square - even
    share = np.divide((squares + trace**2) / nu, distance, out=np.ones_like(trace), where=distance > 0)
    share = np.minimum(share, 1.0) * (1 - 2 / max(nu + 1, 3.0))
    scaled = scale[:, None, None] * model
    if kind == "scaled":
        return Spread(kind, scaled, model, np.ones_like(share), scale, nu, dimensions, scaled)
    spread = _squared(pulled)
    best = (1 - share)[:, None, None] * spread + share[:, None, None] * scaled
    if kind == "sandwich":
        return Spread(kind, spread, model, np.zeros_like(share), scale, nu, dimensions, best)
    return Spread(kind, best, model, share, scale, nu, dimensions, best)


def _squared(pulled: Floats) -> Floats:
    return np.asarray(pulled.transpose(0, 2, 1) @ pulled)


def pseudo_inverses(covariance: Floats) -> Floats:
    """Return the pseudo-inverses of covariances of strengths that sum to zero. Shape (B, n, n)."""
    n = covariance.shape[-1]
    size = np.einsum("bii->b", covariance)[:, None, None] / n
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.inv(covariance + size / n)
    inverse = inverse - 1 / (size * n)
    return np.asarray((inverse + inverse.transpose(0, 2, 1)) / 2)


def _variances(matrix: Floats, contrasts: Floats | None) -> Floats:
    if contrasts is not None:
        return np.asarray(((contrasts @ matrix) * contrasts).sum(axis=-1))
    first, second = np.triu_indices(matrix.shape[-1], 1)
    return contrast_variances(matrix)[:, first, second]
