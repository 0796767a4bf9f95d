"""Tracks of threshold blocks: the stimuli of each from hard to easy, and what chooses the next of them.

Several tracks run interleaved: in rounds, each of which has a trial of every track in an order of its own, so that an
observer cannot tell which comes next.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field

from documents.yaml import FileModel
from extensions.thresholds.adaptive import LevelChooser, QuestPlus, Staircase
from extensions.thresholds.fit import Easier, axis_of
from extensions.thresholds.functions import FUNCTIONS
from extensions.thresholds.ladders import Ladder
from runner.blocks import Fault


@dataclass(frozen=True, slots=True)
class AskedTrial:
    """One trial: a stimulus of a ladder and its ``level``, None without a signal; whether it stands ``first``."""

    ladder: Ladder
    stimulus: str
    level: float | None
    first: bool

    @property
    def place(self) -> str:
        """Where the stimulus stands, which is what is right to answer."""
        return "first" if self.first else "second"

    @property
    def pair(self) -> tuple[str, str]:
        """The stimulus and the reference in their places."""
        reference = str(self.ladder.reference)
        return (self.stimulus, reference) if self.first else (reference, self.stimulus)


class QuestPlusSpec(FileModel):
    """QUEST+: the level whose answer is expected to tell most about threshold, slope and rates together."""

    kind: Literal["quest_plus"]
    """Which kind of entry this is; it decides which other keys there are."""
    tracks: Annotated[int, Field(ge=1, le=20)] = 1
    """How many of them run interleaved, for each level of ``within``."""

    @property
    def count(self) -> int:
        """How many tracks there are for a ladder."""
        return self.tracks

    def choices(self, ladder: Ladder, number: int, easier: Easier, guess: float | None, function: str) -> LevelChooser:
        """Return what chooses the levels of track ``number`` on a ladder."""
        sign = 1.0 if easier == "higher" else -1.0
        x = np.array(ladder.levels)
        x = np.log10(x) if axis_of(ladder.levels) == "log10" else x
        return QuestPlus.standard(sign * x, guess=guess, function=FUNCTIONS[function])

    def faults(self, ladder: Ladder, where: str) -> Iterator[Fault]:
        """Yield why it cannot run on a ladder."""
        yield from ()


Start: TypeAlias = Literal["above", "below"] | Annotated[float, Field(ge=-1e12, le=1e12)]


class StaircaseSpec(FileModel):
    """Weighted up-down: ``down`` levels harder after a right answer, ``up`` easier after a wrong one.

    It comes to rest at the share up / (up + down) of right answers. A staircase begins at each of ``start``: ``above``
    and ``below`` are a quarter of the levels from the easiest and the hardest.
    """

    kind: Literal["staircase"]
    """Which kind of entry this is; it decides which other keys there are."""
    up: Annotated[int, Field(ge=1, le=100)] = 3
    """How many levels easier it gets after a wrong answer."""
    down: Annotated[int, Field(ge=1, le=100)] = 1
    """How many levels harder it gets after a right answer."""
    start: Annotated[tuple[Start, ...], Field(min_length=1, max_length=20)] = ("above",)
    """Where each staircase begins: above, below, or a level."""

    @property
    def count(self) -> int:
        """How many tracks there are for a ladder."""
        return len(self.start)

    def choices(self, ladder: Ladder, number: int, easier: Easier, guess: float | None, function: str) -> LevelChooser:
        """Return what chooses the levels of track ``number`` on a ladder."""
        return Staircase(len(ladder.levels), self._place(ladder, self.start[number]) or 0, self.up, self.down)

    def faults(self, ladder: Ladder, where: str) -> Iterator[Fault]:
        """Yield why it cannot run on a ladder."""
        needed = self.up + self.down + 1
        if len(ladder.levels) < needed:
            what = f"a staircase that moves {self.up} up and {self.down} down needs {needed} levels"
            yield Fault(
                f"{what}, and there are {len(ladder.levels)}{where}", ("method",), "make more, or smaller steps"
            )
            return
        known = ", ".join(f"{level:g}" for level in ladder.levels[1:-1])
        for number, start in enumerate(self.start):
            place = self._place(ladder, start)
            if place is None:
                what, remedy = f"there is no level {start:g}{where}", f"start at above, below, or one of {known}"
                yield Fault(what, ("method", "start", number), remedy)
            elif not 0 < place < len(ladder.levels) - 1:
                what = f"the staircase starts at {start:g}, which has no {'harder' if place == 0 else 'easier'} level"
                yield Fault(f"{what}{where}", ("method", "start", number), f"start at above, below, or one of {known}")

    def _place(self, ladder: Ladder, start: Start) -> int | None:
        count = len(ladder.levels)
        quarter = max(1, (count - 1) // 4)
        if isinstance(start, str):
            return count - 1 - quarter if start == "above" else quarter
        return ladder.levels.index(start) if start in ladder.levels else None


MethodSpec: TypeAlias = Annotated[QuestPlusSpec | StaircaseSpec, Field(discriminator="kind")]


@dataclass(slots=True)
class Track:
    """One track: what it asks follows from the answers so far; all that is drawn by chance is drawn beforehand."""

    ladder: Ladder
    choices: LevelChooser
    sides: Sequence[bool]
    draws: Sequence[float]
    done: int = 0
    _level: int = field(init=False)

    def __post_init__(self) -> None:
        self._level = self.choices.next_level()

    @classmethod
    def of(cls, ladder: Ladder, choices: LevelChooser, trials: int, rng: random.Random) -> Track:
        """Return a track of so many trials; the stimulus stands first in half of them, one more or less."""
        sides = [number % 2 == 0 for number in range(trials)]
        rng.shuffle(sides)
        return cls(ladder, choices, sides, [rng.random() for _ in range(trials)])

    @property
    def now(self) -> AskedTrial:
        """What is asked next."""
        return self._asked(self._level, self.done)

    def following(self) -> tuple[AskedTrial, ...]:
        """Return what may be asked after ``now``, by its answer."""
        levels = dict.fromkeys(self.choices.after(self._level, right=right) for right in (True, False))
        return tuple(self._asked(level, self.done + 1) for level in levels)

    def learn(self, *, right: bool) -> None:
        """Take in the answer."""
        self.choices.learn(self._level, right=right)
        self.done += 1
        if self.done < len(self.sides):
            self._level = self.choices.next_level()

    def _asked(self, level: int, number: int) -> AskedTrial:
        names = self.ladder.stimuli[level]
        name = names[int(self.draws[number] * len(names))]
        return AskedTrial(self.ladder, name, self.ladder.levels[level], self.sides[number])


def interleaved(tracks: int, trials: int, catch: int, rng: random.Random) -> list[int | None]:
    """Return whose turn it is in each trial, None for the ``catch`` trials: spread, and none the first."""
    turns: list[int | None] = []
    for _ in range(trials):
        once = list(range(tracks))
        rng.shuffle(once)
        turns += once
    mixed: list[int | None] = []
    for number in range(catch):
        start, end = (len(turns) * edge // catch for edge in (number, number + 1))
        after = rng.randint(min(start + 1, end), end)
        mixed += [*turns[start:after], None, *turns[after:end]]
    return mixed or turns
