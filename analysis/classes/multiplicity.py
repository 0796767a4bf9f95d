"""p values of all pairs at once, corrected for their number."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.scaling.laplacian import contrast_variances
from documents import Finding

Floats = NDArray[np.float64]
Adjust = Literal["none", "holm", "bh", "maxz"]
ADJUSTMENTS: tuple[Adjust, ...] = get_args(Adjust)

MAXZ_SEED = 20160
MAXZ_SAMPLES = 200_000
MAXZ_MOST_NUMBERS = 40_000_000
MAXZ_FEWEST_SAMPLES = 10_000


def adjusted_p(z: Floats, covariance: Floats, adjust: Adjust, df: float | None = None) -> Floats:
    """Return two-sided p values of ``z`` over the pairs i < j, adjusted.

    Parameters
    ----------
    z
        Shape (n, n): antisymmetric.
    covariance
        Shape (n, n): covariance of the estimates that ``z`` compares; only ``maxz`` looks at it.
    adjust
        ``none``; ``holm`` [Holm1979] and ``maxz`` hold the chance of any false difference; ``bh``
        [Benjamini1995] the expected share of false ones.
    df
        Degrees of freedom of the standard errors in ``z``, such as observers − 1 for a sandwich covariance: Student's
        law takes the place of the normal one. None where they are as good as known.

    Returns
    -------
    Shape (n, n), symmetric, 1 on the diagonal.

    Raises
    ------
    ResultsError
        If ``adjust`` is none of these.
    """
    if adjust not in ADJUSTMENTS:
        raise ResultsError(
            Finding(f"there is no adjustment '{adjust}'", remedy="expected one of: " + ", ".join(ADJUSTMENTS))
        )
    first, second = np.triu_indices(len(z), 1)
    absolute_z = np.abs(z[first, second])
    if adjust == "maxz":
        pairs = single_step(absolute_z, covariance, df)
    else:
        raw = two_sided_p(absolute_z, df)
        pairs = holm(raw) if adjust == "holm" else benjamini_hochberg(raw) if adjust == "bh" else raw
    p = np.ones_like(z)
    p[first, second] = pairs
    p[second, first] = pairs
    return p


def two_sided_p(absolute_z: Floats, df: float | None = None) -> Floats:
    """Return the chance of a value at least as far from 0: by the normal law, or Student's with ``df``."""
    from scipy.special import erfc, stdtr

    if df is None:
        return np.asarray(erfc(absolute_z / np.sqrt(2)))
    return np.asarray(2 * stdtr(df, -absolute_z))


def holm(p: Floats) -> Floats:
    """Return Holm's step-down adjusted p values of each row. Shapes (..., m) to (..., m)."""
    order = np.argsort(p, axis=-1, kind="stable")
    steps = np.take_along_axis(p, order, axis=-1) * np.arange(p.shape[-1], 0, -1)
    adjusted = np.empty_like(p)
    np.put_along_axis(adjusted, order, np.minimum(np.maximum.accumulate(steps, axis=-1), 1), axis=-1)
    return adjusted


def benjamini_hochberg(p: Floats) -> Floats:
    """Return Benjamini and Hochberg's step-up adjusted p values of each row. Shapes (..., m) to (..., m)."""
    order = np.argsort(p, axis=-1, kind="stable")
    count = p.shape[-1]
    scaled = np.take_along_axis(p, order, axis=-1) * count / np.arange(1, count + 1)
    least = np.minimum.accumulate(scaled[..., ::-1], axis=-1)[..., ::-1]
    adjusted = np.empty_like(p)
    np.put_along_axis(adjusted, order, np.minimum(least, 1), axis=-1)
    return adjusted


def single_step(
    absolute_z: Floats, covariance: Floats, df: float | None = None, most_samples: int = MAXZ_SAMPLES
) -> Floats:
    """Return, for each absolute z, the chance that the largest of all pairs reaches it when no two items differ.

    The estimates are drawn from a normal law with ``covariance``, with a fixed seed: the same data give the same
    value. With 200,000 draws the standard error is at most 0.0005 at p = 0.05; above 20 items there are fewer
    draws (at least 10,000, standard error 0.0022), to keep the work within a few seconds. With ``df``, each draw is
    divided by its own √(χ²/df): a multivariate t law, as for standard errors that were estimated.
    """
    first, second = np.triu_indices(len(covariance), 1)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))
    error = np.sqrt(contrast_variances(covariance)[first, second])
    contrasts = np.divide(
        root[first] - root[second], error[:, None], out=np.zeros((len(first), len(root))), where=error[:, None] > 0
    )
    samples = int(np.clip(MAXZ_MOST_NUMBERS // len(first), min(MAXZ_FEWEST_SAMPLES, most_samples), most_samples))
    random = np.random.default_rng(MAXZ_SEED)
    largest = np.empty(samples)
    block = max(1, 2_000_000 // len(first))
    for start in range(0, samples, block):
        draws = random.standard_normal((min(block, samples - start), len(root)))
        largest[start : start + block] = np.abs(draws @ contrasts.T).max(axis=1)
    if df is not None:
        largest /= np.sqrt(np.random.default_rng([MAXZ_SEED, 1]).chisquare(df, samples) / df)
    largest.sort()
    return 1 - np.searchsorted(largest, absolute_z, side="left") / samples
