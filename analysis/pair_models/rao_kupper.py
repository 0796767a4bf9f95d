"""Rao and Kupper's law of ties: neither is preferred where the perceived difference is below a threshold [Rao1967].

p_first = 1 / (1 + exp(τ − d)), p_second = 1 / (1 + exp(τ + d)), and the rest are ties: with η = exp(τ) ≥ 1, π_i over
π_i + η π_j. As p_tie = (η² − 1) p_first p_second, the likelihood needs no difference of near numbers. The parameter is
k = τ = log η.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.pair_models.cells import Cells
from analysis.pair_models.law import Slopes

Floats = NDArray[np.float64]


class RaoKupper:
    """With ties; strengths in nats."""

    parameter: str | None = "eta"

    def start(self, cells: Cells) -> float:
        """Return τ of items that are all alike."""
        share = cells.tied.sum() / cells.total.sum()
        return float(np.log1p(share) - np.log1p(-share))

    def probabilities(self, d: Floats, k: float) -> tuple[Floats, Floats, Floats]:
        """Return the chances of ``first``, ``second`` and neither."""
        from scipy.special import expit

        first, second = expit(d - k), expit(-d - k)
        return np.asarray(first), np.asarray(second), np.asarray(np.expm1(2 * k) * first * second)

    def log_likelihood(self, cells: Cells, d: Floats, k: float) -> Floats:
        """Return W log p of each cell; -inf where the threshold is not above zero."""
        from scipy.special import log_expit

        if k <= 0:
            return np.full_like(d, -np.inf)
        first, second = cells.won + cells.tied, cells.lost + cells.tied
        log_ties = 2 * k + np.log(-np.expm1(-2 * k))
        return np.asarray(first * log_expit(d - k) + second * log_expit(-d - k) + cells.tied * log_ties)

    def slopes(self, cells: Cells, d: Floats, k: float) -> Slopes:
        """Return the derivatives."""
        from scipy.special import expit

        first, second = cells.won + cells.tied, cells.lost + cells.tied
        p, not_p, q, not_q = expit(d - k), expit(k - d), expit(-d - k), expit(k + d)
        spread_first, spread_second = first * p * not_p, second * q * not_q
        return Slopes(
            d=first * not_p - second * not_q,
            k=-first * not_p - second * not_q - 2 * cells.tied / np.expm1(-2 * k),
            dd=spread_first + spread_second,
            dk=spread_second - spread_first,
            kk=spread_first + spread_second + cells.tied / np.sinh(k) ** 2,
        )
