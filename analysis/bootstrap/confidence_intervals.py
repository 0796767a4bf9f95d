"""Confidence intervals of strengths, scores and differences.

| kind | ends |
|---|---|
| ``expanded-bca`` | both corrections below at once; the default |
| ``bca`` | percentiles, corrected for bias and acceleration |
| ``expanded`` | percentiles, at levels widened for few observers |
| ``percentile`` | percentiles of the replicates |
| ``studentised`` | percentiles of t in the replicates, times the sandwich standard error |
| ``sandwich`` | the t distribution with S − 1 degrees of freedom, times the sandwich standard error |
| ``model`` | normal quantile times the model's standard error, which takes all answers for independent |

``benchmarks/interval_coverage.py`` measures how often each contains the truth; decision 0078 has the figures.

Where all answers together are separated, observers agree without exception about some item, in every draw. Each
interval then reaches at least as far as the ``model``'s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from analysis.bootstrap import tails
from analysis.bootstrap.influence import influences, standard_errors
from analysis.bootstrap.replicates import BLOCK_NUMBERS, Name, Quantity, Replicates
from analysis.errors import ResultsError
from documents import Finding, one_blas_thread
from documents.arrays import Floats
from documents.text import JsonResult

Kind = Literal["expanded-bca", "bca", "expanded", "percentile", "studentised", "sandwich", "model"]
KINDS: tuple[Kind, ...] = get_args(Kind)
DEFAULT: Kind = "expanded-bca"
Ends = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class Intervals(JsonResult):
    """Intervals of k values, and what they rest on.

    Attributes
    ----------
    quantity, kind, level
        Of what, which of `KINDS`, and the chance to contain the truth, such as 0.95.
    names
        For each value the name of its item, or the names of its two items.
    estimate, low, high
        Shape (k,): from all answers, and the ends. An end is infinite (0 or 1 for a score) where more replicates than
        it leaves outside have no fit.
    replicates, separated, without_fit
        How many observers' draws there were, how many of these had to be fitted by Firth's, and how many had no fit.
    whole_separated
        Whether all answers together had to be, so that intervals reach at least as far as the model's.
    """

    quantity: Name
    kind: Kind
    level: float
    names: tuple[tuple[str, ...], ...]
    estimate: Floats
    low: Floats
    high: Floats
    replicates: int
    separated: int
    without_fit: int
    whole_separated: bool

    json_keys: ClassVar = dict.fromkeys(("names", "estimate", "low", "high"))
    json_also: ClassVar = ("intervals",)

    @property
    def intervals(self) -> list[dict[str, Any]]:
        """Each value with its item or items and the ends of its interval."""
        rows = zip(self.names, self.estimate, self.low, self.high, strict=True)
        return [dict(zip(("items", "estimate", "low", "high"), row, strict=True)) for row in rows]


@one_blas_thread()
def intervals(
    replicates: Replicates,
    quantity: Name = "theta",
    *,
    kind: Kind = DEFAULT,
    level: float = 0.95,
) -> Intervals:
    """Return an interval for each item's ``quantity``, or for each pair's ``difference`` (pairs i < j in order).

    Parameters
    ----------
    replicates
        Draws of observers, as `resample` returns them.
    quantity
        What the interval is of: ``theta``, ``score``, ``log10_score``, or the ``difference`` of each pair.
    kind
        The kind of interval; the default keeps its coverage for few observers.
    level
        The coverage, between 0 and 1.

    Returns
    -------
    Intervals
        Names, lower and upper ends.

    Raises
    ------
    ResultsError
        If ``quantity`` or ``kind`` is unknown or ``level`` is not between 0 and 1.

    Examples
    --------
    >>> from analysis.bootstrap import resample
    >>> from analysis.comparisons import Answer, from_answers
    >>> votes = {"1": "ababcb", "2": "abacbc", "3": "bacacb", "4": "abcacb", "5": "abaccb"}  # winner, loser, ...
    >>> answers = [Answer(v[i], v[i + 1], observer=name) for name, v in votes.items() for i in (0, 2, 4)]
    >>> replicates = resample(from_answers(answers), replicates=100)
    >>> differences = intervals(replicates, "difference")
    >>> differences.names
    (('a', 'b'), ('a', 'c'), ('b', 'c'))
    >>> bool((differences.low < differences.estimate).all() and (differences.estimate < differences.high).all())
    True
    """
    if kind not in KINDS:
        raise ResultsError(Finding(f"there is no kind of interval '{kind}'", remedy="one of: " + ", ".join(KINDS)))
    if not 0 < level < 1:
        raise ResultsError(Finding(f"the level is {level:g}", remedy="give one between 0 and 1, such as 0.95"))
    whole = Quantity.of_items(quantity, len(replicates.items))
    rows = len(replicates.theta) * (len(replicates.observers) if kind == "studentised" else 1)
    parts = list(whole.parts(BLOCK_NUMBERS // rows))
    ends = [_ends(replicates, part, kind, (1 - level) / 2) for part in parts]
    least, most = whole.limits
    pairs = zip(whole.first.tolist(), whole.second.tolist(), strict=True)
    return Intervals(
        quantity=quantity,
        kind=kind,
        level=level,
        names=tuple(tuple(replicates.items[item] for item in dict.fromkeys(pair)) for pair in pairs),
        estimate=whole.values(replicates.fit.theta),
        low=np.maximum(np.concatenate([low for low, _ in ends]), least),
        high=np.minimum(np.concatenate([high for _, high in ends]), most),
        replicates=len(replicates.theta),
        separated=int(replicates.separated.sum()),
        without_fit=int(replicates.without_fit.sum()),
        whole_separated=replicates.whole_separated,
    )


def _ends(replicates: Replicates, quantity: Quantity, kind: Kind, tail: float) -> Ends:
    low, high = _WAYS[kind](replicates, quantity, tail)
    if replicates.whole_separated:
        model_low, model_high = _model(replicates, quantity, tail)
        return np.minimum(low, model_low), np.maximum(high, model_high)
    return low, high


def _percentiles(replicates: Replicates, quantity: Quantity, tail: float) -> Ends:
    values, without = _sorted(replicates, quantity)
    levels = np.full(values.shape[1], tail)
    return tails.lower(values, levels, without), tails.upper(values, 1 - levels, without)


def _expanded(replicates: Replicates, quantity: Quantity, tail: float) -> Ends:
    return _percentiles(replicates, quantity, tails.widened(tail, len(replicates.observers)))


def _bca(replicates: Replicates, quantity: Quantity, tail: float) -> Ends:
    values, without = _sorted(replicates, quantity)
    estimate = quantity.values(replicates.fit.theta)
    # Draws that give the estimate but for rounding are ties.
    reach = 1e-9 * np.abs(values).max(axis=0, initial=0.0)
    below = ((values < estimate - reach).sum(axis=0) + (values <= estimate + reach).sum(axis=0)) / 2
    share = np.clip(below, 0.5, max(0.5, len(values) - 0.5)) / max(1, len(values))
    sound = ~replicates.left_out.without_fit
    speed = tails.acceleration(quantity.values(replicates.left_out.theta[sound]))
    low, high = (tails.bias_corrected(level, share, speed) for level in (tail, 1 - tail))
    return tails.lower(values, low, without), tails.upper(values, high, without)


def _expanded_bca(replicates: Replicates, quantity: Quantity, tail: float) -> Ends:
    return _bca(replicates, quantity, tails.widened(tail, len(replicates.observers)))


def _studentised(replicates: Replicates, quantity: Quantity, tail: float) -> Ends:
    estimate, error = _sandwich_error(replicates, quantity)
    sound = ~replicates.without_fit
    theta, weights = replicates.theta[sound], replicates.weights[sound]
    n, people = len(replicates.items), len(replicates.observers)
    size = max(1, BLOCK_NUMBERS // (n * max(n, people)))
    t = np.empty((len(theta), len(estimate)))
    for start in range(0, len(theta), size):
        chosen = slice(start, start + size)
        pulled = influences(replicates.by_observer, weights[chosen], theta[chosen])
        errors = standard_errors(quantity.slopes(theta[chosen], pulled), weights[chosen])
        off = quantity.values(theta[chosen]) - estimate
        # Where all observers drawn agree there is no spread to divide by: t is as large as can be.
        t[chosen] = np.divide(off, errors, out=np.copysign(np.where(off == 0, 0, np.inf), off), where=errors > 0)
    t.sort(axis=0)
    without = int(replicates.without_fit.sum())
    levels = np.full(len(estimate), tail)
    return (
        estimate - tails.upper(t, 1 - levels, without) * error,
        estimate - tails.lower(t, levels, without) * error,
    )


def _sandwich(replicates: Replicates, quantity: Quantity, tail: float) -> Ends:
    from scipy.special import stdtrit

    estimate, error = _sandwich_error(replicates, quantity)
    reach = float(stdtrit(len(replicates.observers) - 1, 1 - tail)) * error
    return estimate - reach, estimate + reach


def _model(replicates: Replicates, quantity: Quantity, tail: float) -> Ends:
    from scipy.special import ndtri

    theta, covariance = replicates.fit.theta, replicates.fit.covariance
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))
    error = np.sqrt((quantity.slopes(theta[None], root.T[None])[0] ** 2).sum(axis=0))
    reach = float(ndtri(1 - tail)) * error
    estimate = quantity.values(theta)
    return estimate - reach, estimate + reach


_WAYS: dict[Kind, Callable[[Replicates, Quantity, float], Ends]] = {
    "expanded": _expanded,
    "percentile": _percentiles,
    "bca": _bca,
    "expanded-bca": _expanded_bca,
    "studentised": _studentised,
    "sandwich": _sandwich,
    "model": _model,
}


def _sandwich_error(replicates: Replicates, quantity: Quantity) -> tuple[Floats, Floats]:
    theta, ones = replicates.fit.theta[None], np.ones((1, len(replicates.observers)))
    pulled = influences(replicates.by_observer, ones, theta)
    return quantity.values(theta)[0], standard_errors(quantity.slopes(theta, pulled), ones)[0]


def _sorted(replicates: Replicates, quantity: Quantity) -> tuple[Floats, int]:
    sound = ~replicates.without_fit
    return np.sort(quantity.values(replicates.theta[sound]), axis=0), int((~sound).sum())
