"""How well the others' scores foretell each observer's answers, who stands out, and who moves the scores most.

For each observer s the strengths are fitted to everybody else's answers, by Firth's penalised likelihood [Firth1993]:
it is finite whatever the others answered, and nearly free of the bias that puts strengths from few answers too far
apart. With d the differences of these strengths, p the chances they give and W the observer's own counts out of N,

    l = Σ W log p,   l − E l = Σ d (W − N p)   over the pairs

If s follows the same strengths, l has a spread from s's own answers, Σ N p (1 − p) d², and one from the others', since
their answers gave the strengths: θᵀ I Σ I θ, with I the information in s's answers and Σ the covariance of the
strengths. The strengths' errors also lower l a little; that mean is taken off, to second order. z is what remains over
its standard deviation. Sums of so few answers are skewed, so the p value comes from `tails.lower_tail`, with the third
moment of s's answers. Holm's correction [Holm1979] over the observers then holds the chance of flagging anybody, if all
follow the same strengths, at the level that was asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap import firth_batch
from analysis.bootstrap.fits import fit_each
from analysis.classes import multiplicity
from analysis.comparisons.comparisons import Comparisons
from analysis.observers.tails import lower_tail
from analysis.scaling.bradley_terry import probabilities
from analysis.scaling.laplacian import contrast_variances

Floats = NDArray[np.float64]

LEVEL = 0.05
MOST_ITEMS = 300
_MOST_NUMBERS = 4_000_000


@dataclass(frozen=True, slots=True)
class FitToRest:
    """One observer's answers under the others' scores.

    Attributes
    ----------
    mean_log_likelihood
        In nats per answer; log ½ = −0.693 is guessing.
    expected
        What it would be on average for an observer who follows the others' scores.
    z
        How far the answers are from that, in standard deviations; below zero, they fit worse.
    p
        Chance of answers that fit as badly or worse; ``adjusted_p`` is Holm's over all observers.
    outlier
        Whether ``adjusted_p`` is at most the level.
    influence
        The largest change of any item's strength, in nats, that leaving the observer out makes; ``most_moved`` names
        the item, whose strength is lower without them if ``influence`` is below zero.
    """

    mean_log_likelihood: float
    expected: float
    z: float
    p: float
    adjusted_p: float
    outlier: bool
    influence: float
    most_moved: str

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "mean_log_likelihood": self.mean_log_likelihood,
            "expected": self.expected,
            "z": self.z,
            "p": self.p,
            "adjusted_p": self.adjusted_p,
            "outlier": self.outlier,
            "influence_nats": self.influence,
            "most_moved": self.most_moved,
        }


def fits_to_rest(comparisons: Comparisons, level: float = LEVEL) -> tuple[FitToRest | None, ...]:
    """Return each observer's fit to the rest, in the order of ``comparisons.observers``.

    None for an observer without an answer that prefers one item; where the others' answers do not link all items, so
    that they have no common scale; and where they hold all items the observer met to be alike and foretell nothing.
    None for all above 300 items: work grows with observers times the cube of the items, memory with the square.
    Counts are taken for numbers of answers: with weights, z is too large or too small.
    """
    people, n = len(comparisons.observers), len(comparisons.items)
    if n > MOST_ITEMS:
        return (None,) * people
    by_observer = comparisons.wins_by_observer()
    together = fit_each(comparisons.wins[None], "firth").theta[0]
    theta = np.full((people, n), np.nan)
    parts = np.full((people, 4), np.nan)
    block = max(1, _MOST_NUMBERS // (n * n))
    for start in range(0, people, block):
        own = by_observer[start : start + block]
        rest = comparisons.wins - own
        fitted = fit_each(rest, "firth").theta
        sound = np.isfinite(fitted).all(axis=1) & own.any(axis=(1, 2))
        theta[start : start + block][sound] = fitted[sound]
        if sound.any():
            parts[start : start + block][sound] = _parts(own[sound], rest[sound], fitted[sound])
    found = np.isfinite(parts).all(axis=1) & (parts[:, 2] > 0) & np.isfinite(together).all()
    deviation, expected, variance, third = parts[found].T
    p = lower_tail(deviation, variance, third)
    adjusted = multiplicity.holm(p)
    answers = by_observer.sum(axis=(1, 2))[found]
    change = together - theta[found]
    most = np.abs(change).argmax(axis=1)
    lines: list[FitToRest | None] = [None] * people
    for line, person in enumerate(np.flatnonzero(found)):
        lines[person] = FitToRest(
            mean_log_likelihood=float((deviation[line] + expected[line]) / answers[line]),
            expected=float(expected[line] / answers[line]),
            z=float(deviation[line] / np.sqrt(variance[line])),
            p=float(p[line]),
            adjusted_p=float(adjusted[line]),
            outlier=bool(adjusted[line] <= level),
            influence=float(change[line, most[line]]),
            most_moved=comparisons.items[most[line]],
        )
    return tuple(lines)


def _parts(own: Floats, rest: Floats, theta: Floats) -> Floats:
    """Return l less its mean, its mean, its variance and its third central moment, shape (S, 4)."""
    from scipy.special import log_expit

    d = theta[:, :, None] - theta[:, None, :]
    p = probabilities(theta)
    q = p.transpose(0, 2, 1)
    answers, others = own + own.transpose(0, 2, 1), rest + rest.transpose(0, 2, 1)
    weight = answers * p * q
    covariance = firth_batch.pseudo_inverses(others * p * q)
    # Sums over ordered pairs hold each pair twice where both directions say the same.
    lost = -(weight * contrast_variances(covariance) * (1 - (p - q) * d / 2)).sum(axis=(1, 2)) / 2
    mean = (answers * p * log_expit(d)).sum(axis=(1, 2)) + lost
    pull = (weight * d).sum(axis=2)
    variance = (weight * d**2).sum(axis=(1, 2)) / 2 + np.einsum("si,sij,sj->s", pull, covariance, pull)
    third = (weight * d**3 * (q - p)).sum(axis=(1, 2)) / 2
    total = (own * log_expit(d)).sum(axis=(1, 2))
    return np.stack([total - mean, mean, variance, third], axis=1)
