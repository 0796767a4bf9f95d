"""Means and shares with intervals that allow for the correlation between an observer's answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.bootstrap import tails
from documents.arrays import Floats
from documents.text import JsonResult

REPLICATES = 4000
SEED = 41414
_BLOCK_NUMBERS = 4_000_000
_EQUAL = 1e-12  # what rounding leaves between equal numbers, as a share of them


@dataclass(frozen=True, slots=True)
class Estimated(JsonResult):
    """A value with the limits of its interval, None where there is none, and the numbers of answers and observers."""

    value: float | None
    low: float | None
    high: float | None
    answers: int
    observers: int


def means(total: Floats, count: Floats, *, level: float = 0.95, replicates: int = REPLICATES) -> list[Estimated]:
    """Return Σ total / Σ count over the observers, with an interval by bootstrap over observers.

    The interval is the percentile interval at levels widened for few observers [Hesterberg2015]. Observers are drawn
    from the sorted rows with a fixed seed: the result does not depend on their order or names.

    Parameters
    ----------
    total, count
        Shape (observers, k): the sum of each observer's answers to each of k questions, and how many there are.
    level
        Coverage of the interval, 0 to 1.

    Returns
    -------
    k estimates. No value without an answer; no interval with answers of fewer than two observers, if fewer than three
    quarters of the bootstrap samples have an answer, or where it would have no width, as of equal answers.
    """
    total, count = np.asarray(total, np.float64), np.asarray(count, np.float64)
    order = np.lexsort(np.hstack([count, total]).T)
    total, count = total[order], count[order]
    observers, columns = total.shape
    samples = np.empty((replicates, columns))
    random = np.random.default_rng(SEED)
    block = max(1, _BLOCK_NUMBERS // observers)
    for start in range(0, replicates, block):
        size = min(block, replicates - start)
        weights = random.multinomial(observers, np.full(observers, 1 / observers), size).astype(np.float64)
        sums, counts = weights @ total, weights @ count
        samples[start : start + size] = np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0)
    estimates: list[Estimated] = []
    for column in range(columns):
        people = int((count[:, column] > 0).sum())
        answers = float(count[:, column].sum())
        value = float(total[:, column].sum() / answers) if answers > 0 else None
        valid = np.sort(samples[np.isfinite(samples[:, column]), column])[:, None]
        low = high = None
        if value is not None and people > 1 and len(valid) >= 0.75 * replicates:
            tail = np.array([tails.widened((1 - level) / 2, people)])
            ends = float(tails.lower(valid, tail, 0)[0]), float(tails.upper(valid, 1 - tail, 0)[0])
            low, high = ends if ends[1] - ends[0] > _EQUAL * max(1.0, abs(value)) else (None, None)
        estimates.append(Estimated(value, low, high, round(answers), people))
    return estimates


def shares(chosen: Floats, count: Floats, *, level: float = 0.95) -> list[Estimated]:
    """Return Σ chosen / Σ count over the observers, with Wilson's interval [Wilson1927].

    Where observers answered several times, the interval uses the effective number of answers: their number over the
    design effect, which is the variance of the share between observers over that of independent answers [Kish1965],
    and at least 1. If it is above 1, Student's quantile takes the place of the normal one. Where the design effect
    cannot be estimated, because the share is 0 or 1, the number of observers is used.

    Parameters
    ----------
    chosen, count
        Shape (observers, k): how often each observer chose each of k, and out of how many choices.
    level
        Coverage of the interval, 0 to 1.

    Returns
    -------
    k estimates; no value without an answer.
    """
    estimates: list[Estimated] = []
    for column, counts in zip(np.asarray(chosen, np.float64).T, np.asarray(count, np.float64).T, strict=True):
        order = np.lexsort([column, counts])
        times, of = column[order], counts[order]
        answers, people = float(of.sum()), int((of > 0).sum())
        if answers <= 0:
            estimates.append(Estimated(None, None, None, 0, 0))
            continue
        share = float(times.sum()) / answers
        effect = 1.0
        if of.max() > 1:
            variance = share * (1 - share)
            effect = _design_effect(times, of, share, variance) if variance > 0 and people > 1 else answers / people
        student = of.max() > 1 and effect > 1 and 0 < share < 1 and people > 1
        low, high = _wilson(share, answers / effect, _quantile(level, people if student else None))
        estimates.append(Estimated(share, low, high, round(answers), people))
    return estimates


def bounded_means(
    total: Floats, squares: Floats, count: Floats, most: float, *, level: float = 0.95, step: float | None = None
) -> list[Estimated]:
    """Return Σ total / Σ count over the observers for answers from 0 to ``most``, such as weighted choices.

    Most such answers are 0 where a picture was rarely chosen; a bootstrap then gives intervals that are too short. The
    mean over ``most`` is a share, whose interval is Wilson's [Wilson1927] at the number of yes-or-no answers that would
    have the same variance. That variance is the sample's; it includes the design effect, as in `shares`. Student's
    quantile is used, unless observers answered several times and their answers scatter no more than independent ones.

    Few answers on a scale are often equal, and then say nothing of how far others are from them. With ``step`` the
    variance is that of the answers and of one more, which differs from their mean by a step; decision 0078 has the
    coverage.

    Parameters
    ----------
    total, squares, count
        Shape (observers, k): the sum of each observer's answers to each of k questions, the sum of their squares, and
        how many there are.
    most
        The largest answer, above 0.
    level
        Coverage of the interval, 0 to 1.
    step
        How far apart two answers are at least, in the unit of ``most``; None: no further answer is assumed.

    Returns
    -------
    k estimates. No value without an answer; no interval with answers of fewer than two observers or, without ``step``,
    if all answers are the same, such as 0.
    """
    estimates: list[Estimated] = []
    columns = (np.asarray(part, np.float64).T for part in (total, squares, count))
    for column, squared, counts in zip(*columns, strict=True):
        order = np.lexsort([squared, column, counts])
        sums, of = column[order], counts[order]
        answers, people = float(of.sum()), int((of > 0).sum())
        if answers <= 0:
            estimates.append(Estimated(None, None, None, 0, 0))
            continue
        mean = float(sums.sum()) / answers
        share = mean / most
        spread = float(squared[order].sum()) / answers - mean**2
        low = high = None
        varies = 0 < share < 1 and spread > 1e-12 * most**2
        if people > 1 and (varies or step is not None):
            variance = max(0.0, spread) * answers / (answers - 1) / most**2
            inner = share
            if step is not None:
                variance, inner = _with_one_more(variance, share, answers, step / most)
            effect = _design_effect(sums / most, of, share, variance) if of.max() > 1 else 1.0
            quantile = _quantile(level, people if of.max() <= 1 or effect > 1 else None)
            low, high = (
                most * end for end in _wilson(share, answers * inner * (1 - inner) / (variance * effect), quantile)
            )
        estimates.append(Estimated(mean, low, high, round(answers), people))
    return estimates


def _with_one_more(variance: float, share: float, answers: float, step: float) -> tuple[float, float]:
    """Return the variance with one more answer, a ``step`` off the mean, and the share that it leaves off the ends."""
    off = step / (answers + 1)
    return ((answers - 1) * variance + step * off * answers) / answers, min(max(share, off), 1 - off)


def _wilson(share: float, answers: float, quantile: float) -> tuple[float, float]:
    z2 = quantile**2
    middle = (share + z2 / (2 * answers)) / (1 + z2 / answers)
    half = np.sqrt(z2 * (share * (1 - share) / answers + z2 / (4 * answers**2))) / (1 + z2 / answers)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def _quantile(level: float, people: int | None) -> float:
    """Return Student's quantile for so many people, or the normal one."""
    from scipy.special import ndtri, stdtrit

    tail = (1 + level) / 2
    return float(ndtri(tail) if people is None else stdtrit(people - 1, tail))


def _design_effect(sums: Floats, count: Floats, mean: float, variance: float) -> float:
    """Return the variance of the mean over that of as many independent answers of ``variance`` each, at least 1."""
    people = (count > 0).sum()
    among = ((sums - mean * count) ** 2).sum() * people / (people - 1)
    return float(max(1.0, among / (count.sum() * variance)))
