"""How far the observers of an experiment with series agree, on ratings and on choices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.series.choices import Choices
from analysis.series.concordance import (
    Coefficient,
    fleiss_kappa,
    kendall_w,
    kendall_w_p,
    krippendorff_alpha,
    with_jackknife,
)
from analysis.series.intraclass import intraclass

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SeriesAgreement:
    """Coefficients over ``observers`` who went through all ``series``.

    ``ratings`` holds, by scale, Kendall's W and the intraclass correlations over the series; ``choices`` Fleiss' κ on
    the places chosen, and Krippendorff's α on them as names and as levels (their logarithm if all are above 0).
    """

    observers: int
    series: int
    ratings: dict[str, tuple[Coefficient, ...]]
    choices: tuple[Coefficient, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "observers": self.observers,
            "series": self.series,
            "ratings": {scale: [one.to_json() for one in found] for scale, found in self.ratings.items()},
            "choices": [one.to_json() for one in self.choices],
        }


def agreement(choices: Choices) -> SeriesAgreement:
    """Return how far observers agree. Of several choices by one observer from one series the first one counts."""
    plan = choices.design
    index = np.full((len(choices.observers), len(plan.series)), -1)
    level = np.full(index.shape, np.nan)
    for one in choices.choices:
        if index[one.observer, one.series] < 0:
            index[one.observer, one.series] = one.index
            level[one.observer, one.series] = plan.series[one.series].levels[one.index]
    whole = list(choices.complete)
    index, level = index[whole], level[whole]
    if plan.along and (level > 0).all():
        level = np.log(level)
    ratings: dict[str, tuple[Coefficient, ...]] = {}
    for scale in choices.scales:
        rows = choices.rating_matrix(scale)
        rows = rows[np.isfinite(rows).all(axis=1)]
        w = kendall_w(rows)
        # Chance alone makes W 1/m on average: a test says more than an interval.
        ratings[scale] = Coefficient("Kendall's W", w, p=kendall_w_p(w, *rows.shape)), *intraclass(rows)
    places = index.astype(np.float64)
    found = (
        with_jackknife("Fleiss' κ", _kappa, places),
        with_jackknife("Krippendorff's α, nominal", lambda rows: krippendorff_alpha(rows, nominal=True), places),
        with_jackknife("Krippendorff's α, interval", lambda rows: krippendorff_alpha(rows, nominal=False), level),
    )
    return SeriesAgreement(len(whole), len(plan.series), ratings, found)


def _kappa(places: Floats) -> float | None:
    """Return Fleiss' κ of the places chosen, shape (observers, series)."""
    if not places.size:
        return None
    return fleiss_kappa((places.T[:, :, None] == np.arange(places.max() + 1)).sum(axis=1).astype(np.float64))
