"""Whether one scale serves all groups: a score test of separate strengths for each group against pooled ones.

At the pooled fit, let u_o stack the slopes of observer o's log likelihood by the strengths of every group, I be the
information in them, block by block, and X the map from pooled to separate strengths. Slopes along X are zero in sum,
and

    K = U (I⁺ − X (Xᵀ I X)⁺ Xᵀ) Uᵀ,   U with a row u_oᵀ for each observer,

has everything that is needed: the score statistic is 1ᵀ K 1, on q = rank I − rank Xᵀ I X degrees of freedom. It needs
the pooled fit only, so that a group in which an item always wins can be tested too.

The χ² distribution of the statistic is right if all answers are independent. Observers have tastes of their own, and in
each group others: the statistic is then too large. So it is compared with the spread between observers, as
[Dempster1958] does with means of many numbers. The G observers are independent, and if one scale serves all groups

    F = 1ᵀ K 1 / (tr K − 1ᵀ K 1 / G) · (G − 1) / G

follows about the F distribution of r and (G − 1) r degrees of freedom. r counts the directions in which observers
vary, (tr Σ)² / tr Σ² with Σ the covariance of an observer's contribution; both parts are products of two observers'.

Where a penalty or a prior holds the pooled strengths, groups of other pairs miss them by other amounts, alike for all
observers: F then counts only where its p is at least that of the χ² distribution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.classes.conclusions import LEVEL, Conclusion, concluded
from analysis.comparisons.comparisons import Comparisons
from analysis.scaling.counts import count_pairs
from analysis.scaling.laws import LAWS
from analysis.scaling.newton import Point, joint_covariance
from analysis.scaling.result import Fit
from analysis.scaling.sandwich import observer_slopes
from documents.arrays import Floats
from documents.text import JsonResult

FEWEST_OBSERVERS = 3
NO_SPREAD = 1e-9  # of the trace: observers who differ by rounding alone do not vary
MOST_UNITS = 2000  # K of more observers would not fit into memory: several make a unit


@dataclass(frozen=True, slots=True)
class GroupAgreement(JsonResult):
    """Test that the differences between items are the same in all groups.

    Attributes
    ----------
    statistic, df
        The score statistic and its degrees of freedom.
    p_model
        Chance of at least this statistic by the χ² distribution: only for answers that are all independent.
    f, df_between, df_within, p
        The statistic over the spread between observers, F, with its degrees of freedom, and its p, by which to judge;
        None where ``missing`` says why.
    observers
        How many observers there are.
    missing
        Why there is no test by observers; None if there is one.
    """

    statistic: float
    df: int
    p_model: float
    f: float | None
    df_between: float | None
    df_within: float | None
    p: float | None
    observers: int
    missing: str | None = None

    def conclusion(self, level: float = LEVEL) -> Conclusion:
        """Return whether the groups are distinguished at ``level``: by observers where there is such a test."""
        return concluded("differences between the groups' scales", self.p, self.p_model, level)


def group_agreement(pooled: Fit, groups: Sequence[Comparisons], items: Sequence[list[int]]) -> GroupAgreement | None:
    """Test whether the groups agree.

    Parameters
    ----------
    pooled
        The fit to all groups together.
    groups
        The answers of each group, whose pairs link all its items.
    items
        For each group, where its items stand in the pooled fit.

    Returns
    -------
    GroupAgreement | None
        None where groups share too few items to disagree about any difference.
    """
    from scipy.special import chdtrc, fdtrc

    kernel, df, people = _kernel(pooled, groups, items)
    if df < 1:
        return None
    units, statistic = len(kernel), max(0.0, float(kernel.sum()))
    p_model = float(chdtrc(df, statistic))
    within = float(np.trace(kernel)) - statistic / units

    def untested(why: str) -> GroupAgreement:
        return GroupAgreement(statistic, df, p_model, None, None, None, None, people, why)

    if units < FEWEST_OBSERVERS:
        return untested(f"it needs {FEWEST_OBSERVERS} observers or more")
    if within <= NO_SPREAD * float(np.trace(kernel)):
        return untested("all observers agree")
    f = statistic / within * (units - 1) / units
    diagonal = np.diag(kernel)
    squares = float((kernel**2).sum() - (diagonal**2).sum())
    products = float(diagonal.sum() ** 2 - (diagonal**2).sum())
    directions = float(np.clip(products / squares, 1, df)) if squares > 0 else float(df)
    spread = (units - 1) * directions
    p = float(fdtrc(directions, spread, f))
    if pooled.held_by_penalty and p < p_model:
        return untested("only a penalty or a prior holds the scores, and part of the residuals is its own")
    return GroupAgreement(statistic, df, p_model, f, directions, spread, p, people)


def _kernel(pooled: Fit, groups: Sequence[Comparisons], items: Sequence[list[int]]) -> tuple[Floats, int, int]:
    """Return K of at most 2000 observers, or as many units of them, its degrees of freedom, and how many answered."""
    law, n = LAWS[pooled.model], pooled.counts.n
    values = {parameter.name: parameter.estimate for parameter in pooled.parameters}
    k, order = (np.array([[value]]) for value in (values.get(law.parameter or "", 0.0), values.get("order", 0.0)))
    joint = joint_covariance(pooled.counts, law, Point(pooled.theta[None], k, order))[0]
    further = len(joint) - n
    names = dict.fromkeys(name for group in groups for name in group.observers)
    people = {name: place for place, name in enumerate(names)}
    answered, units = np.zeros(len(people), dtype=np.bool_), min(len(people), MOST_UNITS)
    kernel, together = np.zeros((units, units)), np.zeros((units, n + further))
    efficient, shared = np.zeros((units, further)), np.zeros((further, further))
    df = 1 - n
    for group, place in zip(groups, items, strict=True):
        counts, answers = count_pairs(group, ordered=pooled.counts.ordered, ties=law.parameter is not None)
        point = Point(pooled.theta[place][None], k, order)
        inverse = joint_covariance(counts, law, point)[0]
        slopes = observer_slopes(counts, answers, law, point)
        observers = np.array([people[group.observers[person]] for person in np.unique(answers.observer)])
        answered[observers] = True
        who, unit = np.unique(observers % units, return_inverse=True)
        if len(who) < len(observers):
            slopes = np.array([np.bincount(unit, column, len(who)) for column in slopes.T]).T
        else:
            who = observers
        half = slopes @ inverse
        kernel[np.ix_(who, who)] += half @ slopes.T
        together[np.ix_(who, np.array([*place, *range(n, n + further)]))] += slopes
        df += counts.n - 1
        if further:  # the tie parameter and the order effect are those of all groups together
            own = np.linalg.inv(inverse[counts.n :, counts.n :])
            part = half[:, counts.n :]
            kernel[np.ix_(who, who)] -= part @ own @ part.T
            efficient[who] += part @ own
            shared += own
    if further:
        kernel += efficient @ np.linalg.solve(shared, efficient.T)
    kernel -= together @ joint @ together.T
    taken = np.unique(np.flatnonzero(answered) % units)
    return kernel[np.ix_(taken, taken)], df, int(answered.sum())
