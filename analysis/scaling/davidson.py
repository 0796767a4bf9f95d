"""Davidson's law of ties: chances as exp(d/2) : exp(−d/2) : ν for first, second and neither [Davidson1970].

A tie is as likely as ν times the geometric mean of the two strengths. The parameter is k = log ν; the law is
log-linear, so that observed and expected information are the same.

With an order effect d holds δ, log of the factor by which being shown first multiplies a strength [DavidsonBeaver1977].
Their ν, which stands beside π_i and γ π_j, is this ν times the root of γ = exp(−δ).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.cells import Cells
from analysis.scaling.law import Slopes

Floats = NDArray[np.float64]


class Davidson:
    """With ties; strengths in nats, as Bradley and Terry's where there is no tie."""

    parameter: str | None = "nu"

    def start(self, cells: Cells) -> float:
        """Return log ν of items that are all alike."""
        return float(np.log(2 * cells.tied.sum() / (cells.won.sum() + cells.lost.sum())))

    def probabilities(self, d: Floats, k: float) -> tuple[Floats, Floats, Floats]:
        """Return the chances of ``first``, ``second`` and neither."""
        first, second, neither = np.exp(_log_probabilities(d, k))
        return first, second, neither

    def log_likelihood(self, cells: Cells, d: Floats, k: float) -> Floats:
        """Return W log p of each cell."""
        first, second, neither = _log_probabilities(d, k)
        return np.asarray(cells.won * first + cells.lost * second + cells.tied * neither)

    def slopes(self, cells: Cells, d: Floats, k: float) -> Slopes:
        """Return the derivatives, no two near numbers subtracted."""
        p, q, t = self.probabilities(d, k)
        total = cells.total
        return Slopes(
            d=cells.won * (q + t / 2) - cells.lost * (p + t / 2) - cells.tied * (p - q) / 2,
            k=cells.tied * (p + q) - (cells.won + cells.lost) * t,
            dd=total * (p * q + t * (p + q) / 4),
            dk=-total * t * (p - q) / 2,
            kk=total * t * (p + q),
        )


def _log_probabilities(d: Floats, k: float) -> Floats:
    """Return log chances, shape (3, m)."""
    weights = np.stack([d / 2, -d / 2, np.full_like(d, k)])
    weights -= weights.max(axis=0)
    return np.asarray(weights - np.log(np.exp(weights).sum(axis=0)))
