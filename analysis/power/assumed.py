"""What is assumed of the scores, and the classes that are right if it holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from documents import Finding

Floats = NDArray[np.float64]


def spread_theta(count: int, nats: float) -> Floats:
    """Return ``count`` log scores at equal steps over ``nats``, best first, with mean 0.

    Raises
    ------
    ResultsError
        If ``nats`` is negative or not finite.
    """
    if not (np.isfinite(nats) and nats >= 0):
        raise ResultsError(Finding(f"the spread is {nats:g} nats", remedy="give 0 or more, such as 2"))
    return np.linspace(nats / 2, -nats / 2, count)


def score_theta(scores: Mapping[str, float], items: Sequence[str]) -> Floats:
    """Return log scores of ``items`` with mean 0, in nats.

    Raises
    ------
    ResultsError
        If an item has no score, or a score is not positive and finite.
    """
    missing = [name for name in items if name not in scores]
    if missing:
        what = f"no score is assumed for {', '.join(missing[:8])}"
        raise ResultsError(Finding(what, remedy="add each with its score"))
    values = np.array([scores[name] for name in items], dtype=np.float64)
    wrong = [name for name, value in zip(items, values.tolist(), strict=True) if not (np.isfinite(value) and value > 0)]
    if wrong:
        raise ResultsError(Finding(f"the score of {wrong[0]} is {scores[wrong[0]]:g}", remedy="scores are above zero"))
    theta = np.log(values)
    return np.asarray(theta - theta.mean())


def differing_pairs(theta: Floats, labels: Sequence[str] = ()) -> NDArray[np.bool_]:
    """Return which pairs the right classes part, shape (P,).

    Parameters
    ----------
    theta
        Shape (n,): assumed log scores.
    labels
        For each item its class, such as "3+4"; two items that share none differ. Without labels, or where one is
        empty, items differ unless their scores are equal.
    """
    first, second = np.triu_indices(len(theta), 1)
    if not labels or not all(labels):
        return np.asarray(theta[first] != theta[second])
    classes = [frozenset(label.split("+")) for label in labels]
    pairs = zip(first.tolist(), second.tolist(), strict=True)
    return np.array([not classes[one] & classes[other] for one, other in pairs], dtype=np.bool_)
