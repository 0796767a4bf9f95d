"""How far observers agree: Kendall's W and intraclass correlation on ratings, Fleiss' κ, Krippendorff's α on choices.

Each is 1 where all agree. W is 0 where ranks cancel out; κ and α are 0 where agreement is as expected by chance, and
negative below. Intraclass correlations follow [Shrout1979], their intervals [McGraw1996].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

import numpy as np

from analysis.series.choices import Choices
from documents.arrays import Floats
from documents.text import JsonResult


@dataclass(frozen=True, slots=True)
class Coefficient(JsonResult):
    """A coefficient with the limits of its interval; None where it is not defined, such as where nothing varies.

    ``p`` is of the test that there is no agreement, where it is made. ``least`` is the smallest value that means
    anything, where estimates can fall below it, and ``reason`` a sentence on a value that is not defined or below zero.
    """

    name: str
    value: float | None
    low: float | None = None
    high: float | None = None
    p: float | None = None
    least: float | None = None
    reason: str = ""


def ranks(values: Floats) -> Floats:
    """Return the ranks, from 1, of each row; ties have the mean of theirs. Shapes (..., n) to (..., n)."""
    order, place = np.argsort(values, axis=-1, kind="stable"), np.arange(values.shape[-1])
    risen = np.take_along_axis(values, order, axis=-1)
    first, last = np.ones((2, *values.shape), dtype=bool)
    first[..., 1:] = last[..., :-1] = risen[..., 1:] != risen[..., :-1]
    lowest = np.maximum.accumulate(np.where(first, place, 0), axis=-1)
    highest = np.minimum.accumulate(np.where(last, place, len(place))[..., ::-1], axis=-1)[..., ::-1]
    found = np.empty(values.shape)
    np.put_along_axis(found, order, (lowest + highest) / 2 + 1, axis=-1)
    found[np.isnan(values).any(axis=-1)] = np.nan
    return found


def kendall_w(ratings: Floats) -> float | None:
    """Return Kendall's coefficient of concordance, corrected for ties [Kendall1939].

    Parameters
    ----------
    ratings
        Shape (observers, n): each observer's ratings of the same n objects; only their order is used.

    Returns
    -------
    0 to 1; None where every observer rates all objects equally, or there is only one observer or object.
    """
    m, n = ratings.shape
    if m < 2 or n < 2:
        return None
    each = ranks(ratings)
    sums = each.sum(axis=0)
    ties = sum(float((count**3 - count).sum()) for count in (np.unique(row, return_counts=True)[1] for row in each))
    most = m * m * (n**3 - n) - m * ties
    return min(1.0, float(12 * ((sums - sums.mean()) ** 2).sum() / most)) if most > 0 else None


def fleiss_kappa(counts: Floats) -> float | None:
    """Return Fleiss' κ [Fleiss1971].

    Parameters
    ----------
    counts
        Shape (n, categories): how many of the m observers put each of n objects into each category. Rows sum to m.

    Returns
    -------
    At most 1; None where all are in the same category, or there is only one observer.
    """
    m = counts.sum(axis=1)
    if len(m) < 1 or m[0] < 2 or (m != m[0]).any():
        return None
    alike = float(((counts**2).sum(axis=1) - m).mean() / (m[0] * (m[0] - 1)))
    chance = float(((counts.sum(axis=0) / counts.sum()) ** 2).sum())
    return (alike - chance) / (1 - chance) if chance < 1 else None


def krippendorff_alpha(values: Floats, *, nominal: bool) -> float | None:
    """Return Krippendorff's α [Krippendorff2011].

    Parameters
    ----------
    values
        Shape (observers, n): each observer's value for each of n objects; NaN for none.
    nominal
        Whether values are categories (δ² = 1 or 0) rather than numbers (δ² = (v − w)²).

    Returns
    -------
    At most 1; None where all values are equal, or no object has two of them.
    """
    values = values[:, np.isfinite(values).sum(axis=0) > 1]
    given = np.isfinite(values)
    if not given.any():
        return None
    known, which = np.unique(values[given], return_inverse=True)
    place = np.nonzero(given)[1]
    counts = np.zeros((values.shape[1], len(known)))
    np.add.at(counts, (place, which.ravel()), 1.0)
    each = counts.sum(axis=1)
    distance = (known[:, None] != known).astype(np.float64) if nominal else (known[:, None] - known) ** 2
    within = float((np.einsum("nk,kl,nl->n", counts, distance, counts) / (each - 1)).sum())
    total = counts.sum(axis=0)
    overall = float(total @ distance @ total) / (total.sum() - 1)
    return float(1 - within / overall) if overall > 0 else None


def with_jackknife(name: str, coefficient: Callable[[Floats], float | None], rows: Floats) -> Coefficient:
    """Return the coefficient of ``rows``, a row for each observer, with 95 % limits by the jackknife over observers.

    Tukey's pseudo-values [Miller1974], by Student's t, limited to 1. A bootstrap over observers would be biased: an
    observer drawn twice agrees with themselves. No limits with fewer than four observers, where a coefficient is not
    defined, or where they would have no width or leave out the estimate.
    """
    from scipy.special import stdtrit

    value = coefficient(rows)
    people = len(rows)
    if value is None:
        return Coefficient(name, None, reason=_FEW if people < 2 else _ALL_ALIKE)
    reason = _BELOW_CHANCE if value < 0 else ""
    if people < 4:
        return Coefficient(name, value, reason=reason)
    left_out = [coefficient(np.delete(rows, number, axis=0)) for number in range(people)]
    known = np.array([without for without in left_out if without is not None])
    if len(known) < people:
        return Coefficient(name, value, reason=reason)
    pseudo = people * value - (people - 1) * known
    reach = float(stdtrit(people - 1, 0.975)) * float(pseudo.std(ddof=1)) / np.sqrt(people)
    low, high = float(pseudo.mean() - reach), min(1.0, float(pseudo.mean() + reach))
    # Pseudo-values that are equal but for rounding tell nothing of the spread; one question often gives such.
    if high - low <= 1e-9 or not low <= value <= high:
        return Coefficient(name, value, reason=f"{reason} {_NO_LIMITS}".strip())
    return Coefficient(name, value, low, high, reason=reason)


_NO_LIMITS = "No interval: the coefficient hardly changes whichever observer is left out, as with a single series."
_FEW = "Not defined: at least two observers must have answered all of them."
_FEW_THINGS = "Not defined: at least two series must have been rated."
_ALL_ALIKE = "Not defined: all choices are the same, so agreement by chance is complete already."
_BELOW_CHANCE = "Below 0: the observers agree less often than by chance."
_NO_ORDER = "Not defined: every observer rates all series alike, so there is no order to agree on."
_NO_SPREAD = "Not defined: the mean ratings of the series are all equal, so there is nothing to agree on."
_NEGATIVE = (
    "No agreement: for the same series, the observers' ratings differ more from each other than the mean ratings of "
    "the series do. The estimate falls below 0 then, where it has no meaning."
)
_NO_MEAN = (
    "Not defined: for the same series, the observers' ratings differ more than the means of series and observers do."
)


def kendall_w_p(w: float | None, observers: int, things: int) -> float | None:
    """Return the p value of W without agreement: m (n − 1) W by χ² with n − 1 degrees of freedom."""
    from scipy.special import chdtrc

    return None if w is None else float(chdtrc(things - 1, observers * (things - 1) * w))


def intraclass(ratings: Floats, *, level: float = 0.95) -> tuple[Coefficient, ...]:
    """Return ICC(2,1), ICC(3,1), ICC(2,k) and ICC(3,k).

    (2, ·) is absolute agreement; (3, ·) is consistency, which ignores each observer's mean; (·, 1) is the reliability
    of a single observer, (·, k) that of the mean over observers.

    Parameters
    ----------
    ratings
        Shape (observers, n), without gaps: each observer's rating of the same n objects.

    Returns
    -------
    Four coefficients with F-distributed limits; without values where objects do not vary, or with fewer than two
    observers or objects. ``p`` is of the F test that objects do not differ. Estimates below 0 are given as they are,
    with the reason; those of the mean over observers have no lower bound.
    """
    names = "ICC(2,1)", "ICC(3,1)", "ICC(2,k)", "ICC(3,k)"
    k, n = ratings.shape
    if k < 2 or n < 2:
        return tuple(Coefficient(name, None, reason=_FEW if k < 2 else _FEW_THINGS) for name in names)
    mean = ratings.mean()
    of_objects, of_observers = ratings.mean(axis=0), ratings.mean(axis=1)
    between = k * float(((of_objects - mean) ** 2).sum()) / (n - 1)
    judges = n * float(((of_observers - mean) ** 2).sum()) / (k - 1)
    rest = ratings - of_objects - of_observers[:, None] + mean
    error = float((rest**2).sum()) / ((n - 1) * (k - 1))
    smallest = 1e-24 * max(float((ratings**2).sum()), 1e-300)
    if between <= smallest:  # rounding of zero: objects do not vary
        return tuple(Coefficient(name, None, reason=_NO_SPREAD) for name in names)
    error = error if error > smallest else 0.0
    agreement = (between - error) / (between + (k - 1) * error + k * (judges - error) / n)
    consistency = (between - error) / (between + (k - 1) * error)
    if error == 0:
        mean_agreement = between / (between + judges / n)
        return tuple(_reliability(a, b) for a, b in zip(names, (agreement, 1.0, mean_agreement, 1.0), strict=True))
    of_mean = between + (judges - error) / n
    from scipy.special import fdtrc, fdtri

    p = float(fdtrc(n - 1, (n - 1) * (k - 1), between / error))
    f = between / error
    upper_tail = (1 + level) / 2
    low_f = f / float(fdtri(n - 1, (n - 1) * (k - 1), upper_tail))
    high_f = f * float(fdtri((n - 1) * (k - 1), n - 1, upper_tail))
    consistent = (low_f - 1) / (low_f + k - 1), (high_f - 1) / (high_f + k - 1)
    alike = _agreement_limits(between, judges, error, agreement, (k, n), upper_tail)
    stepped = [k * end / (1 + (k - 1) * end) if 1 + (k - 1) * end > 0 else None for end in alike]
    return (
        _reliability(names[0], agreement, *alike, p),
        _reliability(names[1], consistency, *consistent, p),
        _reliability(names[2], (between - error) / of_mean if of_mean > 0 else None, stepped[0], stepped[1], p),
        _reliability(names[3], (between - error) / between, 1 - 1 / low_f, 1 - 1 / high_f, p),
    )


def _reliability(
    name: str, value: float | None, low: float | None = None, high: float | None = None, p: float | None = None
) -> Coefficient:
    """Return a share of variance, which means nothing below 0; a limit that is no number is not defined."""
    reason = _NO_MEAN if value is None else _NEGATIVE if value < 0 else ""
    low, high = (None if end is None or not isfinite(end) else end for end in (low, high))
    return Coefficient(name, value, low, high, p, 0.0, reason)


def _agreement_limits(
    between: float, judges: float, error: float, agreement: float, shape: tuple[int, int], upper_tail: float
) -> tuple[float, float]:
    """Return the limits of ICC(2,1), with Satterthwaite's degrees of freedom [McGraw1996, Table 7]."""
    from scipy.special import fdtri

    k, n = shape
    share = k * agreement / (n * (1 - agreement)) if agreement < 1 else np.inf
    rest = 1 + k * agreement * (n - 1) / (n * (1 - agreement))
    df = (share * judges + rest * error) ** 2 / (
        (share * judges) ** 2 / (k - 1) + (rest * error) ** 2 / ((n - 1) * (k - 1))
    )
    low_f, high_f = float(fdtri(n - 1, df, upper_tail)), float(fdtri(df, n - 1, upper_tail))
    spread = k * judges + (k * n - k - n) * error
    low = n * (between - low_f * error) / (low_f * spread + n * between)
    high = n * (high_f * between - error) / (spread + n * high_f * between)
    return float(low), float(high)


@dataclass(frozen=True, slots=True)
class SeriesAgreement(JsonResult):
    """Coefficients over the ``observers`` who completed all ``series``.

    ``ratings``, by scale, are Kendall's W and the intraclass correlations over the series; ``choices`` are Fleiss' κ of
    the positions chosen, and Krippendorff's α of them as categories and as levels (their logarithm if all are above 0).
    """

    observers: int
    series: int
    ratings: dict[str, tuple[Coefficient, ...]]
    choices: tuple[Coefficient, ...]


def series_agreement(choices: Choices) -> SeriesAgreement:
    """Return the agreement between observers; of repeated choices from a series by an observer, the first counts."""
    plan = choices.design
    index = np.full((len(choices.observers), len(plan.series)), -1)
    level = np.full(index.shape, np.nan)
    for choice in choices.choices:
        if index[choice.observer, choice.series] < 0:
            index[choice.observer, choice.series] = choice.index
            level[choice.observer, choice.series] = plan.series[choice.series].levels[choice.index]
    whole = list(choices.complete)
    index, level = index[whole], level[whole]
    if plan.along and (level > 0).all():
        level = np.log(level)
    ratings: dict[str, tuple[Coefficient, ...]] = {}
    for scale in choices.scales:
        rows = choices.rating_matrix(scale)
        rows = rows[np.isfinite(rows).all(axis=1)]
        w = kendall_w(rows)
        # By chance alone W is 1/m on average: a test is more informative than an interval.
        why = "" if w is not None else _FEW if len(rows) < 2 else _FEW_THINGS if rows.shape[1] < 2 else _NO_ORDER
        ratings[scale] = Coefficient("Kendall's W", w, p=kendall_w_p(w, *rows.shape), reason=why), *intraclass(rows)
    places = index.astype(np.float64)
    coefficients = (
        with_jackknife("Fleiss' κ", _kappa, places),
        with_jackknife("Krippendorff's α, nominal", lambda rows: krippendorff_alpha(rows, nominal=True), places),
        with_jackknife("Krippendorff's α, interval", lambda rows: krippendorff_alpha(rows, nominal=False), level),
    )
    return SeriesAgreement(len(whole), len(plan.series), ratings, coefficients)


def _kappa(places: Floats) -> float | None:
    """Return Fleiss' κ of the places chosen, shape (observers, series)."""
    if not places.size:
        return None
    return fleiss_kappa((places.T[:, :, None] == np.arange(places.max() + 1)).sum(axis=1).astype(np.float64))
