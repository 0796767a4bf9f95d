"""The sandwich covariance, clustered by observer: right also where one observer's answers are dependent [White1982].

A M A, with A the inverse information and M = G / (G − 1) Σ u uᵀ over the G observers, u being the gradient of one
observer's log likelihood at the fit. The factor is the usual correction for few clusters [Cameron2015]; below some
thirty observers the covariance still tends to be too small. It needs no answer to count once: weights, such as
similarities, only have to be right on average.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.scaling.counts import Answers, Counts
from analysis.scaling.laplacian import without_rounding
from analysis.scaling.laws import Law
from analysis.scaling.newton import Point
from documents import Finding

Floats = NDArray[np.float64]


def sandwich(counts: Counts, answers: Answers, law: Law, point: Point, inverse: Floats) -> Floats:
    """Return the covariance of θ and the further parameters, shape as ``inverse``, the inverse information.

    Raises
    ------
    ResultsError
        If there are fewer than two observers.
    """
    slopes = observer_slopes(counts, answers, law, point)
    observers = len(slopes)
    if observers < 2:
        what = "the sandwich covariance needs the answers of at least two observers"
        raise ResultsError(Finding(what, remedy="name observers in the table, or use the model's covariance"))
    half = slopes @ inverse
    covariance: Floats = half.T @ half * (observers / (observers - 1))
    return covariance


def observer_slopes(counts: Counts, answers: Answers, law: Law, point: Point) -> Floats:
    """Return the gradient of each observer's log likelihood, shape (G, n + f); observers without answers left out."""
    d = counts.differences(point.theta, point.order)
    # A batch of three: each pair won once, lost once, tied once.
    won, lost, tied = (np.broadcast_to(np.eye(3)[:, [kind]], (3, d.shape[1])) for kind in range(3))
    single = Counts(counts.n, counts.first, counts.second, won, lost, tied, counts.ordered)
    slopes = law.slopes(single, np.broadcast_to(d, won.shape), point.k)
    who, observer = np.unique(answers.observer, return_inverse=True)
    flow = slopes.d[answers.outcome, answers.pair] * answers.count
    n, people = counts.n, len(who)
    of_first = observer * n + counts.first[answers.pair]
    of_second = observer * n + counts.second[answers.pair]
    slope = np.bincount(of_first, flow, people * n) - np.bincount(of_second, flow, people * n)
    given = np.bincount(of_first, answers.count, people * n) + np.bincount(of_second, answers.count, people * n)
    columns: list[Floats] = [
        without_rounding(np.asarray(slope, np.float64), np.asarray(given, np.float64)).reshape(people, n)
    ]
    if law.parameter:
        by_parameter = np.bincount(observer, slopes.k[answers.outcome, answers.pair] * answers.count, people)
        columns.append(np.asarray(by_parameter[:, None], np.float64))
    if counts.ordered:
        columns.append(np.asarray(np.bincount(observer, flow, people)[:, None], np.float64))
    return np.hstack(columns)
