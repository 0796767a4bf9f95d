"""How stable perceptual classes are: what classes the draws of other observers would have given."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap.influence import influences
from analysis.bootstrap.replicates import BLOCK_NUMBERS, Replicates
from analysis.choices import Adjust
from analysis.classes.classes import check_level, labelled, letter_display, numbered
from analysis.classes.multiplicity import ADJUSTMENTS, MAXZ_SEED, significant_pairs, single_step_end
from analysis.covariance.laplacian import contrast_variances, pseudo_inverse
from analysis.covariance.shrinkage import Clustered, Spread, shrink
from analysis.errors import ResultsError
from analysis.scaling.counts import Counts
from analysis.scaling.deciding import Verdicts, verdicts
from analysis.scaling.profile import why_not_profiled
from analysis.scaling.result import CovarianceKind
from documents import Finding, one_blas_thread
from documents.arrays import Flags, Floats, Indices
from documents.text import JsonResult

MAXZ_SAMPLES = 10_000


@dataclass(frozen=True, slots=True, eq=False)
class Stability(JsonResult):
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
    covariance: CovarianceKind

    json_keys: ClassVar = {"lines": "items"}
    json_names: ClassVar = "lines shared class_counts replicates separated without_fit alpha adjust covariance"

    @property
    def lines(self) -> list[dict[str, Any]]:
        """Each item with its label and the share of it."""
        items = zip(self.items, self.labels, self.label_shares, strict=True)
        return [{"name": name, "class": label, "share": share} for name, label, share in items]


@one_blas_thread()
def class_stability(
    replicates: Replicates,
    *,
    alpha: float = 0.05,
    adjust: Adjust = "holm",
    covariance: CovarianceKind = "shrinkage",
) -> Stability:
    """Find the classes of each replicate, as `analysis.classes.classes.classify` does.

    Parameters
    ----------
    covariance
        ``model`` takes a replicate's answers for independent; the others, as `analysis.covariance.shrinkage` has them,
        only its observers. Separated replicates have ``scaled`` in their place.

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
    for wish, known in ((adjust, ADJUSTMENTS), (covariance, get_args(CovarianceKind))):
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


def model_covariances(by_observer: Floats, weights: Floats, theta: Floats) -> Floats:
    """Return the model's covariance of each replicate. Shapes (S, n, n), (B, S) and (B, n) to (B, n, n)."""
    from scipy.special import expit

    people, n, _ = by_observer.shape
    wins = (weights @ by_observer.reshape(people, n * n)).reshape(-1, n, n)
    p = expit(theta[:, :, None] - theta[:, None, :])
    return pseudo_inverse((wins + wins.transpose(0, 2, 1)) * p * p.transpose(0, 2, 1))


def spreads(by_observer: Floats, weights: Floats, theta: Floats, kind: Clustered) -> Spread:
    """Return the covariance of each replicate, clustered by observer. Shapes (S, n, n), (B, S) and (B, n)."""
    people = len(by_observer)
    pulled = influences(by_observer, weights, theta) * np.sqrt(weights * (people / (people - 1)))[:, :, None]
    model = model_covariances(by_observer, weights, theta)
    return shrink(model, pulled, kind, freedom=people - 1, at_least_model=kind == "scaled")


def differing(
    replicates: Replicates, *, alpha: float, adjust: Adjust, covariance: CovarianceKind
) -> Iterator[NDArray[np.bool_]]:
    """Yield for each replicate that has a fit which pairs differ, shape (n, n), by the tests of `class_stability`."""
    return _differing(replicates, np.flatnonzero(~replicates.without_fit), alpha, adjust, covariance)


def _differing(
    replicates: Replicates, sound: NDArray[np.intp], alpha: float, adjust: Adjust, covariance: CovarianceKind
) -> Iterator[NDArray[np.bool_]]:
    """Yield for each replicate which pairs differ, shape (n, n)."""
    people, n, _ = replicates.by_observer.shape
    size = max(1, BLOCK_NUMBERS // (n * max(n, people)))
    first, second = np.triu_indices(n, 1)
    critical = _critical(replicates, alpha, covariance) if adjust == "maxz" and covariance != "model" else None
    for start in range(0, len(sound), size):
        block = sound[start : start + size]
        significant = np.zeros((len(block), len(first)), dtype=bool)
        # Observers who agree without exception do not vary: only the model's covariance is left, scaled.
        apart = replicates.separated[block] & (covariance != "model")
        for chosen, kind in ((~apart, covariance), (apart, "scaled")):
            if not chosen.any():
                continue
            weights, theta = replicates.weights[block[chosen]], replicates.theta[block[chosen]]
            if kind == "model":
                spread, df = model_covariances(replicates.by_observer, weights, theta), None
            else:
                clustered = spreads(replicates.by_observer, weights, theta, kind)
                spread, df = clustered.covariance, clustered.degrees_of_freedom()
            if critical is not None:
                differ = partial(_beyond, np.full(len(theta), critical))
            elif adjust == "maxz":
                differ = partial(_beyond, np.array([single_step_end(own, alpha, MAXZ_SAMPLES) for own in spread]))
            else:
                differ = partial(_significant, df, adjust, alpha)
            significant[chosen] = _tested(replicates.by_observer, weights, theta, spread, differ)
        for row in significant:
            differs = np.zeros((n, n), dtype=bool)
            differs[first, second] = differs[second, first] = row
            yield differs


def _beyond(ends: Floats, t: Floats, rows: Indices) -> Flags:
    return np.asarray(t >= ends[rows, None])


def _significant(df: Floats | None, adjust: Adjust, alpha: float, t: Floats, rows: Indices) -> Flags:
    return significant_pairs(t, None if df is None else df[rows], adjust, alpha)


def _tested(by_observer: Floats, weights: Floats, theta: Floats, covariance: Floats, differ: Verdicts) -> Flags:
    """Return which pairs of each replicate ``differ`` by their |t|, shape (B, P)."""
    people, n, _ = by_observer.shape
    first, second = np.triu_indices(n, 1)
    own = contrast_variances(covariance)[:, first, second]
    if why_not_profiled(Counts.from_wins(by_observer.sum(axis=0)[None])):
        apart, error = np.abs(theta[:, first] - theta[:, second]), np.sqrt(own)
        t = np.divide(apart, error, out=np.zeros_like(own), where=error > 0)  # no spread is no evidence
        return differ(t, np.arange(len(t)))
    counts = Counts.from_wins((weights @ by_observer.reshape(people, n * n)).reshape(-1, n, n))
    model = contrast_variances(model_covariances(by_observer, weights, theta))[:, first, second]
    return verdicts(counts, theta, own / model, differ)


def _critical(replicates: Replicates, alpha: float, kind: Clustered) -> float:
    """Return the |t| that the largest of all pairs reaches with chance ``alpha`` when no two items differ."""
    by_observer, ones = replicates.by_observer, np.ones((1, len(replicates.observers)))
    largest = spreads(by_observer, ones, replicates.fit.theta[None], kind).largest(
        MAXZ_SAMPLES, np.random.default_rng(MAXZ_SEED)
    )
    return float(np.quantile(largest, 1 - alpha))
