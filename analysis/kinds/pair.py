"""What records of two stimuli side by side have: `all_pairs`, `active_pairs`, `preference`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from analysis.kinds.fields import Fields, Name, Whole
from analysis.kinds.trial import NAMED, ColumnWords, Rated, SoFar, Trial

Answer = Literal["first", "second"]
TIES = ("no_difference", "not_sure")
_TIES = dict(zip("nu", TIES, strict=True))
# What keys mean by where the first stimulus stood, unless the experiment gives them other meanings.
KEYS: Mapping[str | None, Mapping[str, str]] = MappingProxyType(
    {
        "top": {"up": "first", "pad_up": "first", "down": "second", "pad_down": "second", **_TIES},
        "left": {"left": "first", "pad_left": "first", "right": "second", "pad_right": "second", **_TIES},
        "interval_1": {
            **dict.fromkeys(("1", "left", "pad_left"), "first"),
            **dict.fromkeys(("2", "right", "pad_right"), "second"),
            **_TIES,
        },
    }
)


class EachRating(Fields):
    """A rating of both stimuli of a pair."""

    first: Whole
    second: Whole


class PairRecord(Trial):
    """Two stimuli in their places, and the answer."""

    columns: ClassVar[Mapping[str, ColumnWords]] = {
        "first": ColumnWords(f"Name of the stimulus at the first position. {NAMED}"),
        "second": ColumnWords(f"Name of the stimulus at the second position. {NAMED}"),
        "chosen": ColumnWords(f"Name of the stimulus that the observer chose. {NAMED}"),
        "rejected": ColumnWords(f"Name of the stimulus that the observer did not choose. {NAMED}"),
        "answer": ColumnWords(
            "What the observer answered.",
            levels={"first": "the picture at the first position", "second": "the picture at the second position"},
        ),
        "group": ColumnWords(
            "The group within which the pair was compared, such as the scene that both pictures show."
        ),
        "group_factor": ColumnWords("The factor of the stimuli whose levels are the groups."),
        "first_position": ColumnWords(
            "Position of the first picture.",
            levels={place: f"the first picture was at the {place}" for place in ("top", "bottom", "left", "right")},
        ),
    }
    no_stimulus: ClassVar[tuple[str, ...]] = ("group", "group_factor", "answer", "first_position")
    by_answers: ClassVar[bool] = False
    """Whether answers so far chose the pair."""
    asked: ClassVar[tuple[str, ...]] = ("first", "second", "first_position", "group", "group_factor")

    first: Name
    second: Name
    answer: Literal["first", "second", "no_difference", "not_sure"]
    chosen: Name | None = None
    rejected: Name | None = None
    first_position: Literal["top", "left", "interval_1"] | None = None
    group: str | None = None
    group_factor: str | None = None
    ratings: dict[Name, Whole | EachRating | None] | None = None
    """By scale the number, or one for each stimulus where none was chosen."""

    @property
    def said(self) -> str:
        """What was answered."""
        return self.answer

    @property
    def is_scored(self) -> bool:
        """Whether the pair is compared for the sake of scores."""
        return not self.is_practice

    @property
    def is_tie(self) -> bool:
        """Whether the answer prefers neither."""
        return self.answer in TIES

    @property
    def stimuli(self) -> tuple[str, ...]:
        """Both."""
        return self.first, self.second

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the choice with the answer, and the group with the stimuli's factors."""
        yield from self._choice()
        if not (self.group is None and self.group_factor is None):
            yield from self._group(session.factors)

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the answer with its key."""
        yield from super().pressed_otherwise(session, practised=practised)
        last = self.ratings is None and not practised
        yield from self.timed_by_press(last=last)
        key = self.answer_key(last=last)
        if key is not None and self.first_position is not None:
            yield from session.key_means(self.first_position, key, self.answer, KEYS[self.first_position])

    def rated(self) -> Iterator[Rated]:
        """Yield the ratings of what was chosen, or of both."""
        for scale, given in (self.ratings or {}).items():
            if isinstance(given, EachRating):
                yield Rated("both", scale, self.first, given.first)
                yield Rated("both", scale, self.second, given.second)
            elif given is not None and self.chosen is not None:
                yield Rated("chosen", scale, self.chosen, given)

    def may_be_alike(self) -> bool:
        """Return whether it may show a stimulus beside itself."""
        return False

    def _choice(self) -> Iterator[str]:
        alike = self.first == self.second
        if alike != self.may_be_alike():
            yield f"it compares '{self.first}' with '{self.second}'" + ("" if alike else ", not with itself")
        due: tuple[str | None, str | None] = (self.first, self.second)
        if alike or self.answer in TIES:
            due = None, None
        elif self.answer == "second":
            due = self.second, self.first
        if (self.chosen, self.rejected) != due:
            words = "nothing is chosen" if due[0] is None else f"'{due[0]}' is chosen and '{due[1]}' rejected"
            yield f"by its answer '{self.answer}' {words}, but it has '{self.chosen}' and '{self.rejected}'"

    def _group(self, factors: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
        if (self.group is None) != (self.group_factor is None):
            yield "'group' and 'group_factor' are there together or not at all"
        elif self.group is not None:
            for name in self.stimuli:
                level = factors.get(name, {}).get(self.group_factor or "")
                if level is not None and (level if isinstance(level, str) else f"{level:g}") != self.group:
                    yield f"its group is '{self.group}', but the {self.group_factor} of '{name}' is '{level}'"
