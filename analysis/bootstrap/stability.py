"""How stable perceptual classes are: what classes the draws of other observers would have given."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap.influence import influences, sandwich
from analysis.bootstrap.replicates import BLOCK_NUMBERS, Replicates
from analysis.classes.classes import check_level, labelled, letter_display, numbered
from analysis.classes.multiplicity import ADJUSTMENTS, Adjust, corrected, single_step, two_sided_p
from analysis.errors import ResultsError
from analysis.scaling.laplacian import contrast_variances, pseudo_inverse
from documents import Finding

Floats = NDArray[np.float64]
Covariance = Literal["model", "sandwich"]
COVARIANCES: tuple[Covariance, ...] = get_args(Covariance)
MAXZ_SAMPLES = 10_000


@dataclass(frozen=True, slots=True, eq=False)
class Stability:
    """What became of the classes of n items over the bootstrap.

    Attributes
    ----------
    items
        Names of the items.
    shared
        Shape (n, n): the share of replicates (0 to 1) in which two items share a class; 1 on the diagonal.
    labels, label_shares
        For each item its most frequent label, such as "3+4", and the share of replicates that gave it.
    class_counts
        How many replicates gave how many classes.
    replicates, separated, without_fit
        How many replicates there were, how many of these were fitted by Firth's, and how many are left out of all
        shares because comparisons linked too few items.
    alpha, adjust, covariance
        Level, adjustment, and whose standard errors the tests used.
    """

    items: tuple[str, ...]
    shared: Floats
    labels: tuple[str, ...]
    label_shares: tuple[float, ...]
    class_counts: dict[int, int]
    replicates: int
    separated: int
    without_fit: int
    alpha: float
    adjust: Adjust
    covariance: Covariance

    def to_json(self) -> dict[str, Any]:
        """Return the fields as lists, numbers and text."""
        items = zip(self.items, self.labels, self.label_shares, strict=True)
        return {
            "items": [{"name": name, "class": label, "share": share} for name, label, share in items],
            "shared": self.shared.tolist(),
            "class_counts": {str(count): times for count, times in sorted(self.class_counts.items())},
            "replicates": self.replicates,
            "separated": self.separated,
            "without_fit": self.without_fit,
            "alpha": self.alpha,
            "adjust": self.adjust,
            "covariance": self.covariance,
        }


def class_stability(
    replicates: Replicates,
    *,
    alpha: float = 0.05,
    adjust: Adjust = "holm",
    covariance: Covariance = "model",
) -> Stability:
    """Find the classes of each replicate, as `analysis.classes.classes.classify` does.

    Parameters
    ----------
    covariance
        ``model`` takes a replicate's answers for independent; ``sandwich`` only its observers, with the t distribution
        of observers − 1 degrees of freedom.

    Returns
    -------
    Stability
        How often items share a class, and each item's most frequent label.

    Raises
    ------
    ResultsError
        If ``alpha`` is out of range, ``adjust`` or ``covariance`` unknown, or no replicate has a fit.

    Examples
    --------
    >>> from analysis.bootstrap import resample
    >>> from analysis.comparisons import Answer, from_answers
    >>> votes = {"1": "ababcb", "2": "abacbc", "3": "bacacb", "4": "abcacb", "5": "abaccb"}  # winner, loser, ...
    >>> answers = [Answer(v[i], v[i + 1], observer=name) for name, v in votes.items() for i in (0, 2, 4)]
    >>> replicates = resample(from_answers(answers), replicates=100)
    >>> stability = class_stability(replicates)
    >>> stability.items, sum(stability.class_counts.values()) + stability.without_fit
    (('a', 'b', 'c'), 100)
    """
    check_level(alpha)
    for wish, known in ((adjust, ADJUSTMENTS), (covariance, COVARIANCES)):
        if wish not in known:
            raise ResultsError(Finding(f"there is no '{wish}'", remedy="expected one of: " + ", ".join(known)))
    sound = np.flatnonzero(~replicates.without_fit)
    if not len(sound):
        raise ResultsError(Finding("comparisons link all items in no replicate", remedy="collect more answers"))
    n = len(replicates.items)
    shared, labels, counts = np.zeros((n, n)), [Counter[str]() for _ in range(n)], Counter[int]()
    known_letters: dict[bytes, tuple[frozenset[int], ...]] = {}
    for index, differs in zip(sound, _differing(replicates, sound, alpha, adjust, covariance), strict=True):
        key = np.packbits(differs).tobytes()
        if key not in known_letters:
            known_letters[key] = letter_display(differs)
        members = numbered(known_letters[key], replicates.theta[index])
        shared += ~differs
        counts[len(members)] += 1
        for label, met in zip(labelled(members, n), labels, strict=True):
            met[label] += 1
    most = [max(met.items(), key=lambda entry: (entry[1], -len(entry[0]), entry[0])) for met in labels]
    return Stability(
        items=replicates.items,
        shared=shared / len(sound),
        labels=tuple(label for label, _ in most),
        label_shares=tuple(times / len(sound) for _, times in most),
        class_counts=dict(sorted(counts.items())),
        replicates=len(replicates.theta),
        separated=int(replicates.separated.sum()),
        without_fit=int(replicates.without_fit.sum()),
        alpha=alpha,
        adjust=adjust,
        covariance=covariance,
    )


def covariances(by_observer: Floats, weights: Floats, theta: Floats, covariance: Covariance) -> Floats:
    """Return the covariance of each replicate's strengths. Shapes (S, n, n), (B, S) and (B, n) to (B, n, n)."""
    from scipy.special import expit

    if covariance == "sandwich":
        return sandwich(influences(by_observer, weights, theta), weights)
    people, n, _ = by_observer.shape
    wins = (weights @ by_observer.reshape(people, n * n)).reshape(-1, n, n)
    p = expit(theta[:, :, None] - theta[:, None, :])
    return pseudo_inverse((wins + wins.transpose(0, 2, 1)) * p * p.transpose(0, 2, 1))


def _differing(
    replicates: Replicates, sound: NDArray[np.intp], alpha: float, adjust: Adjust, covariance: Covariance
) -> Iterator[NDArray[np.bool_]]:
    """Yield for each replicate which pairs differ, shape (n, n)."""
    people, n, _ = replicates.by_observer.shape
    size = max(1, BLOCK_NUMBERS // (n * max(n, people)))
    df = people - 1 if covariance == "sandwich" else None
    first, second = np.triu_indices(n, 1)
    for start in range(0, len(sound), size):
        chosen = sound[start : start + size]
        theta = replicates.theta[chosen]
        weights, separated = replicates.weights[chosen], replicates.separated[chosen]
        spread = covariances(replicates.by_observer, weights, theta, covariance)
        if covariance == "sandwich" and separated.any():
            # Observers who agree without exception have no spread: what the model says of them is all there is.
            spread[separated] = covariances(replicates.by_observer, weights[separated], theta[separated], "model")
        error = np.sqrt(contrast_variances(spread))[:, first, second]
        off = np.abs(theta[:, first] - theta[:, second])
        z = np.divide(off, error, out=np.zeros_like(off), where=error > 0)  # as `classify`: no spread is no evidence
        for significant in _adjusted(z, spread, adjust, df) <= alpha:
            differs = np.zeros((n, n), dtype=bool)
            differs[first, second] = differs[second, first] = significant
            yield differs


def _adjusted(z: Floats, spread: Floats, adjust: Adjust, df: int | None) -> Floats:
    if adjust == "maxz":
        rows = [single_step(row, own, df, MAXZ_SAMPLES) for row, own in zip(z, spread, strict=True)]
        return np.array(rows)
    return corrected(two_sided_p(z, df), adjust)
