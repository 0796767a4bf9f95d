"""Where Newton's iteration begins: near the log odds of each pair, or at the maximum of a plain table itself.

For one table of wins by Bradley and Terry's law, with a strength for each item, Newton's steps need no list of pairs:
with a = exp(θ), the chance that j is preferred over i is q = a_j / (a_i + a_j), and every sum is one over the matrix.
`analysis.scaling.newton` then takes its own step from there and judges whether that has converged; where a table is not
plain, or a step is long, it begins near the log odds instead.
"""

from __future__ import annotations

import numpy as np

from analysis.covariance.laplacian import grounded, lapack, pair_span
from analysis.scaling.counts import Counts
from analysis.scaling.designs import Design
from analysis.scaling.laws import EXPONENTIAL_FAMILY_STEP, NATS_PER_JND, Law
from analysis.scaling.penalty import Penalty
from documents.arrays import Floats

FARTHEST_START = 3.0  # JNDs
MOST_PLAIN_STEPS = 12
LAST_PLAIN_STEP = 1e-5  # the next would be below 1e-9, and the one after it below rounding


def log_odds(counts: Counts, law: Law, penalty: Penalty, design: Design) -> Floats:
    """Return the strengths nearest to each pair's own log odds, by least squares; shape (B, n).

    Half an answer is added to each side, ties are shared, and a pair weighs what its log odds then tell. Where some
    pair contradicts the others, so that the law knows little there, the strengths are equal instead.
    """
    shared = (counts.tied + 1) / 2 if law.parameter else 0.5
    first, second = counts.won + shared, counts.lost + shared
    both = first + second
    # N p (1 − p) with p = first / both, of all but the answer that was added.
    weight = first / both * second * ((both - 1) / both)
    odds = np.log(first / second) * (law.jnd / NATS_PER_JND)
    right = counts.net_flows(weight * odds, exact=False)[:, :, None]
    near = design.solve(counts, weight, penalty.precision, right, pair_span(weight))[:, :, 0]
    misses = np.abs(counts.differences(near) - odds).max(axis=1)
    if misses.max() <= FARTHEST_START * law.jnd:
        return near
    return np.where((misses <= FARTHEST_START * law.jnd)[:, None], near, 0.0)


def plain_maximum(wins: Floats) -> tuple[Floats, int] | None:
    """Return strengths at the maximum of Bradley and Terry's likelihood, by plain sums, and the steps taken.

    Parameters
    ----------
    wins
        Shape (n, n): how often the item of the row was preferred over that of the column; zero on the diagonal, the
        maximum finite.

    Returns
    -------
    Shape (n,), with mean 0; and how many steps. None where a step is long, or too many are needed.
    """
    n = len(wins)
    won, lost = np.add.reduce(wins, axis=1), np.add.reduce(wins, axis=0)
    theta = np.log((won + 0.5) / (lost + 0.5))
    total = wins + wins.T
    for steps in range(1, MOST_PLAIN_STEPS + 1):
        strength = np.exp(theta)
        behind = strength / np.add.outer(strength, strength)
        # g_i = Σ_j W_ij q_ij − W_ji q_ji; v_ij = N_ij q_ij q_ji.
        answers = wins * behind
        gradient = np.add.reduce(answers, axis=1) - np.add.reduce(answers, axis=0)
        weight = np.multiply(behind, total, out=answers)
        weight *= behind.T
        matrix, _ = grounded(weight, 0.0, weight)
        _, step, failed = lapack().dposv(matrix.T, gradient, lower=1, overwrite_a=1)
        longest = float(np.abs(step).max())
        if failed or not 2 * longest <= EXPONENTIAL_FAMILY_STEP:
            return None
        theta += step
        if longest <= LAST_PLAIN_STEP:
            return theta - np.add.reduce(theta) / n, steps
    return None
