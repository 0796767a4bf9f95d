"""How a simulated observer departs from perfect attention: sides, lapses, fatigue, ties, thresholds."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from documents.yaml.load import Strict
from runner.protocol.parts import Label

Share = Annotated[float, Field(ge=0, le=1)]


class FatigueSpec(Strict):
    """What grows evenly from the first judgement on, until after ``over_trials`` of them it stays.

    ``lapse_rate`` is the share of random answers at the end. ``noise`` is what log odds are divided by at the end: 1 is
    none, 2 halves every difference between two pictures.
    """

    over_trials: PositiveInt
    lapse_rate: Share | None = None
    noise: Annotated[float, Field(ge=1)] = 1.0


class TiesSpec(Strict):
    """How often two pictures are a tie where that may be answered: ν of Davidson's law or θ of Rao and Kupper's.

    Where both ``no_difference`` and ``not_sure`` may be answered, ``not_sure_share`` of the ties are the latter.
    """

    law: Literal["davidson", "rao_kupper"] = "davidson"
    width: NonNegativeFloat
    not_sure_share: Share = 0.5

    @model_validator(mode="after")
    def _wide_enough(self) -> Self:
        if self.law == "rao_kupper" and self.width < 1:
            raise ValueError("the width of Rao and Kupper's law is 1 (no ties) or more")
        return self


class PsychometricSpec(Strict):
    """How often a question with a right answer is answered right, by its strength in the task's unit.

    At ``threshold`` it is half-way between guessing and certainty; ``slope`` is in log odds per factor of e in
    strength.
    """

    threshold: PositiveFloat
    slope: PositiveFloat = 4.0


class BehaviourSpec(Strict):
    """What simulated observers have in common, however they judge.

    ``position_bias`` is in log odds for the picture in the first place. ``lapse_rate`` is the share of judgements that
    are random among all answers allowed. ``rating_noise`` is a standard deviation as a share of a scale's length.
    ``psychometric`` is by the name of the task; a task that has a right answer and no entry here is answered right.
    """

    median_response_time_s: PositiveFloat = 2.0
    position_bias: float = 0.0
    lapse_rate: Share = 0.0
    fatigue: FatigueSpec | None = None
    ties: TiesSpec | None = None
    rating_noise: NonNegativeFloat = 0.1
    psychometric: dict[Label, PsychometricSpec] = Field(default_factory=dict)

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
