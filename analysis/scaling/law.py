"""What a law of paired comparison is: from a difference of strengths to the chances of each answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.cells import Cells

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Slopes:
    """Derivatives of the log likelihood of each cell, each of shape (m,).

    ``d`` and ``k`` are the first ones by the difference and by the law's own parameter; ``dd``, ``dk`` and ``kk`` the
    second ones with their signs turned, so that they are information.
    """

    d: Floats
    k: Floats
    dd: Floats
    dk: Floats
    kk: Floats


class Law(Protocol):
    """A law with at most one parameter ``k`` of its own, whose log likelihood is concave in difference and ``k``."""

    @property
    def parameter(self) -> str | None:
        """Name of exp(k); None where the law has no parameter of its own, and no ties."""
        ...

    def start(self, cells: Cells) -> float:
        """Return where ``k`` begins."""
        ...

    def probabilities(self, d: Floats, k: float) -> tuple[Floats, Floats, Floats]:
        """Return the chances that ``first`` is preferred, ``second``, and neither."""
        ...

    def log_likelihood(self, cells: Cells, d: Floats, k: float) -> Floats:
        """Return each cell's log likelihood without binomial coefficients; -inf where ``k`` is impossible."""
        ...

    def slopes(self, cells: Cells, d: Floats, k: float) -> Slopes:
        """Return the derivatives."""
        ...
