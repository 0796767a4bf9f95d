"""Differences of strengths of every two items: their tests and intervals, by the engine that makes the classes.

That is `analysis.scaling.profile` where it applies; otherwise standard errors and Student's law.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.covariance.laplacian import contrast_variances
from analysis.errors import ResultsError
from analysis.scaling.profile import Profiles, profiles_of
from analysis.scaling.scores import Scores
from analysis.scaling.shown import problem_lines
from documents import Finding
from documents.arrays import Floats, Indices


@dataclass(frozen=True, slots=True, eq=False)
class Differences:
    """θ_i − θ_j of P pairs of items, the better one first.

    Attributes
    ----------
    first, second
        Shape (P,): indices of the items; pairs run through the items best first.
    estimate, se
        Shape (P,): in the units of the strengths. ``se`` is 0 where all observers agree, so that nothing is known of
        how much other observers would vary.
    df
        Shape (P,): degrees of freedom of ``se``; None where they are as good as known.
    profiles
        Profiles of the likelihood, which tests and intervals then come from; None where they come from ``se``.
    place, sign
        Shape (P,): where each pair is among those of ``profiles``, and whether it is that way round, 1 or -1.
    """

    first: Indices
    second: Indices
    estimate: Floats
    se: Floats
    df: Floats | None
    profiles: Profiles | None
    place: Indices
    sign: Floats

    def only(self, rows: Indices) -> Differences:
        """Return some of the pairs, so that no profiles of others are climbed."""
        profiles = None if self.profiles is None else self.profiles.only(self.place[rows])
        df = None if self.df is None else self.df[rows]
        parts = (self.first[rows], self.second[rows], self.estimate[rows], self.se[rows], df)
        return Differences(*parts, profiles, np.arange(len(rows)), self.sign[rows])

    def above(self, bound: float) -> Floats:
        """Return the one-sided p values, shape (P,), of the hypotheses that the differences are at most ``bound``."""
        return self._upper_tail(self._statistic(bound))

    def below(self, bound: float) -> Floats:
        """Return the one-sided p values, shape (P,), of the hypotheses that the differences are at least ``bound``."""
        return self._upper_tail(-self._statistic(bound))

    @property
    def two_sided(self) -> Floats:
        """Shape (P,): two-sided p values of no difference."""
        if self.profiles is not None:
            return np.asarray(self.profiles.p[self.place])
        return np.asarray(np.minimum(1.0, 2 * np.minimum(self.above(0.0), self.below(0.0))))

    def interval(self, level: float) -> tuple[Floats, Floats]:
        """Return the ends, each shape (P,), of intervals with confidence ``level`` (0 to 1); infinite where unknown."""
        if self.profiles is None:
            half = np.where(self.se > 0, self.reach(level) * self.se, np.inf)
            return self.estimate - half, self.estimate + half
        ends = self.profiles.interval(level)[self.place] * self.sign[:, None]
        return np.minimum(ends.min(axis=1), self.estimate), np.maximum(ends.max(axis=1), self.estimate)

    def reach(self, level: float) -> Floats | float:
        """Return how many standard errors an interval with confidence ``level`` (0 to 1) reaches to either side."""
        from scipy.special import ndtri, stdtrit

        upper = (1 + level) / 2
        return float(ndtri(upper)) if self.df is None else np.asarray(stdtrit(self.df, upper))

    def _statistic(self, bound: float) -> Floats:
        """Return how far each difference is above ``bound``, in standard errors; 0 where they are not known."""
        if self.profiles is not None:
            bounds = np.empty(len(self.place))
            bounds[self.place] = self.sign * bound
            return np.asarray(self.sign * self.profiles.at(bounds)[self.place])
        return np.divide(self.estimate - bound, self.se, out=np.zeros_like(self.se), where=self.se > 0)

    def _upper_tail(self, t: Floats) -> Floats:
        from scipy.special import ndtr, stdtr

        known = self.se > 0
        return np.where(known, ndtr(-t) if self.df is None else stdtr(self.df, -t), 1.0)  # no spread is no evidence


def differences(scores: Scores) -> Differences:
    """Return the differences of every two items of ``scores``.

    Raises
    ------
    ResultsError
        If there are no finite strengths.
    """
    check_fitted(scores)
    fit = scores.fit
    n = len(scores.order)
    order = np.array(scores.order, dtype=np.intp)
    better, worse = np.triu_indices(n, 1)
    first, second = order[better], order[worse]
    places = np.zeros((n, n), dtype=np.intp)
    places[better, worse] = np.arange(len(better))
    place = places[np.minimum(first, second), np.maximum(first, second)]
    free = None if fit.pair_freedom is None else fit.pair_freedom[place]
    se = np.sqrt(contrast_variances(fit.covariance)[first, second])
    apart, sign = fit.theta[first] - fit.theta[second], np.where(first < second, 1.0, -1.0)
    return Differences(first, second, apart, se, free, profiles_of(fit), place, sign)


def check_fitted(scores: Scores) -> None:
    """Raise ResultsError unless all strengths are finite."""
    if scores.fit.separation is not None or not np.isfinite(scores.fit.theta).all():
        remedy = problem_lines(scores)[-1].strip()
        raise ResultsError(Finding("the items are separated: there are no finite strengths to compare", remedy=remedy))
