"""What is concluded of each pair, from its probability, its equivalence and the other analyses of the same answers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from analysis.bootstrap.stability import Stability
from analysis.classes.conclusions import Conclusion, verdict_of
from analysis.inference.answers import ReviewAnswer
from analysis.inference.chances import PairProbabilities
from analysis.inference.differences import differences
from analysis.inference.multiverse_analysis import Multiverse
from analysis.inference.tost import Equivalence
from analysis.scaling.scores import Scores

MOST_NEIGHBOURS = 199
LEVEL = 0.95
_Pair = tuple[str, str, float | None, float, float, float]  # two names, p, difference and the ends of its interval


def pair_conclusions(
    scores: Scores, answers: Mapping[str, ReviewAnswer], stability: Stability | None = None
) -> tuple[Conclusion, ...]:
    """Return what is concluded of every pair, pairs of the best item first.

    Parameters
    ----------
    scores
        Scores of paired comparisons.
    answers
        Their ``pairs`` and, for verdicts of equivalence and for how robust each is, ``equivalence`` and ``multiverse``,
        as `review` gives them.
    stability
        How often bootstrap samples conclude the same, for pairs without a ``multiverse``.

    Returns
    -------
    tuple[Conclusion, ...]
        Differences in JND with their 95 % intervals; empty without ``pairs`` or without classes.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.inference import review
    >>> from analysis.scaling import score
    >>> scores = score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)]))
    >>> (pair,) = pair_conclusions(scores, review(scores, pairs=True))
    >>> pair.question, pair.verdict, round(pair.estimate, 2), pair.unit
    ('a over b', 'distinguished', 1.0, 'JND')
    """
    found = answers.get("pairs")
    if not isinstance(found, PairProbabilities) or scores.classes is None:
        return ()
    pairs = [(one.first, one.second, one.p, one.difference, one.low, one.high) for one in found.pairs]
    return _concluded(scores, pairs, answers, stability)


def neighbour_conclusions(
    scores: Scores,
    answers: Mapping[str, ReviewAnswer] | None = None,
    stability: Stability | None = None,
    *,
    most: int = MOST_NEIGHBOURS,
) -> tuple[Conclusion, ...]:
    """Return what is concluded of each item and the next in rank, of ``most`` pairs, best first.

    Parameters are those of `pair_conclusions`; ``pairs`` are not read, and no others are computed.

    Raises
    ------
    ResultsError
        If there are no finite strengths.
    """
    classes, names = scores.classes, scores.comparisons.items
    if classes is None:
        return ()
    n = len(scores.order)
    ranks = np.arange(min(n - 1, most))
    apart = differences(scores).only(ranks * n - ranks * (ranks + 1) // 2)  # in which rows rank r stands before r + 1
    columns = (apart.first.tolist(), apart.second.tolist(), apart.estimate.tolist(), *apart.interval(LEVEL))
    pairs = [
        (names[first], names[second], float(classes.p[first, second]), estimate, float(low), float(high))
        for first, second, estimate, low, high in zip(*columns, strict=True)
    ]
    return _concluded(scores, pairs, answers or {}, stability)


def _concluded(
    scores: Scores, pairs: Iterable[_Pair], answers: Mapping[str, ReviewAnswer], stability: Stability | None
) -> tuple[Conclusion, ...]:
    others, equivalent = answers.get("multiverse"), answers.get("equivalence")
    stands = _shares(others) if isinstance(others, Multiverse) else {}
    alike = _alike(equivalent) if isinstance(equivalent, Equivalence) else {}
    conclusions = []
    for pair in pairs:
        both = frozenset(pair[:2])
        one = _tested(pair, scores)
        if both in alike:
            one = replace(one, verdict="equivalent", **alike[both])
        elif both in stands:
            one = replace(one, **stands[both])
        elif stability is not None:
            one = _in_samples(one, pair, stability)
        conclusions.append(one)
    return tuple(conclusions)


def _tested(pair: _Pair, scores: Scores) -> Conclusion:
    first, second, p, *values = pair
    estimate, low, high = (value / scores.jnd if math.isfinite(value) else None for value in values)
    verdict = None if p is None or scores.classes is None else verdict_of(p <= scores.classes.alpha)
    by_observers = scores.fit.clustered is not None
    return Conclusion(f"{first} over {second}", verdict, p, by_observers, estimate, low, high, "JND")


def _shares(others: Multiverse) -> dict[frozenset[str], dict[str, Any]]:
    words = f"{len(others.analyses):,} analyses"
    return {frozenset((pair.first, pair.second)): {"stands": pair.stands, "others": words} for pair in others.pairs}


def _alike(found: Equivalence) -> dict[frozenset[str], dict[str, Any]]:
    return {
        frozenset((pair.first, pair.second)): {"p": pair.p_equivalent, "margin": found.margin_text}
        for pair in found.pairs
        if pair.verdict == "equivalent"
    }


def _in_samples(one: Conclusion, pair: _Pair, stability: Stability) -> Conclusion:
    place = {name: number for number, name in enumerate(stability.items)}
    shared = float(stability.shared[place[pair[0]], place[pair[1]]])
    samples = f"{stability.replicates - stability.without_fit:,} bootstrap samples"
    return replace(one, stands=1 - shared if one.verdict == "distinguished" else shared, others=samples)
