"""What is concluded of each pair, from its probability, its equivalence and the other analyses of the same answers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from analysis.bootstrap.stability import Stability
from analysis.classes.conclusions import Conclusion, verdict_of
from analysis.comparisons.comparisons import Comparisons, without_observers
from analysis.inference.chances import PairProbabilities, PairProbability
from analysis.inference.choices import Multiverse, observer_parts
from analysis.inference.terminal import ReviewAnswer
from analysis.inference.tost import Equivalence
from analysis.scaling.scores import Scores

MOST_REFITS = 30


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
    others, equivalent = answers.get("multiverse"), answers.get("equivalence")
    stands = _shares(others) if isinstance(others, Multiverse) else {}
    alike = _alike(equivalent) if isinstance(equivalent, Equivalence) else {}
    conclusions = []
    for pair in found.pairs:
        both = frozenset((pair.first, pair.second))
        one = _tested(pair, found.jnd, scores.classes.alpha, by_observers=scores.fit.clustered is not None)
        if both in alike:
            one = replace(one, verdict="equivalent", **alike[both])
        elif both in stands:
            one = replace(one, **stands[both])
        elif stability is not None:
            one = _in_samples(one, pair, stability)
        conclusions.append(one)
    return tuple(conclusions)


def _tested(pair: PairProbability, jnd: float, level: float, *, by_observers: bool) -> Conclusion:
    low, high = (end / jnd if math.isfinite(end) else None for end in (pair.low, pair.high))
    verdict = None if pair.p is None else verdict_of(pair.p <= level)
    question = f"{pair.first} over {pair.second}"
    return Conclusion(question, verdict, pair.p, by_observers, pair.difference / jnd, low, high, "JND")


def _shares(others: Multiverse) -> dict[frozenset[str], dict[str, Any]]:
    words = f"{len(others.analyses):,} analyses"
    return {frozenset((pair.first, pair.second)): {"stands": pair.stands, "others": words} for pair in others.pairs}


def _alike(found: Equivalence) -> dict[frozenset[str], dict[str, Any]]:
    return {
        frozenset((pair.first, pair.second)): {"p": pair.p_equivalent, "margin": found.margin_text}
        for pair in found.pairs
        if pair.verdict == "equivalent"
    }


def _in_samples(one: Conclusion, pair: PairProbability, stability: Stability) -> Conclusion:
    place = {name: number for number, name in enumerate(stability.items)}
    shared = float(stability.shared[place[pair.first], place[pair.second]])
    samples = f"{stability.replicates - stability.without_fit:,} bootstrap samples"
    return replace(one, stands=1 - shared if one.verdict == "distinguished" else shared, others=samples)


def without_each(comparisons: Comparisons) -> Iterator[Comparisons]:
    """Yield the answers without each observer; above 30 observers, without each of 20 parts of them."""
    part, names = observer_parts(comparisons.observers, MOST_REFITS)
    for number in range(len(names) - 1):
        yield without_observers(comparisons, part == number)
