"""Fit whatever counts a bootstrap brings, and say of each replicate how it was fitted.

Observers drawn with replacement may leave out the only one who preferred an item. No finite strength then maximises
the likelihood. Such a replicate is not dropped, since that would cut off the tail that it belongs to. It is fitted by
Firth's penalised likelihood, which adds about half an answer to each side: beyond any replicate of these observers with
one such answer, so that its place in the tail is right even if its distance is a convention. Where not even comparisons
link all items, there is no common scale and no fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.scaling.counts import Counts
from analysis.scaling.newton import maximise
from analysis.scaling.penalty import FIRTH, NO_PENALTY
from analysis.scaling.result import Method
from analysis.scaling.separation import are_connected
from documents.arrays import Flags, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Fits:
    """Strengths of n items in B replicates.

    Attributes
    ----------
    theta
        Shape (B, n): log strengths in nats, each row with mean 0; NaN in a replicate without a fit.
    separated
        Shape (B,): whether no maximum of the plain likelihood exists although comparisons link all items.
    without_fit
        Shape (B,): whether comparisons do not link all items, or the iteration did not converge.
    """

    theta: Floats
    separated: Flags
    without_fit: Flags


def fit_each(wins: Floats, method: Method) -> Fits:
    """Fit each matrix of counts: by ``method``, or by Firth's where maximum likelihood has no finite answer.

    Parameters
    ----------
    wins
        Shape (B, n, n), at least zero: ``wins[b, i, j]`` is how often item i was preferred over item j.
    """
    batch, n, _ = wins.shape
    linked = are_connected(wins + wins.transpose(0, 2, 1))
    sound = are_connected(wins)
    theta = np.full((batch, n), np.nan)
    converged = np.zeros(batch, dtype=np.bool_)
    plainly = sound if method == "ml" else np.zeros(batch, dtype=np.bool_)
    penalised = linked & ~plainly
    for chosen, penalty in ((plainly, NO_PENALTY), (penalised, FIRTH)):
        if chosen.any():
            top = maximise(Counts.from_wins(wins[chosen]), penalty=penalty)
            theta[chosen], converged[chosen] = top.theta, top.converged
    theta[~converged] = np.nan
    return Fits(theta, linked & ~sound, ~converged)
