"""Bradley and Terry's law: p = 1 / (1 + exp(−d)) [Bradley1952]."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.cells import Cells
from analysis.scaling.law import Slopes

Floats = NDArray[np.float64]


class Logistic:
    """Without ties; strengths in nats."""

    parameter: str | None = None

    def start(self, cells: Cells) -> float:
        """Return 0: there is no parameter."""
        return 0.0

    def probabilities(self, d: Floats, k: float) -> tuple[Floats, Floats, Floats]:
        """Return the chances of ``first``, of ``second``, and 0."""
        from scipy.special import expit

        return np.asarray(expit(d)), np.asarray(expit(-d)), np.zeros_like(d)

    def log_likelihood(self, cells: Cells, d: Floats, k: float) -> Floats:
        """Return W log p of each cell."""
        from scipy.special import log_expit

        return np.asarray(cells.won * log_expit(d) + cells.lost * log_expit(-d))

    def slopes(self, cells: Cells, d: Floats, k: float) -> Slopes:
        """Return the derivatives; those by ``k`` are zero."""
        p, q, none = self.probabilities(d, k)
        return Slopes(cells.won * q - cells.lost * p, none, (cells.won + cells.lost) * p * q, none, none)
