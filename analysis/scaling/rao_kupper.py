"""Rao and Kupper's law of ties: neither is preferred where the perceived difference is below a threshold [Rao1967].

p_first = 1 / (1 + exp(τ − d)), p_second = 1 / (1 + exp(τ + d)), and the rest are ties: with η = exp(τ) ≥ 1, π_i over
π_i + η π_j. As p_tie = (η² − 1) p_first p_second, no near numbers are subtracted. The parameter is
k = τ = log η.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.cells import Cells
from analysis.scaling.law import Slopes

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
        neither = np.log(-np.expm1(-2 * k)) + log_expit(k - d) + log_expit(k + d)
        return np.asarray(cells.won * log_expit(d - k) + cells.lost * log_expit(-d - k) + cells.tied * neither)

    def slopes(self, cells: Cells, d: Floats, k: float) -> Slopes:
        """Return the derivatives."""
        from scipy.special import expit

        first, second = cells.won + cells.tied, cells.lost + cells.tied
        p, not_p, q, not_q = expit(d - k), expit(k - d), expit(-d - k), expit(k + d)
        spread_first, spread_second = first * p * not_p, second * q * not_q
        return Slopes(
            d=cells.won * not_p - cells.lost * not_q + cells.tied * (q - p),
            k=cells.tied * (p + q + 2 / np.expm1(2 * k)) - cells.won * not_p - cells.lost * not_q,
            dd=spread_first + spread_second,
            dk=spread_second - spread_first,
            kk=spread_first + spread_second + cells.tied / np.sinh(k) ** 2,
        )
