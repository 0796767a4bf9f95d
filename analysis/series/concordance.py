"""How far observers agree: Kendall's W on ratings, Fleiss' κ and Krippendorff's α on choices.

Each is 1 where all agree. W is 0 where ranks cancel out, κ and α where agreement is that of chance, below 0 where it is
less.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A coefficient with the limits of its interval; None where it cannot be told, such as where nothing varies.

    ``p`` is the chance of a value at least as high without any agreement, where that is tested.
    """

    name: str
    value: float | None
    low: float | None = None
    high: float | None = None
    p: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {"name": self.name, "value": self.value, "low": self.low, "high": self.high, "p": self.p}


def kendall_w(ratings: Floats) -> float | None:
    """Return Kendall's coefficient of concordance, corrected for ties [Kendall1939].

    Parameters
    ----------
    ratings
        Shape (observers, n): each observer's ratings of the same n things, of which only the order counts.

    Returns
    -------
    0 to 1; None where every observer rates everything alike, or there is only one observer or thing.
    """
    from scipy.stats import rankdata

    m, n = ratings.shape
    if m < 2 or n < 2:
        return None
    ranks = rankdata(ratings, axis=1)
    sums = ranks.sum(axis=0)
    ties = sum(float((count**3 - count).sum()) for count in (np.unique(row, return_counts=True)[1] for row in ranks))
    most = m * m * (n**3 - n) - m * ties
    return float(12 * ((sums - sums.mean()) ** 2).sum() / most) if most > 0 else None


def fleiss_kappa(counts: Floats) -> float | None:
    """Return Fleiss' κ [Fleiss1971].

    Parameters
    ----------
    counts
        Shape (n, categories): how many of the m observers put each of n things into each category. Rows sum to m.

    Returns
    -------
    At most 1; None where all fall into one category, or there is only one observer.
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
        Shape (observers, n): what each observer said of each of n things, NaN where nothing.
    nominal
        Whether values differ or not (δ² = 1 or 0), else by how much they differ (δ² = (v − w)²).

    Returns
    -------
    At most 1; None where no value differs from another, or no thing has two of them.
    """
    values = values[:, np.isfinite(values).sum(axis=0) > 1]
    said = np.isfinite(values)
    if not said.any():
        return None
    known, which = np.unique(values[said], return_inverse=True)
    place = np.nonzero(said)[1]
    counts = np.zeros((values.shape[1], len(known)))
    np.add.at(counts, (place, which.ravel()), 1.0)
    each = counts.sum(axis=1)
    distance = (known[:, None] != known).astype(np.float64) if nominal else (known[:, None] - known) ** 2
    within = float((np.einsum("nk,kl,nl->n", counts, distance, counts) / (each - 1)).sum())
    total = counts.sum(axis=0)
    overall = float(total @ distance @ total) / (total.sum() - 1)
    return float(1 - within / overall) if overall > 0 else None


def with_jackknife(name: str, coefficient: Callable[[Floats], float | None], rows: Floats) -> Coefficient:
    """Return the coefficient of ``rows``, one for each observer, with 95 % limits from leaving out each in turn.

    Tukey's pseudo-values [Miller1974], by Student's t; cut at 1. Drawing observers anew would not do: an observer drawn
    twice agrees with themselves. No limits with fewer than four observers, or where a coefficient cannot be told.
    """
    from scipy.special import stdtrit

    value = coefficient(rows)
    people = len(rows)
    if value is None or people < 4:
        return Coefficient(name, value)
    left_out = [coefficient(np.delete(rows, number, axis=0)) for number in range(people)]
    known = np.array([one for one in left_out if one is not None])
    if len(known) < people:
        return Coefficient(name, value)
    pseudo = people * value - (people - 1) * known
    reach = float(stdtrit(people - 1, 0.975)) * float(pseudo.std(ddof=1)) / np.sqrt(people)
    return Coefficient(name, value, float(pseudo.mean() - reach), min(1.0, float(pseudo.mean() + reach)))


def kendall_w_p(w: float | None, observers: int, things: int) -> float | None:
    """Return the chance of a W at least as high without agreement: m (n − 1) W by χ² with n − 1 degrees of freedom."""
    from scipy.special import chdtrc

    return None if w is None else float(chdtrc(things - 1, observers * (things - 1) * w))
