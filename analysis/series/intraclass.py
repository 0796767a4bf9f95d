"""Intraclass correlation of ratings [Shrout1979], with the intervals of [McGraw1996]."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.series.concordance import Coefficient

Floats = NDArray[np.float64]


def intraclass(ratings: Floats, *, level: float = 0.95) -> tuple[Coefficient, ...]:
    """Return ICC(2,1), ICC(3,1), ICC(2,k) and ICC(3,k).

    (2, ·) asks whether observers give the same numbers, (3, ·) whether they give them in the same proportion, each
    about a mean of their own; (·, 1) is the reliability of one observer, (·, k) that of the mean of all of them.

    Parameters
    ----------
    ratings
        Shape (observers, n), without gaps: each observer's rating of the same n things.

    Returns
    -------
    Four coefficients with F-distributed limits; without values where things do not vary, or with fewer than two
    observers or things. ``p`` is that of the F test that things do not differ.
    """
    names = "ICC(2,1)", "ICC(3,1)", "ICC(2,k)", "ICC(3,k)"
    k, n = ratings.shape
    if k < 2 or n < 2:
        return tuple(Coefficient(name, None) for name in names)
    mean = ratings.mean()
    of_things, of_observers = ratings.mean(axis=0), ratings.mean(axis=1)
    between = k * float(((of_things - mean) ** 2).sum()) / (n - 1)
    judges = n * float(((of_observers - mean) ** 2).sum()) / (k - 1)
    rest = ratings - of_things - of_observers[:, None] + mean
    error = float((rest**2).sum()) / ((n - 1) * (k - 1))
    smallest = 1e-24 * max(float((ratings**2).sum()), 1e-300)
    if between <= smallest:  # rounding of zero: nothing varies that could be told apart
        return tuple(Coefficient(name, None) for name in names)
    error = error if error > smallest else 0.0
    agreement = (between - error) / (between + (k - 1) * error + k * (judges - error) / n)
    consistency = (between - error) / (between + (k - 1) * error)
    if error == 0:
        mean_agreement = between / (between + judges / n)
        return tuple(Coefficient(a, b) for a, b in zip(names, (agreement, 1.0, mean_agreement, 1.0), strict=True))
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
        Coefficient(names[0], agreement, *alike, p),
        Coefficient(names[1], consistency, *consistent, p),
        Coefficient(names[2], (between - error) / of_mean if of_mean > 0 else None, stepped[0], stepped[1], p),
        Coefficient(names[3], (between - error) / between, 1 - 1 / low_f, 1 - 1 / high_f, p),
    )


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
