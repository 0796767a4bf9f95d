"""The chance that one item is preferred over another, with an interval, for every pair.

By a law without ties the chance rises with the difference of strengths, so that its interval is that of the difference
put through the law. By a law with ties each of three chances depends on the tie parameter too: its
interval is made on the logit scale by the delta method, from the joint covariance of strengths and parameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.classes.classes import check_level
from analysis.inference.differences import Differences, differences
from analysis.scaling.counts import Counts
from analysis.scaling.laws import LAWS
from analysis.scaling.scores import Scores
from documents.arrays import Floats
from documents.text import JsonResult


@dataclass(frozen=True, slots=True)
class Chance(JsonResult):
    """A chance (0 to 1) with the ends of its interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class PairProbability(JsonResult):
    """Chances of one pair.

    Attributes
    ----------
    first, second
        Names of the items; ``first`` has the higher strength.
    first_preferred, second_preferred
        Chances that ``first`` is preferred, and ``second``.
    tie
        Chance that neither is; None for a law without ties.
    difference, se, low, high
        θ_first − θ_second, its standard error and the ends of its interval, in the units of the strengths. ``se`` is
        None where all observers agree, so that nothing is known of its error: the interval is then infinite.
    difference_jnd
        The same difference in JND.
    p
        Two-sided p value of no difference after the correction that the classes were made with; None without classes.
    """

    first: str
    second: str
    first_preferred: Chance
    second_preferred: Chance
    tie: Chance | None
    difference: float
    se: float | None
    df: float | None
    low: float
    high: float
    difference_jnd: float
    p: float | None


@dataclass(frozen=True, slots=True)
class PairProbabilities(JsonResult):
    """Chances of every pair, pairs of the best item first.

    ``level`` is the confidence level of each interval by itself.
    """

    level: float
    pairs: tuple[PairProbability, ...]


def pair_probabilities(scores: Scores, level: float = 0.95) -> PairProbabilities:
    """Return the chance that each item is preferred over each other one, with an interval.

    Where an order effect was fitted, the chances are those of a pair whose order makes no difference.

    Parameters
    ----------
    scores
        Scores of paired comparisons, by any law.
    level
        Confidence level of each interval, between 0 and 1. The intervals are not corrected for the number of pairs.

    Returns
    -------
    PairProbabilities
        A line for each pair, pairs of the best item first. ``to_json()`` has what `cyclopean scores --pairs` prints.

    Raises
    ------
    ResultsError
        If ``level`` is out of range, or there are no finite strengths.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> pair = pair_probabilities(score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)]))).pairs[0]
    >>> chance = pair.first_preferred
    >>> round(chance.value, 2), round(chance.low, 2), round(chance.high, 2)
    (0.75, 0.6, 0.86)
    """
    check_level(1 - level)
    apart = differences(scores)
    law = LAWS[scores.fit.model]
    known = apart.se > 0
    ends = np.stack(apart.interval(level))
    if law.parameter is None:
        at = np.concatenate([apart.estimate[None], ends])
        with np.errstate(invalid="ignore"):
            p, rest, _ = law.probabilities(at, 0.0)
        chances = [(p[0], p[1], p[2]), (rest[0], rest[2], rest[1])]
    else:
        chances = _with_ties(scores, apart, apart.reach(level))
    names = scores.comparisons.items
    p_of = None if scores.classes is None else scores.classes.p
    pairs = []
    for row, (better, worse) in enumerate(zip(apart.first.tolist(), apart.second.tolist(), strict=True)):
        shown = [Chance(float(value[row]), float(low[row]), float(high[row])) for value, low, high in chances]
        pairs.append(
            PairProbability(
                first=names[better],
                second=names[worse],
                first_preferred=shown[0],
                second_preferred=shown[1],
                tie=shown[2] if len(shown) == 3 else None,
                difference=float(apart.estimate[row]),
                se=float(apart.se[row]) if known[row] else None,
                df=None if apart.df is None else float(apart.df[row]),
                low=float(ends[0, row]),
                high=float(ends[1, row]),
                difference_jnd=float(apart.estimate[row]) / scores.jnd,
                p=None if p_of is None else float(p_of[better, worse]),
            )
        )
    return PairProbabilities(level, tuple(pairs))


def _with_ties(scores: Scores, apart: Differences, reach: Floats | float) -> list[tuple[Floats, Floats, Floats]]:
    """Return the three chances with the ends of their intervals, each shape (P,)."""
    from scipy.special import expit, logit

    fit = scores.fit
    law, n = LAWS[fit.model], fit.counts.n
    k = fit.parameters[0].estimate
    d = np.broadcast_to(apart.estimate, (3, len(apart.estimate)))
    outcome = np.broadcast_to(np.eye(3)[:, :, None], (3, *d.shape))  # one answer of each kind
    slopes = law.slopes(Counts(n, apart.first, apart.second, *outcome.transpose(1, 0, 2)), d, k)
    p = np.stack(law.probabilities(apart.estimate, k))
    joint = fit.joint_covariance
    with_k = joint[apart.first, n] - joint[apart.second, n]
    variance = slopes.d**2 * apart.se**2 + 2 * slopes.d * slopes.k * with_k + slopes.k**2 * joint[n, n]
    # d logit p = d log p / (1 − p)
    half = reach * np.sqrt(np.maximum(variance, 0)) / (1 - p)
    half = np.where(apart.se > 0, half, np.inf)
    middle = logit(p)
    return [(value, expit(m - h), expit(m + h)) for value, m, h in zip(p, middle, half, strict=True)]
