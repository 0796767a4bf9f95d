"""How well scores agree with others published for the same items."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from analysis.classes.classes import classify
from analysis.classes.multiplicity import Adjust
from analysis.scaling.fit import fit
from analysis.scaling.scores import Scores
from analysis.scaling.terminal import Published


@dataclass(frozen=True, slots=True)
class Agreement:
    """``correlation`` is Pearson's between log scores; ``pairs_alike`` of ``pairs`` share a class, or not, in both."""

    correlation: float
    pairs_alike: int
    pairs: int


def _share(label: str, second: str) -> bool:
    return bool(set(label.split("+")) & set(second.split("+")))


def agreement(scores: Scores, published: Published) -> Agreement | None:
    """Compare ``scores`` with ``published`` (score, class) per item; None if there is no fit or an item is missing."""
    items = scores.items
    if len(items) < 3 or any(item.log10_score is None or item.name not in published for item in items):
        return None
    ours = [item.log10_score or 0.0 for item in items]
    theirs = [np.log10(published[item.name][0]) for item in items]
    alike = sum(
        _share(a.label or "", b.label or "") == _share(published[a.name][1], published[b.name][1])
        for a, b in combinations(items, 2)
    )
    return Agreement(float(np.corrcoef(ours, theirs)[0, 1]), alike, len(items) * (len(items) - 1) // 2)


def expected_classes(published: Published, observers: int, alpha: float, adjust: Adjust) -> dict[str, str]:
    """Return the classes that ``observers`` give on average if they answer every pair once by the published scores.

    Each pair's expected counts, observers · p_ij, take the place of answers.
    """
    names = list(published)
    strength = np.array([published[name][0] for name in names])
    wins = observers * strength[:, None] / (strength[:, None] + strength)
    np.fill_diagonal(wins, 0.0)
    fitted = fit(wins)
    labels = classify(fitted.theta, fitted.covariance, alpha=alpha, adjust=adjust).labels
    return dict(zip(names, labels, strict=True))
