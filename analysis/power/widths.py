"""How wide the intervals of log10 scores are that a report would show. A new kind of interval is one more line here."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from analysis.power.plan import Interval
from analysis.power.studies import Studies
from analysis.scaling.bradley_terry import Method

Floats = NDArray[np.float64]

BOOTSTRAPS = 1000


def widths(studies: Studies, random: np.random.Generator) -> Floats:
    """Return the width of each item's interval of log10 score in each study, shape (B, n)."""
    return _WAYS[studies.plan.interval](studies, random)


def _wald(studies: Studies, random: np.random.Generator) -> Floats:
    """Twice a quantile times the standard error by the delta method, as in `analysis.report.summary`."""
    from scipy.special import ndtri, softmax, stdtrit

    tail = (1 + studies.plan.level) / 2
    df = studies.plan.degrees_of_freedom(studies.observers)
    quantile = float(ndtri(tail) if df is None else stdtrit(df, tail))
    score = softmax(studies.theta, axis=1)
    # The gradient of log s_i is e_i − s: its variance is C_ii − 2 (C s)_i + sᵀ C s.
    pulled = (studies.covariance @ score[:, :, None])[:, :, 0]
    variance = np.diagonal(studies.covariance, axis1=1, axis2=2) - 2 * pulled
    variance = variance + (score * pulled).sum(axis=1, keepdims=True)
    return np.asarray(2 * quantile * np.sqrt(np.maximum(variance, 0)) / np.log(10))


def _bootstrap(studies: Studies, random: np.random.Generator) -> Floats:
    """The default of `analysis.bootstrap.intervals`, each study with observers drawn anew 1000 times."""
    from analysis.bootstrap.intervals import intervals
    from analysis.bootstrap.replicates import resample_counts

    plan, people = studies.plan, studies.observers
    first, second = plan.pairs
    names = [f"{number:04d}" for number in range(people)]
    found = np.empty_like(studies.theta)
    for place, (won, separated) in enumerate(zip(studies.won, studies.separated, strict=True)):
        counts = np.zeros((people, len(plan.items), len(plan.items)))
        counts[:, first, second] = won
        counts[:, second, first] = plan.times - won
        method: Method = "firth" if separated else "ml"
        seed = int(random.integers(2**31))
        drawn = resample_counts(counts, plan.items, names, replicates=BOOTSTRAPS, seed=seed, method=method)
        ends = intervals(drawn, "log10_score", level=plan.level)
        found[place] = ends.high - ends.low
    return found


_WAYS: dict[Interval, Callable[[Studies, np.random.Generator], Floats]] = {"wald": _wald, "bootstrap": _bootstrap}
