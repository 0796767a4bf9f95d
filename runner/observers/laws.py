"""The laws by which simulated observers judge, as probabilities.

Strengths are log scores in nats: θ_i = ln s_i.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from runner.observers.behaviour import PsychometricSpec, TiesSpec


def logistic(log_odds: float) -> float:
    """Return 1 / (1 + exp(-log_odds)), for any finite number."""
    if log_odds >= 0:
        return 1.0 / (1.0 + math.exp(-log_odds))
    odds = math.exp(log_odds)
    return odds / (1.0 + odds)


def pair_law(log_odds: float, ties: TiesSpec | None = None) -> tuple[float, float, float]:
    """Return the probabilities of the first, the second and a tie; ``log_odds`` are θ_first - θ_second.

    Without ties [Bradley1952], the first is chosen with s_1 / (s_1 + s_2). Davidson's law [Davidson1970] gives a tie
    the weight ν √(s_1 s_2) beside s_1 and s_2; in that of Rao and Kupper [Rao1967] the first is chosen with
    s_1 / (s_1 + θ s_2), the second with s_2 / (s_2 + θ s_1), and the rest are ties.
    """
    if ties is None:
        first = logistic(log_odds)
        return first, 1.0 - first, 0.0
    if ties.law == "rao_kupper":
        widening = math.log(ties.width)
        first, second = logistic(log_odds - widening), logistic(-log_odds - widening)
        return first, second, max(0.0, 1.0 - first - second)
    # Divided by the larger of the two scores: nothing overflows.
    half = -abs(log_odds) / 2
    weaker, tie = math.exp(2 * half), ties.width * math.exp(half)
    total = 1.0 + weaker + tie
    likely, unlikely = 1.0 / total, weaker / total
    return (likely, unlikely, tie / total) if log_odds >= 0 else (unlikely, likely, tie / total)


def choice_law(log_scores: Sequence[float]) -> list[float]:
    """Return the probability of choosing each of several: s_i / Σ s, Luce's choice axiom [Luce1959]."""
    highest = max(log_scores)
    scores = [math.exp(score - highest) for score in log_scores]
    return [score / sum(scores) for score in scores]


def difficulty(log_scores: Sequence[float]) -> float:
    """Return how hard a choice among several is: the entropy of Luce's choice as a share of its most, 0 to 1."""
    if len(log_scores) < 2:
        return 0.0
    entropy = -sum(p * math.log(p) for p in choice_law(log_scores) if p > 0)
    return min(1.0, entropy / math.log(len(log_scores)))


def psychometric_law(strength: float, options: int, function: PsychometricSpec) -> float:
    """Return the probability of being right: guessing at no strength, certain at much, logistic in its logarithm."""
    guess = 1.0 / options
    if strength <= 0:
        return guess
    return guess + (1.0 - guess) * logistic(function.slope * math.log(strength / function.threshold))
