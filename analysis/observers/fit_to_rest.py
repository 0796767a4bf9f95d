"""How well the others' scores predict each observer's answers, who is an outlier, and who changes the scores most.

For each observer s the strengths are fitted to all other observers' answers, by Firth's penalised likelihood
[Firth1993]: it has a maximum for any answers, and little of the bias that puts strengths from few answers too far
apart. With d the differences of these strengths, p their probabilities and W the observer's own counts out of N,

    l = Σ W log p,   l − E l = Σ d (W − N p)   over the pairs

If s follows the same strengths, the variance of l has a term from s's own answers, Σ N p (1 − p) d², and one from the
estimated strengths: θᵀ I Σ I θ, with I the information in s's answers and Σ the covariance of the strengths. The errors
of the strengths also lower the mean of l; that is corrected to second order. z is the deviation from the mean over the
standard deviation. Sums of few answers are skewed, so the p value comes from `tails.lower_tail`, with the third moment
of s's answers. Holm's correction [Holm1979] over the observers controls the family-wise error rate: the probability of
flagging any observer, if all follow the same strengths.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from analysis.bootstrap.fits import fit_each
from analysis.classes import multiplicity
from analysis.comparisons.comparisons import Comparisons, split_scales
from analysis.covariance.laplacian import contrast_variances, pseudo_inverse
from analysis.observers.tails import lower_tail
from analysis.scaling.laws import probabilities
from documents.arrays import Floats
from documents.text import JsonResult

LEVEL = 0.05
MOST_ITEMS = 300
# Strengths that differ by less, in nats, are equal: the difference is what the fit's last step and rounding left.
_EQUAL_NATS = 1e-8
_MOST_NUMBERS = 4_000_000


@dataclass(frozen=True, slots=True)
class FitToRest(JsonResult):
    """One observer's answers under the others' scores.

    Attributes
    ----------
    mean_log_likelihood
        In nats per answer; log ½ = −0.693 is guessing.
    expected
        Its expectation for an observer who follows the others' scores.
    z
        Deviation from that expectation in standard deviations; below zero, the answers fit worse.
    p
        Probability of answers that fit as badly or worse; ``adjusted_p`` is Holm's over all observers.
    outlier
        Whether ``adjusted_p`` is at most the level.
    influence
        The largest change of any item's strength, in nats, when the observer is left out; ``most_moved`` names
        the item, with its group if it has one, whose strength is lower without them if ``influence`` is below zero.
    """

    mean_log_likelihood: float
    expected: float
    z: float
    p: float
    adjusted_p: float
    outlier: bool
    influence: float
    most_moved: str
    json_keys: ClassVar = {"influence": "influence_nats"}


def fits_to_rest(comparisons: Comparisons, level: float = LEVEL) -> tuple[FitToRest | None, ...]:
    """Return each observer's fit to the rest, in the order of ``comparisons.observers``.

    Where there are groups, each has a scale of its own, and the fit is over all groups. A group is left out for an
    observer without a decided answer in it; where the others' answers do not link all items, so that there is no
    common scale; and where all items that the observer saw have equal strengths by the others' answers. None for an
    observer for whom no group is left, and for all observers above 300 items: time grows with observers times the cube
    of the items, memory with the square. Counts are numbers of answers: with weights, z is too large or too small.
    """
    people = len(comparisons.observers)
    sums, answers = np.zeros((people, 4)), np.zeros(people)
    influence, moved = np.zeros(people), [""] * people
    for name, part in split_scales(comparisons):
        if len(part.items) > MOST_ITEMS:
            return (None,) * people
        parts, change, given = _one_scale(part)
        differ = parts[:, 2] > given * _EQUAL_NATS**2
        usable = np.isfinite(parts).all(axis=1) & differ & np.isfinite(change).all(axis=1)
        sums[usable] += parts[usable]
        answers[usable] += given[usable]
        for person in np.flatnonzero(usable):
            size = np.abs(change[person])
            # The first of those that moved most: equal but for rounding is equal.
            most = int((size >= size.max() * (1 - 1e-9)).argmax())
            if not moved[person] or size[most] > abs(influence[person]) * (1 + 1e-9):
                influence[person] = change[person, most]
                moved[person] = f"{part.items[most]} ({name})" if name else part.items[most]
    judged = np.flatnonzero(answers > 0)
    deviation, expected, variance, third = sums[judged].T
    p = lower_tail(deviation, variance, third)
    adjusted = multiplicity.holm(p)
    lines: list[FitToRest | None] = [None] * people
    for line, person in enumerate(judged):
        lines[person] = FitToRest(
            mean_log_likelihood=float((deviation[line] + expected[line]) / answers[person]),
            expected=float(expected[line] / answers[person]),
            z=float(deviation[line] / np.sqrt(variance[line])),
            p=float(p[line]),
            adjusted_p=float(adjusted[line]),
            outlier=bool(adjusted[line] <= level),
            influence=float(influence[person]),
            most_moved=moved[person],
        )
    return tuple(lines)


def _one_scale(comparisons: Comparisons) -> tuple[Floats, Floats, Floats]:
    """Return each observer's `_parts` (S, 4), change of the strengths (S, n), NaN if none, and answers (S,)."""
    people, n = len(comparisons.observers), len(comparisons.items)
    wins = comparisons.wins
    together = fit_each(wins[None], "firth").theta[0]
    theta = np.full((people, n), np.nan)
    parts = np.full((people, 4), np.nan)
    block = max(1, _MOST_NUMBERS // (n * n))
    for start in range(0, people, block):
        own = comparisons.wins_by_observer(slice(start, start + block))
        rest = wins - own
        fitted = fit_each(rest, "firth").theta
        usable_fit = np.isfinite(fitted).all(axis=1) & own.any(axis=(1, 2))
        theta[start : start + block][usable_fit] = fitted[usable_fit]
        if usable_fit.any():
            parts[start : start + block][usable_fit] = _parts(own[usable_fit], rest[usable_fit], fitted[usable_fit])
    answers = np.bincount(comparisons.observer, comparisons.count, people).astype(np.float64)
    return parts, together - theta, answers


def _parts(own: Floats, rest: Floats, theta: Floats) -> Floats:
    """Return l minus its mean, its mean, its variance and its third central moment, shape (S, 4)."""
    from scipy.special import log_expit

    d = theta[:, :, None] - theta[:, None, :]
    p = probabilities(theta)
    q = p.transpose(0, 2, 1)
    answers, others = own + own.transpose(0, 2, 1), rest + rest.transpose(0, 2, 1)
    weight = answers * p * q
    covariance = pseudo_inverse(others * p * q)
    # Sums over ordered pairs count each pair twice where both directions are equal.
    bias = -(weight * contrast_variances(covariance) * (1 - (p - q) * d / 2)).sum(axis=(1, 2)) / 2
    mean = (answers * p * log_expit(d)).sum(axis=(1, 2)) + bias
    pull = (weight * d).sum(axis=2)
    variance = (weight * d**2).sum(axis=(1, 2)) / 2 + np.einsum("si,sij,sj->s", pull, covariance, pull)
    third = (weight * d**3 * (q - p)).sum(axis=(1, 2)) / 2
    total = (own * log_expit(d)).sum(axis=(1, 2))
    return np.stack([total - mean, mean, variance, third], axis=1)
