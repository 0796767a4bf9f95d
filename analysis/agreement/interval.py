"""An interval of a correlation between a measure, which is known, and scores, which observers give with error.

Error of the scores lowers a correlation [Spearman1904]: of a measure that agrees perfectly with all people, that of the
sample lies below 1, and that of a bootstrap sample, which has the error twice, lower still. Percentiles of the
bootstrap then never contain the truth. So the bootstrap's errors are used to invert a test [Carpenter1999]: a true
correlation is in the interval unless the observed one would be among the lowest or the highest 2.5 % of those that it
leads to.

Scores with a given true correlation lie on the half circle that runs from the measure's own order over the observed
scores to the reversed order. Their length is that of the observed scores without the error's share. Errors are those of
the bootstrap over observers, times √(S/(S − 1)), each divided by the root of a χ² with S − 1 degrees of freedom over
them: what Student's law is to the normal one, for S observers. `benchmarks/agreement.py` measures the coverage.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.agreement.correlations import CorrelationKind, correlation, direction

Floats = NDArray[np.float64]
SEED = 2016
# Halvings of the half circle: its ends are then known to 0.01 degrees.
HALVINGS = 14
# Where the errors seem to be all there is, scores still have this share of their squared length.
LEAST_SHARE = 0.05
TIED = 1e-9


def correlation_interval(
    scores: Floats,
    errors: Floats,
    observers: int,
    values: Floats,
    kind: CorrelationKind = "spearman",
    *,
    level: float = 0.95,
) -> tuple[float, float]:
    """Return the interval of the correlation that all observers of the kind would give, with these stimuli.

    Parameters
    ----------
    scores
        Shape (n,): the scores that the observers gave, larger for better.
    errors
        Shape (R, n): scores of bootstrap samples of the observers, minus ``scores``; finite.
    observers
        How many observers there were, at least 2.
    values
        Shape (n,): the measure, larger for better, not constant; finite for ``pearson``.
    kind
        The correlation.
    level
        The coverage, between 0 and 1.

    Returns
    -------
    tuple of float
        The lower and the upper end, −1 to 1.

    Examples
    --------
    >>> errors = np.random.default_rng(1).normal(0, 0.1, (500, 4))
    >>> low, high = correlation_interval(np.array([1.0, 2.0, 3.0, 4.1]), errors, 20, np.arange(4.0), "pearson")
    >>> low > 0.9, round(high, 3)
    (True, 1.0)
    """
    tail = (1 - level) / 2
    random = np.random.default_rng(SEED)
    wide = errors * np.sqrt(observers / (observers - 1))
    own = direction(values, kind)
    centred = scores - scores.mean()
    across = centred - (centred @ own) * own
    size2 = float(centred @ centred)
    if size2 <= 0:
        return -1.0, 1.0
    observed = float(correlation(scores, values, kind))
    if not errors.any():
        return observed, observed
    rest = float(np.sqrt(across @ across))
    # Where observers follow the measure exactly, any direction across it will do.
    across = _across(own) if rest <= TIED * np.sqrt(size2) else across / rest
    length = np.sqrt(max(size2 - float((wide**2).sum(axis=1).mean()), LEAST_SHARE * size2))
    freedom = observers - 1
    wide *= np.sqrt(freedom / random.chisquare(freedom, len(wide)))[:, None]

    def true_scores(angle: float) -> Floats:
        return np.asarray(length * (np.cos(angle) * own + np.sin(angle) * across))

    def may_be(angle: float, *, lower: bool) -> bool:
        drawn = correlation(true_scores(angle) + wide, values, kind)
        as_far = drawn >= observed - TIED if lower else drawn <= observed + TIED
        return float(as_far.mean()) > tail

    def end(inside: float, outside: float, *, lower: bool) -> float:
        if may_be(outside, lower=lower):
            return outside
        for _ in range(HALVINGS):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if may_be(middle, lower=lower) else (inside, middle)
        return outside

    ends = (end(0.0, np.pi, lower=True), end(np.pi, 0.0, lower=False))
    low, high = (float(correlation(true_scores(angle), values, kind)) for angle in ends)
    return min(low, observed), max(high, observed)


def _across(own: Floats) -> Floats:
    """Return a vector of mean 0 and length 1 at right angles to ``own``."""
    place = np.arange(len(own), dtype=np.float64)
    other = np.where(place % 2 > 0, -1 - place, 1 + place)
    other = other - other.mean()
    other = other - (other @ own) * own
    return np.asarray(other / np.sqrt(other @ other))
