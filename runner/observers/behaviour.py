"""How simulated observers judge: probabilities by known laws, and departures from perfect attention.

Strengths are log scores in nats: θ_i = ln s_i.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from documents.yaml import FileModel, Natural, NotNegative, Number, Positive
from runner.views.field_types import Factor

Share = Annotated[float, Field(ge=0, le=1)]


class FatigueSpec(FileModel):
    """What grows evenly from the first judgement on, until after ``over_trials`` of them it stays.

    ``lapse_rate`` is the share of random answers at the end. ``noise`` is what log odds are divided by at the end: 1 is
    none, 2 halves every difference between two pictures.
    """

    over_trials: Natural
    """After how many judgements fatigue grows no more."""
    lapse_rate: Share | None = None
    """The share of random answers at the end."""
    noise: Annotated[Positive, Field(ge=1)] = 1.0
    """What log odds are divided by at the end; 1 is no fatigue."""


class TiesSpec(FileModel):
    """How often two pictures are a tie where that may be answered: ν of Davidson's law or θ of Rao and Kupper's.

    Where both ``no_difference`` and ``not_sure`` may be answered, ``not_sure_share`` of the ties are the latter.
    """

    law: Literal["davidson", "rao_kupper"] = "davidson"
    """Whose law of ties it is."""
    width: NotNegative
    """How often two pictures are a tie: ν of Davidson's law or θ of Rao and Kupper's."""
    not_sure_share: Share = 0.5
    """The share of ties that are answered not sure."""

    @model_validator(mode="after")
    def _wide_enough(self) -> Self:
        if self.law == "rao_kupper" and self.width < 1:
            raise ValueError("the width of Rao and Kupper's law is 1 (no ties) or more")
        return self


class PsychometricSpec(FileModel):
    """How often a question with a right answer is answered right, by its strength in the task's unit.

    At ``threshold`` it is half-way between guessing and certainty; ``slope`` is in log odds per factor of e in
    strength, below 0 where lower levels are easier. ``guess`` is the share of right answers, or of "yes" where that is
    asked, of who sees nothing; left out, it is one over the number of options, and 0 for "yes".
    """

    threshold: Positive
    """The strength half-way between guessing and certainty."""
    slope: Number = 4.0
    """How steep it is, in log odds per factor of e in strength; below 0 where lower levels are easier."""
    guess: Annotated[float, Field(ge=0, lt=1)] | None = None
    """The share of right answers, or of yes, without seeing; left out, one over the options, 0 for yes."""

    @model_validator(mode="after")
    def _not_flat(self) -> Self:
        if self.slope == 0 or not math.isfinite(self.slope):
            raise ValueError("a slope of 0 has no threshold; write one above 0, or below 0 where lower is easier")
        return self


class BehaviourSpec(FileModel):
    """What simulated observers have in common, however they judge.

    ``position_bias`` is in log odds for the picture in the first place. ``lapse_rate`` is the share of judgements that
    are random among all answers allowed. ``rating_noise`` is a standard deviation as a share of a scale's length.
    ``psychometric`` is by the name of the task; a task that has a right answer and no entry here is answered right.
    """

    median_response_time_s: Positive = 2.0
    """The median response time, in s."""
    position_bias: Number = 0.0
    """The bias towards the picture in the first place, in log odds."""
    lapse_rate: Share = 0.0
    """The share of random answers."""
    fatigue: FatigueSpec | None = None
    """How judgements get worse with their number."""
    ties: TiesSpec | None = None
    """How often two pictures are a tie, where that may be answered."""
    rating_noise: NotNegative = 0.1
    """The standard deviation of ratings, as a share of the scale's length."""
    psychometric: dict[Factor, PsychometricSpec] = Field(default_factory=dict)
    """How often questions with a right answer are answered right, by task or by the factor of a threshold."""

    def lapses(self, judged: int) -> float:
        """Return the share of random answers after ``judged`` judgements."""
        if self.fatigue is None or self.fatigue.lapse_rate is None:
            return self.lapse_rate
        return self.lapse_rate + (self.fatigue.lapse_rate - self.lapse_rate) * self._tired(self.fatigue, judged)

    def noise(self, judged: int) -> float:
        """Return what log odds are divided by after ``judged`` judgements."""
        return 1.0 if self.fatigue is None else 1.0 + (self.fatigue.noise - 1.0) * self._tired(self.fatigue, judged)

    @staticmethod
    def _tired(fatigue: FatigueSpec, judged: int) -> float:
        return min(1.0, judged / fatigue.over_trials)


ATTENTIVE = BehaviourSpec()


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


def psychometric_law(strength: float | None, guess: float, function: PsychometricSpec) -> float:
    """Return the probability of being right: guessing at no strength, certain at much, logistic in its logarithm.

    ``guess`` is the share without seeing where the function gives none. No strength at all (None) is not seen.
    """
    guess = guess if function.guess is None else function.guess
    if strength is None:
        return guess
    if strength <= 0:
        return guess if function.slope > 0 else 1.0
    return guess + (1.0 - guess) * logistic(function.slope * math.log(strength / function.threshold))
