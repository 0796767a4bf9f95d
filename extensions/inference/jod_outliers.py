"""Observers who answer otherwise than the rest, by pwcmp's rule [PerezOrtiz2017].

The log likelihood of an observer's answers is computed on the scale of all other observers. How far it lies below the
first quartile of all observers, in interquartile ranges, is the observer's distance: pwcmp advises to look at those
near or above 1.5 and to reject none by this alone. Quartiles are MATLAB's (`numpy.quantile` by ``hazen``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from analysis.choices import DistancePrior
from analysis.comparisons import Comparisons
from documents.arrays import Floats
from documents.text import JsonResult
from extensions.inference.distance_prior import JOD_PER_SD
from extensions.inference.jod_fits import fit_jod

WORTH_A_LOOK = 1.5
LEAST_LOG = float(np.log(1e-200))  # pwcmp's least probability of a pair's answers
FEWEST = 4  # observers that have quartiles
MOST_NUMBERS = 4_000_000


@dataclass(frozen=True, slots=True)
class ObserverLikelihood(JsonResult):
    """How likely one observer's answers are on the scale of the others.

    Attributes
    ----------
    name
        The observer.
    log_likelihood
        Σ log binomial probability of the answers to each pair, natural logarithm, summed over groups.
    distance
        In interquartile ranges below the first quartile of all observers; 0 for those above it.
    """

    name: str
    log_likelihood: float
    distance: float
    json_also: ClassVar = ("worth_a_look",)

    @property
    def worth_a_look(self) -> bool:
        """Whether the distance is 1.5 or more."""
        return self.distance >= WORTH_A_LOOK


def observer_likelihoods(parts: Sequence[Comparisons], prior: DistancePrior) -> tuple[ObserverLikelihood, ...]:
    """Return each observer's likelihood and distance, in the order of their names; empty for fewer than four.

    ``parts`` are the answers of each group. A group whose scale without the observer does not exist counts nothing.
    """
    total: dict[str, float] = {}
    for part in parts:
        people, wins = part.observers, part.wins
        block = max(1, MOST_NUMBERS // len(part.items) ** 2)
        for start in range(0, len(people), block):
            by_observer = part.wins_by_observer(slice(start, start + block))
            rest = fit_jod(wins - by_observer, prior).jod if len(people) > 1 else np.full((1, 1), np.nan)
            for name, counts, jod in zip(people[start : start + block], by_observer, rest, strict=True):
                own = 0.0 if np.isnan(jod).any() else _log_likelihood(counts, jod)
                total[name] = total.get(name, 0.0) + own
    names = sorted(total)
    if len(names) < FEWEST:
        return ()
    values = np.array([total[name] for name in names])
    quarter, upper = np.quantile(values, [0.25, 0.75], method="hazen").tolist()
    spread = upper - quarter
    below = np.maximum(quarter - values, 0.0)
    distances = np.divide(below, spread, out=np.zeros_like(below), where=spread > 0)
    rows = zip(names, values.tolist(), distances.tolist(), strict=True)
    return tuple(ObserverLikelihood(*row) for row in rows)


def _log_likelihood(wins: Floats, jod: Floats) -> float:
    from scipy.special import gammaln, log_ndtr

    first, second = np.triu_indices(len(jod), 1)
    won, lost = wins[first, second], wins[second, first]
    d = (jod[first] - jod[second]) / JOD_PER_SD
    logs = gammaln(won + lost + 1) - gammaln(won + 1) - gammaln(lost + 1) + won * log_ndtr(d) + lost * log_ndtr(-d)
    return float(np.maximum(logs, LEAST_LOG)[won + lost > 0].sum())
