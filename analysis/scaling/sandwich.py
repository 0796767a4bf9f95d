"""The sandwich covariance, clustered by observer: right also where one observer's answers hang together [White1982].

A M A, with A the inverse information and M = G / (G − 1) Σ u uᵀ over the G observers, u being the gradient of one
observer's log likelihood at the fit. The factor is the usual correction for few clusters [Cameron2015]; below some
thirty observers the covariance still tends to be too small. It needs no answer to count once: weights, such as
similarities, only have to be right on average.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.scaling.ascent import Point
from analysis.scaling.cells import Cells, Lines
from analysis.scaling.laplacian import without_rounding
from analysis.scaling.law import Law
from documents import Finding

Floats = NDArray[np.float64]


def sandwich(cells: Cells, lines: Lines, law: Law, point: Point, inverse: Floats) -> Floats:
    """Return the covariance of θ and the further parameters, shape as ``inverse``, the inverse information.

    Raises
    ------
    ResultsError
        If there are fewer than two observers.
    """
    scores = observer_scores(cells, lines, law, point)
    observers = len(scores)
    if observers < 2:
        what = "the sandwich covariance needs the answers of at least two observers"
        raise ResultsError(Finding(what, remedy="name observers in the table, or use the model's covariance"))
    half = scores @ inverse
    covariance: Floats = half.T @ half * (observers / (observers - 1))
    return covariance


def observer_scores(cells: Cells, lines: Lines, law: Law, point: Point) -> Floats:
    """Return the gradient of each observer's log likelihood, shape (G, n + f); observers without answers left out."""
    d = cells.differences(point.theta, point.order)
    by_d, by_k = np.empty((3, len(d))), np.empty((3, len(d)))
    for outcome in range(3):
        won, lost, tied = (np.full(len(d), float(outcome == kind)) for kind in range(3))
        slopes = law.slopes(Cells(cells.n, cells.first, cells.second, won, lost, tied, cells.ordered), d, point.k)
        by_d[outcome], by_k[outcome] = slopes.d, slopes.k
    who, observer = np.unique(lines.observer, return_inverse=True)
    flow = by_d[lines.outcome, lines.cell] * lines.count
    n, people = cells.n, len(who)
    of_first, of_second = observer * n + cells.first[lines.cell], observer * n + cells.second[lines.cell]
    slope = np.bincount(of_first, flow, people * n) - np.bincount(of_second, flow, people * n)
    answers = np.bincount(of_first, lines.count, people * n) + np.bincount(of_second, lines.count, people * n)
    columns: list[Floats] = [
        without_rounding(np.asarray(slope, np.float64), np.asarray(answers, np.float64)).reshape(people, n)
    ]
    if law.parameter:
        by_parameter = np.bincount(observer, by_k[lines.outcome, lines.cell] * lines.count, people)
        columns.append(np.asarray(by_parameter[:, None], np.float64))
    if cells.ordered:
        columns.append(np.asarray(np.bincount(observer, flow, people)[:, None], np.float64))
    return np.hstack(columns)
