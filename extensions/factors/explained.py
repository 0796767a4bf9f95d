"""How much of the free scores the factors explain, and whether what they leave is more than chance.

The free model gives each item a strength of its own. With D the deviance, the share of deviance is
(D_null − D_factors) / (D_null − D_free), null being the model of equal strengths. R² sets fitted strengths θ̂ against
free ones θ with all the precision of θ as weight, H being their information (the pseudo-inverse of their covariance):

    R² = 1 − (θ − θ̂)ᵀ H (θ − θ̂) / θᵀ H θ

which is generalised least squares' [Buse1973]. Lack of fit is the test of the factors against the free model, as
`extensions.factors.likelihood_ratio` has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from analysis.classes import Conclusion, concluded
from analysis.scaling import ITEMS, LOGISTIC, Counts, ObserverTest
from analysis.scaling import fit as fit_wins
from documents.arrays import Floats
from documents.text import JsonResult
from extensions.factors.fit import TermsFit
from extensions.factors.likelihood_ratio import chance, covariance_at, observer_test


@dataclass(frozen=True, slots=True, eq=False)
class Explained(JsonResult):
    """What the factors explain.

    Attributes
    ----------
    deviance_null, deviance_factors, deviance_free
        Against one free chance for each pair. ``deviance_free`` is None where the items have no finite free strengths.
    deviance_share, r_squared
        As above, at most 1; None where there are no free strengths, or nothing to explain.
    free_theta
        Shape (n,): the free strengths, in nats, mean 0; NaN where there are none.
    lack_of_fit, lack_of_fit_df, lack_of_fit_p
        Likelihood-ratio statistic, its degrees of freedom, and the χ² chance of as much if the factors are all there
        is; p is None where there are no degrees left or a prior was used, and all are None where there are no free
        strengths.
    lack_of_fit_by_observers
        The score test with the observer as the unit, to judge by; None with fewer than five observers, or as above.
    missing
        Why there are no free strengths; None if there are.
    """

    deviance_null: float
    deviance_factors: float
    deviance_free: float | None
    deviance_share: float | None
    r_squared: float | None
    free_theta: Floats
    lack_of_fit: float | None
    lack_of_fit_df: int | None
    lack_of_fit_p: float | None
    lack_of_fit_by_observers: ObserverTest | None
    missing: str | None
    json_keys: ClassVar = {"free_theta": None, "conclusion.verdict": "lack_of_fit_verdict"}
    json_also: ClassVar = ("conclusion.verdict",)

    @property
    def conclusion(self) -> Conclusion:
        """Whether a lack of fit is distinguished at the level 0.05: by observers where there is such a test."""
        own = self.lack_of_fit_by_observers
        return concluded("lack of fit of the factors", own.p if own else None, self.lack_of_fit_p)


def explain(counts: Counts, wins: Floats, fit: TermsFit, slopes: Floats | None) -> Explained:
    """Compare ``fit`` with the null and the free model of the same answers.

    ``slopes`` (G, n) are those of the observers' log likelihoods at ``fit``; None where that is no maximum.
    """
    from scipy.special import xlogy

    won, lost = counts.won[0], counts.lost[0]
    total = won + lost
    best = xlogy(won, won / total) + xlogy(lost, lost / total)
    equal = LOGISTIC.log_likelihood(counts, np.zeros((1, len(total))), 0.0)[0]
    null, factors = (max(0.0, float(2 * (best - terms).sum())) for terms in (equal, fit.pair_terms))
    free = fit_wins(wins)
    if not free.converged:
        why = "the items are separated, or not all linked by comparisons" if free.separated else "no convergence"
        return Explained(null, factors, None, None, None, free.theta, None, None, None, None, why)
    difference = counts.differences(free.theta[None])
    free_terms = LOGISTIC.log_likelihood(counts, difference, 0.0)[0]
    to_explain = float(2 * (free_terms - equal).sum())
    lack = max(0.0, float(2 * (free_terms - fit.pair_terms).sum()))
    df = counts.n - 1 - len(fit.gamma)
    tested = slopes is not None and df > 0
    weight = LOGISTIC.slopes(counts, difference, 0.0).dd[0]
    all_of_it = float(weight @ difference[0] ** 2)
    missed = float(weight @ counts.differences((free.theta - fit.theta)[None])[0] ** 2)
    by_observers = None
    if slopes is not None and df > 0:
        by_observers = observer_test(slopes, covariance_at(counts, ITEMS, fit), fit, df)
    # Below rounding of the likelihood the items are equal, and there is nothing to explain.
    anything = to_explain > 1e-12 * float(np.abs(equal).sum())
    return Explained(
        deviance_null=null,
        deviance_factors=factors,
        deviance_free=free.deviance,
        deviance_share=1 - lack / to_explain if anything else None,
        r_squared=1 - missed / all_of_it if anything else None,
        free_theta=free.theta,
        lack_of_fit=lack,
        lack_of_fit_df=df,
        lack_of_fit_p=chance(lack, df) if tested else None,
        lack_of_fit_by_observers=by_observers,
        missing=None,
    )
