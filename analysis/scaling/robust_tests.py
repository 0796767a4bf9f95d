"""Tests of any restrictions that stay right where one observer's answers depend on each other: a score bootstrap.

A plain likelihood-ratio or score test counts every answer as new evidence. Where observers differ in taste it rejects
true hypotheses far too often, whatever the number of observers. Here the observer is the unit. With u_g the slope of
observer g's log likelihood at the fit that obeys the q restrictions R φ = 0, and A the inverse information there,

    x_g = (R A Rᵀ)^−½ R A u_g,  T = |Σ x_g|²

is the score statistic, Pearson's where the restrictions leave one parameter per pair. Its law under the hypothesis is
that of T* = |Σ w_g x_g|² with random weights w_g [Kline2012], here the six of mean 0 and variance 1 that serve few
observers best [Webb2023]. No covariance of q numbers is inverted, so that there may be more restrictions than
observers. T depends on the weights only through the inner products of the x_g, which is all that is kept of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents.text import json_fields

Floats = NDArray[np.float64]

FEWEST_OBSERVERS = 5
MOST_FOR_ALL_DRAWS = 200
DRAWS, DRAWS_OF_MANY, SEED = 9999, 1999, 0
WEBB: Floats = np.sqrt(np.array([0.5, 1.0, 1.5])) * np.array([[-1.0], [1.0]])
TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class ObserverTest:
    """Test with the observer as the unit.

    Attributes
    ----------
    statistic, df
        Score statistic T and the number of restrictions; T has a χ² distribution only if all answers are independent.
    p
        Chance of as much by accident if observers are a random sample, by bootstrap over observers; at least 0.0001,
        or 0.0005 above 200 observers. The draws are always the same.
    observers
        How many observers gave answers.
    """

    statistic: float
    df: int
    p: float
    observers: int

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return json_fields(self)


def score_test(slopes: Floats, inverse: Floats, restrictions: Floats) -> ObserverTest | None:
    """Test that R φ = 0.

    Parameters
    ----------
    slopes
        Shape (G, p): the slope of each observer's log likelihood by the p parameters φ, at the restricted fit.
    inverse
        Shape (p, p): inverse of the information of φ there, or its pseudo-inverse where φ sums to zero.
    restrictions
        Shape (q, p): R.

    Returns
    -------
    ObserverTest | None
        None with fewer than five observers, of whom the bootstrap never rejects at the level 0.05.
    """
    along = restrictions @ inverse
    values, vectors = np.linalg.eigh(along @ restrictions.T)
    kept = values > TOLERANCE * values.max(initial=0.0)
    white = vectors[:, kept] / np.sqrt(values[kept])
    contributions = slopes @ along.T @ white
    return from_products(contributions @ contributions.T, int(kept.sum()))


def from_products(products: Floats, df: int, weights: Floats | None = None) -> ObserverTest | None:
    """Test that the contributions x_g of G observers have mean zero; as `score_test`.

    Parameters
    ----------
    products
        Shape (G, G): their inner products.
    df
        How many numbers each x_g consists of.
    weights
        As `webb_weights` draws them; given where many tests of as many observers are made.
    """
    observers = len(products)
    if observers < FEWEST_OBSERVERS:
        return None
    statistic = max(0.0, float(products.sum()))
    order = np.argsort(np.diag(products), kind="stable")  # p must not depend on the order of the observers
    weights = webb_weights(observers) if weights is None else weights
    drawn = np.einsum("bg,bg->b", weights @ products[np.ix_(order, order)], weights)
    as_much = int(np.count_nonzero(drawn >= statistic * (1 - TOLERANCE)))
    return ObserverTest(statistic, df, (1 + as_much) / (1 + len(weights)), observers)


def webb_weights(observers: int) -> Floats:
    """Draw the random weights of each of ``observers``, shape (draws, observers); always the same."""
    shape = draws_for(observers), observers
    return np.asarray(WEBB.ravel()[np.random.default_rng(SEED).integers(0, WEBB.size, shape)])


def draws_for(observers: int) -> int:
    """Return how many random weights a test of so many observers draws for each."""
    return DRAWS_OF_MANY if observers > MOST_FOR_ALL_DRAWS else DRAWS
