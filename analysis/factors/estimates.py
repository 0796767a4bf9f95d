"""From the coordinates of a fit to effects in nats, with their covariance by the model and by observers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.factors.fit import TermsFit
from analysis.factors.likelihood_ratio import NO_SPREAD, robust_wald
from analysis.factors.rows import Effect, effect
from analysis.factors.terms import Term
from analysis.scaling.counts import Answers, Counts
from analysis.scaling.laws import LOGISTIC
from analysis.scaling.newton import Point
from analysis.scaling.sandwich import observer_slopes

Floats = NDArray[np.float64]


def estimates(
    counts: Counts, answers: Answers, terms: Sequence[Term], fit: TermsFit, observers: int
) -> tuple[Floats, Floats, Floats | None, list[tuple[float, float] | None]]:
    """Return all effects, their covariance by the model and by observers, and Wald's robust test of each term."""
    columns = np.hstack([term.columns for term in terms])
    centred = columns - columns.mean(axis=0)
    basis = fit.basis
    # centred = basis @ triangle, and θ = basis @ γ = centred @ β.
    to_beta = np.linalg.inv(basis.T @ centred)
    beta = to_beta @ fit.gamma
    beta_covariance = to_beta @ fit.inverse @ to_beta.T
    contrasts = _block_diagonal([term.contrasts for term in terms])
    covariance = contrasts @ beta_covariance @ contrasts.T
    none: list[tuple[float, float] | None] = [None] * len(terms)
    if observers < 2:
        return contrasts @ beta, covariance, None, none
    nothing = np.zeros((1, 1))
    slopes = observer_slopes(counts, answers, LOGISTIC, Point(fit.theta[None], nothing, nothing))
    half = slopes @ basis @ fit.inverse @ to_beta.T
    beta_sandwich = half.T @ half * (observers / (observers - 1))
    starts = np.cumsum([0, *(term.width for term in terms)])
    se = np.sqrt(np.diag(beta_covariance))
    robust = []
    for term, start in zip(terms, starts, strict=False):
        own = np.arange(start, start + term.width)
        robust.append(robust_wald(beta[own], beta_sandwich[np.ix_(own, own)], se[own], observers))
    return contrasts @ beta, covariance, contrasts @ beta_sandwich @ contrasts.T, robust


def effects(
    terms: Sequence[Term], estimate: Floats, covariance: Floats, sandwich: Floats | None, observers: int
) -> tuple[Effect, ...]:
    """Return the effects, term by term, with their intervals."""
    named = [(term, label) for term in terms for label in term.labels]
    se = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    robust_se = None if sandwich is None else np.sqrt(np.maximum(np.diag(sandwich), 0.0))
    return tuple(
        effect(
            term.names[0],
            label,
            term.reference,
            float(estimate[place]),
            float(se[place]),
            float(robust_se[place]) if robust_se is not None and robust_se[place] > NO_SPREAD * se[place] else None,
            observers,
        )
        for place, (term, label) in enumerate(named)
    )


def _block_diagonal(blocks: Sequence[Floats]) -> Floats:
    whole = np.zeros((sum(len(block) for block in blocks), sum(block.shape[1] for block in blocks)))
    row = column = 0
    for block in blocks:
        whole[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return whole
