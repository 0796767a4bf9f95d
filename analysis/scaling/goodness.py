"""How well a law fits: deviance and Pearson's statistic against free chances for each pair."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from analysis.scaling.counts import Counts
from documents.arrays import Floats
from documents.text import JsonResult

FEWEST_EXPECTED = 5.0


@dataclass(frozen=True, slots=True)
class Goodness(JsonResult):
    """Goodness of fit.

    Attributes
    ----------
    deviance, pearson
        2 Σ O log(O / E) and Σ (O − E)² / E over the answers to each pair.
    df
        Free numbers of the answers less the parameters of the law.
    p_deviance, p_pearson
        Chance of as much or more if the law is right, by the χ² distribution: it takes all answers for independent.
        None where ``df`` is zero. Judge by `analysis.scaling.lack_of_fit.one_scale`, which does not where it can.
    smallest_expected
        Smallest expected count E.
    share_small
        Share (0 to 1) of expected counts below 5. Where there are such, the χ² distribution is a rough guide:
        Pearson's p is then the safer of the two, and with single answers to most pairs neither says anything.
    """

    deviance: float
    pearson: float
    df: int
    p_deviance: float | None
    p_pearson: float | None
    smallest_expected: float
    share_small: float
    json_keys: ClassVar = {"share_small": "share_of_expected_below_5"}
    json_also: ClassVar = ("caveat",)

    @property
    def caveat(self) -> str | None:
        """A sentence of caution where expected counts are small; None if they are not."""
        if not self.share_small:
            return None
        return (
            f"{self.share_small:.0%} of the expected counts are below {FEWEST_EXPECTED:g} (the smallest is "
            f"{self.smallest_expected:.2g}): the p value of the fit is rough."
        )


def goodness_of_fit(
    counts: Counts, probabilities: tuple[Floats, Floats, Floats], parameters: int, *, ties: bool
) -> Goodness:
    """Compare ``counts``, a batch of one, with a law's chances of ``first``, ``second`` and neither, each (1, m).

    ``parameters`` is how many numbers of the law were fitted.
    """
    from scipy.special import gammaincc, xlogy

    outcomes = 3 if ties else 2
    observed = np.concatenate([counts.won, counts.lost, counts.tied])[:outcomes]
    total = observed.sum(axis=0)
    kept = total > 0
    observed, total = observed[:, kept], total[kept]
    chance = np.concatenate(probabilities)[:outcomes, kept]
    expected = total * chance
    ratio = np.divide(observed / total, chance, out=np.ones_like(chance), where=(observed > 0) & (chance > 0))
    deviance = max(0.0, float(2 * xlogy(observed, ratio).sum()))
    misses = np.divide((observed - expected) ** 2, expected, out=np.zeros_like(expected), where=expected > 0)
    pearson = float(misses.sum())
    df = max(0, int(kept.sum()) * (outcomes - 1) - parameters)  # with a prior, parameters may outnumber the pairs
    tail = [float(gammaincc(df / 2, value / 2)) if df > 0 else None for value in (deviance, pearson)]
    share = float((expected < FEWEST_EXPECTED * (1 - 1e-9)).mean())  # 5 less rounding is 5
    return Goodness(deviance, pearson, df, tail[0], tail[1], float(expected.min()), share)
