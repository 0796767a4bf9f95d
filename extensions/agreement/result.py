"""What came of comparing measures with observers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any, ClassVar, Literal

from documents.arrays import Floats
from documents.text import JsonResult, finite
from extensions.agreement.correlations import CorrelationKind
from extensions.agreement.limits import LimitCheck
from extensions.agreement.observed import ObservedGroup
from extensions.agreement.pairs import PairAccuracy

Decision = Literal["agrees", "not shown", "cannot be said"]


@dataclass(frozen=True, slots=True, eq=False)
class Predicted:
    """What a measure says of the stimuli.

    Attributes
    ----------
    name, title, unit
        As it is typed and printed, and its unit; empty for none.
    better
        Whether ``lower`` or ``higher`` values are nearer to the photograph.
    values
        For each group, shape (n,): the value of each stimulus beside its photograph.
    limit
        Within it, the measure says that there is no difference; None where none is known.
    remarks
        What was assumed.
    """

    name: str
    title: str
    unit: str
    better: Literal["lower", "higher"]
    values: tuple[Floats, ...]
    limit: float | None = None
    remarks: tuple[str, ...] = ()

    @property
    def sign(self) -> float:
        """What turns its values into larger for better: 1 or −1."""
        return 1.0 if self.better == "higher" else -1.0


@dataclass(frozen=True, slots=True)
class Correlation(JsonResult):
    """A correlation of a measure, larger for better, with scores; None where either does not vary.

    ``low`` and ``high`` are 95 % limits for other observers of the kind and these stimuli, None without a bootstrap;
    ``p`` the one-sided p value of a measure that has nothing to do with the stimuli.
    """

    value: float | None
    low: float | None
    high: float | None
    p: float | None


@dataclass(frozen=True, slots=True, eq=False)
class GroupResult(JsonResult):
    """A measure beside the observers of one group; ``calibration`` is None where the photograph was not compared."""

    correlations: Mapping[CorrelationKind, Correlation]
    accuracy: PairAccuracy
    calibration: LimitCheck | None
    json_keys: ClassVar = {"accuracy": "pairs", "calibration": "limit"}


@dataclass(frozen=True, slots=True, eq=False)
class MeasureResult(JsonResult):
    """A measure beside the observers of all groups.

    Attributes
    ----------
    predicted
        The measure.
    groups
        Each group's result.
    whole
        That of all groups: mean correlations, and the pairs and stimuli of all.
    adjusted_p
        The p value of Spearman's correlation over all groups, by Holm's correction for the number of measures; None
        where the measure does not vary.
    decision
        Whether it agrees at the level: ``not shown`` is no proof of the contrary; ``cannot be said`` where even
        perfect agreement could not reach the level with so few stimuli.
    """

    predicted: Predicted
    groups: tuple[GroupResult, ...]
    whole: GroupResult
    adjusted_p: float | None
    decision: Decision
    json_keys: ClassVar = {"whole": "*"}
    json_names: ClassVar = (
        "predicted.name predicted.title predicted.unit predicted.better predicted.limit decision adjusted_p whole "
        "groups predicted.remarks"
    )


@dataclass(frozen=True, slots=True)
class PairPrediction(JsonResult):
    """Two stimuli: the one with the higher score and the other, and what measures say of them.

    ``difference`` is that of the scores; ``predicted`` says by the measure's name whether it puts the ``better`` one
    first: 1, −1 for the other way, and 0 where both have the same value.
    """

    better: str
    worse: str
    difference: float
    told_apart: bool
    predicted: Mapping[str, int]


def _way(predicted: Predicted, number: int, first: int, second: int) -> int:
    one, other = (predicted.sign * float(predicted.values[number][place]) for place in (first, second))
    return (one > other) - (one < other)


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """Measures beside observers.

    Attributes
    ----------
    groups
        What observers said, the photographs among the stimuli where they were compared.
    photographs
        For each group the name of the photograph that its stimuli are measured against.
    measures
        Each measure's result.
    alpha
        The level.
    least_p
        The least p value that so many stimuli can give.
    notes
        Sentences that a reader needs before the numbers.
    """

    groups: tuple[ObservedGroup, ...]
    photographs: tuple[str, ...]
    measures: tuple[MeasureResult, ...]
    alpha: float
    least_p: float
    notes: tuple[str, ...]

    def pairs(self, number: int) -> tuple[PairPrediction, ...]:
        """Return every two stimuli of a group, without its photograph: what observers and the measures say of them."""
        group, photograph = self.groups[number], self.photographs[number]
        others = [place for place, name in enumerate(group.stimuli) if name != photograph]
        return tuple(
            PairPrediction(
                better=group.stimuli[first],
                worse=group.stimuli[second],
                difference=float(group.scores[first] - group.scores[second]),
                told_apart=bool(group.differs[first, second]),
                predicted={one.predicted.name: _way(one.predicted, number, first, second) for one in self.measures},
            )
            for i, j in combinations(others, 2)
            for first, second in [(i, j) if group.scores[i] >= group.scores[j] else (j, i)]
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON: no NaN, null where there is no finite value."""
        return {
            "alpha": self.alpha,
            "least_p": self.least_p,
            "notes": list(self.notes),
            "groups": [
                {
                    "name": group.name,
                    "task": group.task,
                    "unit": group.unit,
                    "observers": group.observers,
                    "photograph": photograph,
                    "stimuli": [
                        {
                            "name": stimulus,
                            "score": float(group.scores[place]),
                            "same_class_as_photograph": same_class(group, photograph, place),
                            **{
                                result.predicted.name: finite(float(result.predicted.values[number][place]))
                                for result in self.measures
                            },
                        }
                        for place, stimulus in enumerate(group.stimuli)
                    ],
                    "pairs": [pair.to_json() for pair in self.pairs(number)],
                }
                for number, (group, photograph) in enumerate(zip(self.groups, self.photographs, strict=True))
            ],
            "measures": [result.to_json() for result in self.measures],
        }


def same_class(group: ObservedGroup, photograph: str, place: int) -> bool | None:
    """Return whether observers do not tell a stimulus from the photograph; None where that was not compared."""
    if photograph not in group.stimuli:
        return None
    return not bool(group.differs[group.stimuli.index(photograph), place])
