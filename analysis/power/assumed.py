"""Scores that are assumed of the items of a study, and which pairs of them then differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from documents import Finding
from documents.arrays import Floats


def spread_theta(count: int, nats: float) -> Floats:
    """Return ``count`` log scores at equal steps over ``nats``, best first, with mean 0.

    Parameters
    ----------
    count
        Number of items, at least 0.
    nats
        Difference between the best and the last item in nats, at least 0.

    Returns
    -------
    NDArray[np.float64]
        Shape (count,): log scores in nats, from nats / 2 down to −nats / 2.

    Raises
    ------
    ResultsError
        If ``nats`` is negative or not finite.

    Examples
    --------
    >>> spread_theta(3, 2.0).tolist()
    [1.0, 0.0, -1.0]
    """
    if not (np.isfinite(nats) and nats >= 0):
        raise ResultsError(Finding(f"the spread is {nats:g} nats", remedy="give 0 or more, such as 2"))
    return np.linspace(nats / 2, -nats / 2, count)


def score_theta(scores: Mapping[str, float], items: Sequence[str]) -> Floats:
    """Return log scores of ``items`` with mean 0, in nats.

    Parameters
    ----------
    scores
        Score of each item by name, above 0 and finite; only ratios between scores matter.
    items
        Names of the n items, in the order wanted.

    Returns
    -------
    NDArray[np.float64]
        Shape (n,): natural logarithms of the scores in nats, less their mean.

    Raises
    ------
    ResultsError
        If an item has no score, or a score is not positive and finite.

    Examples
    --------
    >>> score_theta({"a": 4.0, "b": 1.0}, ["b", "a"]).round(3).tolist()
    [-0.693, 0.693]
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
    """Return which pairs differ in the assumed classes, shape (P,).

    Parameters
    ----------
    theta
        Shape (n,): assumed log scores.
    labels
        The class of each item, such as "3+4"; two items that share no class differ. Without labels, or where a label
        is empty, items differ unless their scores are equal.

    Returns
    -------
    NDArray[np.bool_]
        Shape (P,), P = n (n − 1) / 2: True where a pair differs, in the order of ``numpy.triu_indices``.

    Examples
    --------
    >>> differing_pairs(np.array([1.0, 0.0, 0.0])).tolist()
    [True, True, False]
    >>> differing_pairs(np.array([1.0, 0.5, 0.0]), ["1", "1+2", "2"]).tolist()
    [False, True, False]
    """
    first, second = np.triu_indices(len(theta), 1)
    if not labels or not all(labels):
        return np.asarray(theta[first] != theta[second])
    classes = [frozenset(label.split("+")) for label in labels]
    pairs = zip(first.tolist(), second.tolist(), strict=True)
    return np.array([not classes[i] & classes[j] for i, j in pairs], dtype=np.bool_)
