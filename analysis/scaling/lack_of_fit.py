"""Whether the answers depart from one scale, with the observer as the unit: Pearson's residuals pair by pair.

Pearson's statistic is the score test of a free chance for each pair and outcome against the law. With O and N an
observer's counts of an outcome and of all answers to a pair, p the law's chance, and N₊ all observers' N, the observer
contributes (O − N p) / √(N₊ p), less what the strengths and further parameters take up. These sum to Pearson's
residuals, and `analysis.scaling.robust_tests` says how large their sum of squares is by accident.

Where Firth's penalty alone keeps strengths finite, it holds the chances of pairs that all observers answered alike away
from 1, and all observers miss them by the same: small residuals that a test over observers takes for a finding. They
never decide: the χ² distribution's p is the verdict there wherever it is the larger.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.classes.conclusions import Conclusion, concluded
from analysis.scaling.counts import Answers, Counts, count_pairs
from analysis.scaling.laws import LAWS
from analysis.scaling.newton import Point, joint_covariance
from analysis.scaling.robust_tests import FEWEST_OBSERVERS, ObserverTest, from_factors
from analysis.scaling.sandwich import observer_slopes
from documents.arrays import Floats

if TYPE_CHECKING:
    from scipy.sparse import csc_array

    from analysis.comparisons.comparisons import Comparisons
    from analysis.scaling.result import Fit

HELD = (
    "Only the penalty keeps these scores finite, and part of the residuals is the penalty's: they are no evidence "
    "against one scale, and the test over observers is left out."
)


@dataclass(frozen=True, slots=True)
class OneScale:
    """Whether one scale fits the answers, by Pearson's statistic.

    Attributes
    ----------
    statistic, df, p
        Pearson's statistic, its degrees of freedom, and the chance of as much if one scale fits.
    by_observers
        Whether p is by bootstrap over observers; if not, it is by the χ² distribution, for independent answers.
    caveat
        A sentence of caution where p is rough; None otherwise.
    """

    statistic: float
    df: int
    p: float
    by_observers: bool
    caveat: str | None

    @property
    def conclusion(self) -> Conclusion:
        """Whether a departure from one scale is distinguished at the level 0.05."""
        return concluded("departure from one scale", self.p if self.by_observers else None, self.p)


def one_scale(comparisons: Comparisons, fit: Fit) -> OneScale | None:
    """Return the test to judge by: the observer is the unit where five or more are named.

    None where there is no maximum, no degrees of freedom are left, or a prior was used.
    """
    tested, goodness = lack_of_fit(comparisons, fit), fit.goodness
    if tested is not None:
        return OneScale(tested.statistic, tested.df, tested.p, by_observers=True, caveat=None)
    if goodness is None or goodness.p_pearson is None or fit.method == "map":
        return None
    caveat = HELD if fit.held_by_penalty else goodness.caveat
    return OneScale(goodness.pearson, goodness.df, goodness.p_pearson, by_observers=False, caveat=caveat)


def lack_of_fit(comparisons: Comparisons, fit: Fit) -> ObserverTest | None:
    """Test whether ``comparisons`` depart from the one scale that ``fit`` gave them.

    Returns
    -------
    ObserverTest | None
        None where there is no maximum, a prior was used, no degrees of freedom are left, fewer than five observers are
        named, or the penalty alone keeps strengths finite and p would be below that of the χ² distribution.
    """
    goodness = fit.goodness
    if goodness is None or fit.method == "map" or goodness.df < 1 or len(comparisons.observers) < FEWEST_OBSERVERS:
        return None
    law = LAWS[fit.model]
    counts, answers = count_pairs(comparisons, ordered=fit.counts.ordered, ties=law.parameter is not None)
    values = {parameter.name: parameter.estimate for parameter in fit.parameters}
    k, order = (np.array([[values.get(name, 0.0)]]) for name in (law.parameter or "", "order"))
    point = Point(fit.theta[None], k, order)
    chances = np.concatenate(law.probabilities(counts.differences(point.theta, order), k))
    won, lost, tied = (counts.total * chance for chance in chances)
    expected = Counts(counts.n, counts.first, counts.second, won, lost, tied, counts.ordered)
    slopes = observer_slopes(counts, answers, law, point)
    taken_up = slopes, -joint_covariance(expected, law, point)[0]
    tested = from_factors(goodness.df, (_residuals(answers, counts.total[0], chances), None), taken_up)
    below = tested is not None and goodness.p_pearson is not None and tested.p < goodness.p_pearson
    return None if below and fit.held_by_penalty else tested


def _residuals(answers: Answers, total: Floats, chances: Floats) -> csc_array:
    """Return the observers' (O − N p) / √(N₊ p), over the outcomes of m pairs, shape (G, m) or (G, 3 m).

    Of two outcomes the residuals are equal and opposite: one column (O − N p) / √(N₊ p (1 − p)) stands for both.
    """
    from scipy.sparse import csc_array

    pairs = len(total)
    who, observer = np.unique(answers.observer, return_inverse=True)
    outcomes = 3 if chances[2].any() else 1
    size = np.sqrt(total * (chances if outcomes == 3 else chances[:1] * chances[1]))
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)
    columns, values = [], []
    for outcome in range(outcomes):
        missed = answers.count * ((answers.outcome == outcome) - chances[outcome, answers.pair])
        values.append(missed * scale[outcome, answers.pair])
        columns.append(outcome * pairs + answers.pair)
    rows = np.tile(observer, outcomes)
    return csc_array((np.concatenate(values), (rows, np.concatenate(columns))), shape=(len(who), outcomes * pairs))
