"""Correlations of a measure with the scores of the same stimuli: Pearson's, Spearman's and Kendall's τ-b.

All take a batch of scores, since intervals and tests ask for thousands. Values that are equal but for rounding are
ties, so that no rank depends on the processor.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.series import ranks
from documents.arrays import Floats

CorrelationKind = Literal["pearson", "spearman", "kendall"]
KINDS: tuple[CorrelationKind, ...] = get_args(CorrelationKind)
TIED = 1e-10  # of the largest value
_FEW = 20
_BLOCK_NUMBERS = 4_000_000


def correlation(scores: Floats, values: Floats, kind: CorrelationKind) -> Floats:
    """Return the correlation of each row of ``scores`` with ``values``; 0 where either is constant.

    Parameters
    ----------
    scores
        Shape (..., n), finite.
    values
        Shape (n,). Ranks may have infinite values; Pearson's correlation has none.
    kind
        ``pearson``; ``spearman``, that of the mean ranks; or ``kendall``, τ-b [Kendall1945].

    Returns
    -------
    Shape (...), −1 to 1.
    """
    return _WAYS[kind](np.asarray(scores, dtype=np.float64), np.asarray(values, dtype=np.float64))


def direction(values: Floats, kind: CorrelationKind) -> Floats:
    """Return the scores, shape (n,), of mean 0 and length 1, that correlate with ``values`` as highly as can be.

    Those are the values themselves for Pearson's correlation, their ranks for the others.
    """
    one = values if kind == "pearson" else mean_ranks(values)
    centred, size = _centred(one)
    return np.asarray(centred / size)


def mean_ranks(values: Floats) -> Floats:
    """Return the ranks, from 1, of each row; ties have the mean of theirs. Shapes (..., n) to (..., n)."""
    plain = _plain(values)
    if plain.shape[-1] > _FEW or np.isnan(plain).any():
        return ranks(plain)
    # Few values are compared each with each: in less than half the time that sorting many short rows takes.
    each = np.ascontiguousarray(np.moveaxis(plain, -1, 0))
    twice = np.ones(each.shape, dtype=np.int32)
    for one in each:
        twice += one < each
        twice += one <= each
    return np.moveaxis(twice / 2, 0, -1)


def signs(values: Floats) -> NDArray[np.int8]:
    """Return the sign of value i − value j for all i < j, 0 for ties. Shapes (..., n) to (..., n (n − 1) / 2)."""
    plain = _plain(values)
    first, second = np.triu_indices(plain.shape[-1], 1)
    return (plain[..., first] > plain[..., second]).astype(np.int8) - (plain[..., first] < plain[..., second])


def _plain(values: Floats) -> Floats:
    """Return values of which those that are equal but for rounding are equal."""
    values = np.asarray(values, dtype=np.float64)
    finite = np.isfinite(values)
    largest = np.abs(np.where(finite, values, 0.0)).max(axis=-1, keepdims=True, initial=0.0)
    step = TIED * np.where(largest > 0, largest, 1.0)
    return np.where(finite, np.rint(np.where(finite, values, 0.0) / step), values)


def _pearson(scores: Floats, values: Floats) -> Floats:
    own, size = _centred(scores)
    other, other_size = _centred(values)
    both = size * other_size
    return np.clip(np.divide(own @ other, both, out=np.zeros_like(both), where=both > 0), -1, 1)


def _centred(values: Floats) -> tuple[Floats, Floats]:
    """Return rows over their largest value, without their mean, and their lengths: 0 where rounding alone is left."""
    largest = np.abs(values).max(axis=-1, keepdims=True, initial=0.0)
    values = np.divide(values, largest, out=np.zeros_like(values), where=largest > 0)
    off = values - values.mean(axis=-1, keepdims=True)
    size = np.sqrt((off**2).sum(axis=-1))
    return off, np.where(size > TIED, size, 0.0)


def _spearman(scores: Floats, values: Floats) -> Floats:
    return _pearson(mean_ranks(scores), mean_ranks(values))


def _kendall(scores: Floats, values: Floats) -> Floats:
    flat = scores.reshape(-1, scores.shape[-1])
    own = signs(values).astype(np.float64)
    out = np.empty(len(flat))
    size = max(1, _BLOCK_NUMBERS // max(1, len(own)))
    for start in range(0, len(flat), size):
        theirs = signs(flat[start : start + size])
        untied = np.sqrt(np.count_nonzero(theirs, axis=-1) * np.count_nonzero(own))
        sums = theirs @ own
        out[start : start + size] = np.divide(sums, untied, out=np.zeros_like(sums), where=untied > 0)
    return out.reshape(scores.shape[:-1])


_WAYS: Mapping[CorrelationKind, Callable[[Floats, Floats], Floats]] = {
    "pearson": _pearson,
    "spearman": _spearman,
    "kendall": _kendall,
}
