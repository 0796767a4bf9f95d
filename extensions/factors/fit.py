"""Fit strengths θ = X β by `analysis.scaling.newton`: X made of the terms of factors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.scaling import LOGISTIC, Columns, Counts, Gaussian, NoPenalty, maximise
from documents.arrays import Floats
from extensions.factors.aliasing import orthonormal
from extensions.factors.terms import Term


@dataclass(frozen=True, slots=True, eq=False)
class TermsFit:
    """Where the maximum lies, in coordinates γ of an orthonormal basis Q of the terms' columns: θ = Q γ.

    Attributes
    ----------
    basis
        Shape (n, p): Q.
    theta
        Shape (n,): strengths in nats, mean 0.
    pair_terms
        Shape (m,): log likelihood of each pair, without binomial coefficients.
    inverse
        Shape (p, p): inverse of the information of γ, or of the posterior's curvature.
    converged, iterations
        Whether the last step was below the tolerance; Newton steps taken.
    """

    basis: Floats
    theta: Floats
    pair_terms: Floats
    inverse: Floats
    converged: bool
    iterations: int

    @property
    def gamma(self) -> Floats:
        """Shape (p,): coordinates in the basis, in nats."""
        return np.asarray(self.basis.T @ self.theta)

    @property
    def covariance(self) -> Floats:
        """Shape (n, n): of θ, by the model."""
        return np.asarray(self.basis @ self.inverse @ self.basis.T)

    @property
    def log_likelihood(self) -> float:
        """Σ W log p."""
        return float(self.pair_terms.sum())


def centred_basis(terms: Sequence[Term], n: int) -> Floats:
    """Return an orthonormal basis, shape (n, p), of the terms' columns, each less its mean."""
    if not terms:
        return np.empty((n, 0))
    columns = np.hstack([term.columns for term in terms])
    return orthonormal(columns - columns.mean(axis=0))


def fit_terms(counts: Counts, terms: Sequence[Term], prior_sd: float | None = None) -> TermsFit:
    """Maximise the likelihood of ``counts``, a batch of one, or the posterior; the maximum must exist.

    Parameters
    ----------
    terms
        Whose columns span the strengths; none for strengths that are all equal.
    prior_sd
        σ in nats of a Gaussian prior on each strength, above zero; None for no prior.
    """
    design = Columns(centred_basis(terms, counts.n))
    penalty = NoPenalty() if prior_sd is None else Gaussian.of_sd(prior_sd)
    top = maximise(counts, penalty=penalty, design=design)
    difference = counts.differences(top.theta)
    weight = LOGISTIC.slopes(counts, difference, 0.0).dd
    return TermsFit(
        basis=design.basis,
        theta=top.theta[0],
        pair_terms=LOGISTIC.log_likelihood(counts, difference, 0.0)[0],
        inverse=design.inverse(counts, weight, penalty.precision)[0],
        converged=bool(top.converged[0]),
        iterations=int(top.iterations[0]),
    )
