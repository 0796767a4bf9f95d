"""Strengths in JOD by pwcmp's likelihood and prior, of one matrix of counts or of many, block by block."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.choices import DistancePrior
from analysis.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.scaling import LAWS, compared_groups, maximise, separation_sentences, strong_groups
from documents import Finding
from documents.arrays import Floats
from extensions.inference.distance_prior import JOD_PER_SD, PRIORS, all_pairs

MOST_ITEMS = 200
BLOCK_NUMBERS = 4_000_000


class JodFits(NamedTuple):
    """Strengths of n items in B sets of counts.

    Attributes
    ----------
    jod
        Shape (B, n): in JOD, with mean 0; NaN where no chain of comparisons links all items, or the objective has no
        maximum. Where it ended at a kink of the prior ``bounded``, the strengths there.
    log_likelihood
        Shape (B,): Σ W log p, without binomial coefficients and prior.
    converged, iterations
        Shape (B,): whether the last step was below the tolerance, and how many there were.
    """

    jod: Floats
    log_likelihood: Floats
    converged: NDArray[np.bool_]
    iterations: NDArray[np.intp]


def fit_jod(wins: Floats, prior: DistancePrior) -> JodFits:
    """Fit each matrix of whole counts, shape (B, n, n), in blocks, so that memory stays bounded."""
    batch, n, _ = wins.shape
    size = max(1, BLOCK_NUMBERS // (n * (n - 1) // 2) ** 2)
    fits = JodFits(
        np.full((batch, n), np.nan),
        np.full(batch, np.nan),
        np.zeros(batch, dtype=np.bool_),
        np.zeros(batch, dtype=np.intp),
    )
    sound = np.flatnonzero([_is_sound(one, prior) for one in wins])
    for start in range(0, len(sound), size):
        chosen = sound[start : start + size]
        with np.errstate(divide="ignore", invalid="ignore"):  # on the way to infinity, where there is no maximum
            top = maximise(all_pairs(wins[chosen]), LAWS["thurstone"], penalty=PRIORS[prior])
        fits.jod[chosen], fits.log_likelihood[chosen] = top.theta * JOD_PER_SD, top.log_likelihood
        fits.converged[chosen], fits.iterations[chosen] = top.converged, top.iterations
    if prior != "bounded":
        fits.jod[~fits.converged] = np.nan
    return fits


def check_counts(comparisons: Comparisons, prior: DistancePrior) -> None:
    """Raise ResultsError unless the counts are whole, of 2 to 200 items, and the fit has a finite maximum."""
    items, wins = comparisons.items, comparisons.wins
    if not 2 <= len(items) <= MOST_ITEMS:
        remedy = f"compare 2 to {MOST_ITEMS} items, or use another method than pwcmp"
        raise ResultsError(Finding(f"there are {len(items)} items", remedy=remedy))
    broken = np.argwhere(wins != np.floor(wins))
    if len(broken):
        winner, loser = broken[0].tolist()
        what = f"'{items[winner]}' was preferred over '{items[loser]}' {wins[winner, loser]:g} times"
        raise ResultsError(Finding(f"{what}: pwcmp takes whole counts", remedy="use another method, such as map"))
    linked = wins + wins.T if prior != "none" else wins
    if len(strong_groups(linked)) > 1:
        sentences = separation_sentences(strong_groups(linked), wins, items)
        alone = len(compared_groups(wins)) > 1
        remedy = "compare items of different groups with each other" if alone else "use --distance-prior gaussian"
        raise ResultsError([Finding(sentence, remedy=remedy) for sentence in sentences])


def _is_sound(wins: Floats, prior: DistancePrior) -> bool:
    if prior == "none":
        return len(strong_groups(wins)) == 1
    return len(compared_groups(wins)) == 1
