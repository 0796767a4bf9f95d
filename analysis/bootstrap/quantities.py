"""What intervals are asked of: strengths, scores, their logarithms, and differences of strengths."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from documents import Finding

Floats = NDArray[np.float64]
Name = Literal["theta", "score", "log10_score", "difference"]
NAMES: tuple[Name, ...] = get_args(Name)
LIMITS = {"theta": (-np.inf, np.inf), "score": (0.0, 1.0), "log10_score": (-np.inf, 0.0)}


@dataclass(frozen=True, slots=True, eq=False)
class Quantity:
    """A function of the strengths with k values.

    ``name`` is ``theta`` (nats, mean 0), ``score`` (softmax of θ), ``log10_score`` (k = n each), or ``difference``
    (θ_i − θ_j in nats, k pairs). ``first`` and ``second``, shape (k,), index the items of each pair; for the others
    both are the items themselves.
    """

    name: Name
    first: NDArray[np.intp]
    second: NDArray[np.intp]

    @classmethod
    def of_items(cls, name: Name, n: int) -> Quantity:
        """Return ``name`` of every item, or of every pair i < j of ``n`` items."""
        if name not in NAMES:
            raise ResultsError(Finding(f"there is no quantity '{name}'", remedy="expected one of: " + ", ".join(NAMES)))
        if name == "difference":
            first, second = np.triu_indices(n, 1)
            return cls(name, first.astype(np.intp), second.astype(np.intp))
        return cls(name, np.arange(n), np.arange(n))

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the largest value that there can be."""
        return LIMITS.get(self.name, (-np.inf, np.inf))

    def parts(self, most: int) -> Iterator[Quantity]:
        """Yield the same in parts of at most ``most`` values."""
        for start in range(0, len(self.first), max(1, most)):
            chosen = slice(start, start + max(1, most))
            yield Quantity(self.name, self.first[chosen], self.second[chosen])

    def values(self, theta: Floats) -> Floats:
        """Return the values at ``theta``. Shapes (..., n) to (..., k)."""
        from scipy.special import log_softmax

        if self.name == "difference":
            return np.asarray(theta[..., self.first] - theta[..., self.second])
        if self.name == "theta":
            return np.asarray(theta[..., self.first])
        log_score = log_softmax(theta, axis=-1)[..., self.first]
        return np.asarray(np.exp(log_score) if self.name == "score" else log_score / np.log(10))

    def slopes(self, theta: Floats, steps: Floats) -> Floats:
        """Return the change of the values along ``steps``, to first order. Shapes (B, n), (B, S, n) to (B, S, k)."""
        from scipy.special import softmax

        if self.name == "difference":
            return np.asarray(steps[..., self.first] - steps[..., self.second])
        if self.name == "theta":
            return np.asarray(steps[..., self.first])
        scores = softmax(theta, axis=-1)[:, None, :]
        relative = (steps - (scores * steps).sum(axis=-1, keepdims=True))[..., self.first]
        return np.asarray(scores[..., self.first] * relative if self.name == "score" else relative / np.log(10))
