"""A fit's covariance clustered by observer, of whichever kind, with the degrees of freedom of its standard errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from analysis.covariance.shrinkage import Clustered, Spread, shrink
from analysis.scaling.counts import Answers, Counts
from analysis.scaling.laws import Law
from analysis.scaling.newton import Point
from analysis.scaling.sandwich import Contributions, contributions
from documents.arrays import Floats
from documents.text import JsonResult


@dataclass(frozen=True, eq=False)
class ByObserver(JsonResult):
    """The covariance of ``n`` strengths and further parameters, clustered by observer.

    Attributes
    ----------
    n
        How many strengths there are.
    contributions
        What each observer moves the estimates by.
    spread
        The covariance of the strengths, a batch of one.
    """

    n: int
    contributions: Contributions
    spread: Spread
    json_names: ClassVar = "observers overdispersion shrinkage fewest_degrees_of_freedom most_degrees_of_freedom"

    @property
    def observers(self) -> int:
        """How many observers answered."""
        return len(self.contributions.pulled)

    @property
    def joint(self) -> Floats:
        """Shape (n + f, n + f): of the strengths, of the kind chosen; of the rest, always the sandwich's."""
        pulled = self.contributions.pulled
        if pulled.shape[1] == self.n:
            return np.asarray(self.spread.covariance[0])
        joint: Floats = pulled.T @ pulled
        joint[: self.n, : self.n] = self.spread.covariance[0]
        return joint

    @cached_property
    def pair_freedom(self) -> Floats:
        """Shape (P,): degrees of freedom of θ_i − θ_j, for i < j in the order of ``numpy.triu_indices``."""
        own = self.contributions.pair_freedom(self.n)
        return np.asarray(self.spread.degrees_of_freedom(freedom=own)[0])

    @property
    def freedom_words(self) -> str:
        """The pairs' degrees of freedom in words, such as "12 to 18 degrees of freedom"."""
        low, high = f"{self.pair_freedom.min():.3g}", f"{self.pair_freedom.max():.3g}"
        words = low if low == high else f"{low} to {high}"
        return f"{words} degree{'' if words == '1' else 's'} of freedom"

    def freedom(self, contrasts: Floats) -> Floats:
        """Return the degrees of freedom of contrasts of the strengths. Shapes (k, n) to (k,)."""
        wide = np.hstack([contrasts, np.zeros((len(contrasts), self._further))])
        own = self.contributions.degrees_of_freedom(lambda: wide, len(wide))
        return np.asarray(self.spread.degrees_of_freedom(contrasts, own)[0])

    @property
    def parameter_freedom(self) -> Floats:
        """Shape (f,): degrees of freedom of the further parameters."""
        rows = np.eye(self.n + self._further)[self.n :]
        return self.contributions.degrees_of_freedom(lambda: rows, len(rows))

    @property
    def _further(self) -> int:
        return int(self.contributions.pulled.shape[1]) - self.n

    @property
    def overdispersion(self) -> float:
        """How many times as much the answers vary as if all were independent, φ."""
        return float(self.spread.scale[0])

    @property
    def shrinkage(self) -> float:
        """The share λ that is taken from independent answers."""
        return float(self.spread.share[0])

    @property
    def fewest_degrees_of_freedom(self) -> float:
        """Those of the pair with the fewest."""
        return float(self.pair_freedom.min())

    @property
    def most_degrees_of_freedom(self) -> float:
        """Those of the pair with the most."""
        return float(self.pair_freedom.max())


def by_observer(kind: Clustered, counts: Counts, answers: Answers, law: Law, point: Point, joint: Floats) -> ByObserver:
    """Return the covariance of ``kind``; ``joint`` is the inverse information, shape (n + f, n + f).

    Raises
    ------
    ResultsError
        If there are fewer than two observers.
    """
    return of_contributions(kind, counts.n, contributions(counts, answers, law, point, joint), joint)


def of_contributions(kind: Clustered, n: int, each: Contributions, joint: Floats) -> ByObserver:
    """Return the covariance of ``kind`` of ``n`` strengths from what each observer moves the estimates by."""
    spread = shrink(
        joint[None, :n, :n],
        each.pulled[None, :, :n],
        kind,
        freedom=each.freedom,
        products=None if each.products is None else each.products[None],
        at_least_model=kind == "scaled",
    )
    return ByObserver(n, each, spread)
