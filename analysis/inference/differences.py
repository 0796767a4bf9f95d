"""Differences of strengths of every two items, with standard errors and degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.scaling.laplacian import contrast_variances
from analysis.scaling.result import Fit
from analysis.scaling.scores import Scores
from analysis.scaling.terminal import problem_lines
from documents import Finding

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Differences:
    """θ_i − θ_j of P pairs of items, the better one first.

    Attributes
    ----------
    first, second
        Shape (P,): indices of the items; pairs run through the items best first.
    estimate, se
        Shape (P,): in the units of the strengths. ``se`` is 0 where all observers agree, so that nothing is known of
        how much other observers would vary.
    df
        Shape (P,): degrees of freedom of ``se``; None where they are as good as known.
    """

    first: Indices
    second: Indices
    estimate: Floats
    se: Floats
    df: Floats | None

    def above(self, bound: float) -> Floats:
        """Return the one-sided p values, shape (P,), of the hypotheses that the differences are at most ``bound``."""
        return self._upper_tail(self.estimate - bound)

    def below(self, bound: float) -> Floats:
        """Return the one-sided p values, shape (P,), of the hypotheses that the differences are at least ``bound``."""
        return self._upper_tail(bound - self.estimate)

    def _upper_tail(self, distance: Floats) -> Floats:
        from scipy.special import ndtr, stdtr

        known = self.se > 0
        z = np.divide(distance, self.se, out=np.zeros_like(distance), where=known)
        tail = ndtr(-z) if self.df is None else stdtr(self.df, -z)
        return np.where(known, tail, 1.0)  # no spread is no evidence


def differences(scores: Scores) -> Differences:
    """Return the differences of every two items of ``scores``.

    Raises
    ------
    ResultsError
        If there are no finite strengths.
    """
    check_fitted(scores)
    fit = scores.fit
    order = np.array(scores.order, dtype=np.intp)
    better, worse = np.triu_indices(len(order), 1)
    first, second = order[better], order[worse]
    se = np.sqrt(contrast_variances(fit.covariance)[first, second])
    return Differences(first, second, fit.theta[first] - fit.theta[second], se, _freedom(fit, first, second))


def check_fitted(scores: Scores) -> None:
    """Raise ResultsError unless all strengths are finite."""
    if scores.fit.separation is not None or not np.isfinite(scores.fit.theta).all():
        remedy = problem_lines(scores)[-1].strip()
        raise ResultsError(Finding("the items are separated: there are no finite strengths to compare", remedy=remedy))


def _freedom(fit: Fit, first: Indices, second: Indices) -> Floats | None:
    """Return the degrees of freedom of each pair, shape (P,); None for the model's standard errors."""
    if fit.pair_freedom is None:
        return None
    n = fit.counts.n
    of_pair = np.zeros((n, n))
    of_pair[np.triu_indices(n, 1)] = fit.pair_freedom
    return np.asarray(of_pair[np.minimum(first, second), np.maximum(first, second)])


def quantile(level: float, df: Floats | None) -> Floats | float:
    """Return how many standard errors an interval with confidence ``level`` (0 to 1) reaches to either side."""
    from scipy.special import ndtri, stdtrit

    upper = (1 + level) / 2
    return float(ndtri(upper)) if df is None else np.asarray(stdtrit(df, upper))
