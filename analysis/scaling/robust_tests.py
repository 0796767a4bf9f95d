"""Tests of any restrictions that stay right where one observer's answers depend on each other: a score bootstrap.

A plain likelihood-ratio or score test counts every answer as new evidence. Where observers differ in taste it rejects
true hypotheses far too often, whatever the number of observers. Here the observer is the unit. With u_g the slope of
observer g's log likelihood at the fit that obeys the q restrictions R φ = 0, and A the inverse information there,

    x_g = (R A Rᵀ)^−½ R A u_g,  T = |Σ x_g|²

is the score statistic, Pearson's where the restrictions leave one parameter per pair. Its law under the hypothesis is
that of T* = |Σ w_g x_g|² with random weights w_g [Kline2012], here the six of mean 0 and variance 1 that serve few
observers best [Webb2023]. No covariance of q numbers is inverted, so that there may be more restrictions than
observers. T depends on the weights only through the inner products of the x_g, which is all that is kept of them. Of
many observers not even these are made, but Σ w_g x_g of some draws at a time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from documents import count_work
from documents.arrays import Floats
from documents.text import JsonResult

if TYPE_CHECKING:
    from scipy.sparse import csc_array

Factor: TypeAlias = "tuple[Floats | csc_array, Floats | None]"

FEWEST_OBSERVERS = 5
MOST_FOR_ALL_DRAWS = 200
MOST_IN_PRODUCTS = 2000  # a matrix of all two of them takes 32 MB
BLOCK_COLUMNS = 4096
BLOCK_NUMBERS = 1_000_000
DRAWS, DRAWS_OF_MANY, SEED = 9999, 1999, 0
WEBB: Floats = np.sqrt(np.array([0.5, 1.0, 1.5])) * np.array([[-1.0], [1.0]])
TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class ObserverTest(JsonResult):
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
    return from_factors(int(kept.sum()), (slopes @ along.T @ white, None))


def from_factors(df: int, *factors: Factor) -> ObserverTest | None:
    """Test as `from_products` does, by the products Σ X M Xᵀ of (G, G), which are not made of many observers.

    Parameters
    ----------
    df
        As `from_products`.
    factors
        Each X, shape (G, q), which may be sparse, with its symmetric M, shape (q, q), or None for the unit matrix.
    """
    observers = factors[0][0].shape[0]
    if observers <= MOST_IN_PRODUCTS:
        return from_products(sum((_products(*factor) for factor in factors), np.zeros((observers, observers))), df)
    count_work("tests_by_observers")
    own, everyone = np.zeros(observers), np.ones((1, observers))
    for x, inner in factors:
        own += np.asarray((x * (x if inner is None else x @ inner)).sum(axis=1))
    statistic = max(0.0, float(_sizes(everyone, factors)[0]))
    order = np.argsort(own, kind="stable")
    as_much, draws = 0, 0
    for drawn in _weight_blocks(observers, max(1, BLOCK_NUMBERS // max(x.shape[1] + observers for x, _ in factors))):
        weights = np.empty_like(drawn)
        weights[:, order] = drawn
        as_much += int(np.count_nonzero(_sizes(weights, factors) >= statistic * (1 - TOLERANCE)))
        draws += len(drawn)
    return ObserverTest(statistic, df, (1 + as_much) / (1 + draws), observers)


def _products(x: Floats | csc_array, inner: Floats | None) -> Floats:
    """Return X M Xᵀ."""
    if inner is not None:
        return np.asarray(x @ inner @ x.T)
    if isinstance(x, np.ndarray):
        return np.asarray(x @ x.T)
    products = np.zeros((x.shape[0], x.shape[0]))
    for start in range(0, x.shape[1], BLOCK_COLUMNS):
        block = x[:, start : start + BLOCK_COLUMNS].toarray()
        products += block @ block.T
    return products


def _sizes(weights: Floats, factors: tuple[Factor, ...]) -> Floats:
    """Return Σ |w X|² by the M of each factor, of each row w of ``weights`` (B, G), shape (B,)."""
    sizes = np.zeros(len(weights))
    for x, inner in factors:
        along = weights @ x if isinstance(x, np.ndarray) else (x.T @ weights.T).T
        sizes += np.einsum("bq,bq->b", along if inner is None else along @ inner, along)
    return sizes


def from_products(products: Floats, df: int) -> ObserverTest | None:
    """Test that the contributions x_g of G observers have mean zero; as `score_test`.

    Parameters
    ----------
    products
        Shape (G, G): their inner products.
    df
        How many numbers each x_g consists of.
    """
    observers = len(products)
    if observers < FEWEST_OBSERVERS:
        return None
    count_work("tests_by_observers")
    statistic = max(0.0, float(products.sum()))
    order = np.argsort(np.diag(products), kind="stable")  # p must not depend on the order of the observers
    weights = _webb_weights(observers)
    drawn = np.einsum("bg,bg->b", weights @ products[np.ix_(order, order)], weights)
    as_much = int(np.count_nonzero(drawn >= statistic * (1 - TOLERANCE)))
    return ObserverTest(statistic, df, (1 + as_much) / (1 + len(weights)), observers)


@lru_cache(maxsize=1)
def _webb_weights(observers: int) -> Floats:
    """Draw the random weights of each of ``observers``, shape (draws, observers); always the same, 32 MB at most."""
    return next(_weight_blocks(observers, draws_for(observers)))


def _weight_blocks(observers: int, rows: int) -> Iterator[Floats]:
    """Yield what `_webb_weights` draws, some ``rows`` at a time."""
    random, draws = np.random.default_rng(SEED), draws_for(observers)
    for start in range(0, draws, rows):
        shape = min(rows, draws - start), observers
        yield np.asarray(WEBB.ravel()[random.integers(0, WEBB.size, shape)])


def draws_for(observers: int) -> int:
    """Return how many random weights a test of so many observers draws for each."""
    return DRAWS_OF_MANY if observers > MOST_FOR_ALL_DRAWS else DRAWS
