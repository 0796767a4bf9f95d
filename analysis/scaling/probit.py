"""Thurstone's law of comparative judgement, Case V: p = Φ(d) [Thurstone1927].

Strengths are in standard deviations of the difference of two perceptions; `units` turns them into JOD and JND.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.cells import Cells
from analysis.scaling.law import Slopes

Floats = NDArray[np.float64]


class Probit:
    """Without ties; strengths in standard deviations of a difference."""

    parameter: str | None = None

    def start(self, cells: Cells) -> float:
        """Return 0: there is no parameter."""
        return 0.0

    def probabilities(self, d: Floats, k: float) -> tuple[Floats, Floats, Floats]:
        """Return the chances of ``first``, of ``second``, and 0."""
        from scipy.special import ndtr

        return np.asarray(ndtr(d)), np.asarray(ndtr(-d)), np.zeros_like(d)

    def log_likelihood(self, cells: Cells, d: Floats, k: float) -> Floats:
        """Return W log p of each cell."""
        from scipy.special import log_ndtr

        return np.asarray(_times(cells.won, log_ndtr(d)) + _times(cells.lost, log_ndtr(-d)))

    def slopes(self, cells: Cells, d: Floats, k: float) -> Slopes:
        """Return the derivatives; those by ``k`` are zero."""
        ahead, behind = _hazard(d), _hazard(-d)
        none = np.zeros_like(d)
        information = cells.won * ahead * (ahead + d) + cells.lost * behind * (behind - d)
        return Slopes(cells.won * ahead - cells.lost * behind, none, information, none, none)


def _hazard(d: Floats) -> Floats:
    """Return φ(d) / Φ(d), to its relative precision however far out."""
    from scipy.special import log_ndtr

    return np.asarray(np.exp(-0.5 * d * d - 0.5 * np.log(2 * np.pi) - log_ndtr(d)))


def _times(count: Floats, log_p: Floats) -> Floats:
    return np.where(count > 0, count * log_p, 0.0)
