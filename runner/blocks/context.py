"""What a block is made from beside its own entry in the file: the rig, the stimuli, the observer."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from devices.display import Rig
from runner.views.layout import NO_REFERENCE, LayoutSpec, PairLayout, SingleLayout, pair_layout, single_layout
from runner.views.style import Style

Factors = Mapping[str, str | float]


def level_words(level: str | float) -> str:
    """Return a factor's level as words: "jpeg", "1.3"."""
    return level if isinstance(level, str) else f"{level:g}"


def shared_seed(seed: int, experiment: str, index: int) -> str:
    """Return the seed that all observers share of the block number ``index`` of an experiment."""
    return f"{seed}/{experiment}/{index}"


@dataclass(frozen=True, slots=True)
class Stimuli:
    """What there is to look at: ``factors`` by name, and which of them is the ``reference``, None if it is none."""

    factors: Mapping[str, Factors]
    reference: str | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The names of those that are judged: all but the reference."""
        return tuple(name for name in self.factors if name != self.reference)


@dataclass(frozen=True, slots=True)
class Draw:
    """What beside seed and observer fixes the order of a session's trials, as its log's header has it.

    ``rule`` is how observers are paired: by 1, as in older logs, the numbers 2 and 3, 4 and 5, take opposite sides; by
    2 it is 1 and 2, 3 and 4. ``sitting`` is 1 for an observer's first session, 2 for the second: its order is another,
    and every second sitting has the other sides.
    """

    rule: int = 2
    sitting: int = 1

    def pair_number(self, observer: int) -> int:
        """Return the number of the pair of observers that has the ``observer`` of this number."""
        return observer // 2 if self.rule == 1 else (observer - 1) // 2


@dataclass(frozen=True, slots=True)
class BlockContext:
    """An experiment as one block, number ``index`` in the file, and one ``observer`` meet it.

    ``style`` is how words look in an eye's view; ``followed_by`` says what comes after the block; ``draw`` is how the
    order is drawn.
    """

    experiment: str
    seed: int
    question: str
    layout: LayoutSpec
    rig: Rig
    style: Style
    stimuli: Stimuli
    observer: str
    index: int = 0
    followed_by: Literal["page", "trials", "nothing"] = "trials"
    draw: Draw = Draw()

    @property
    def hint(self) -> str:
        """What a page says to press the space bar for, by its name among the interface's words."""
        return {"page": "next_page", "trials": "begin", "nothing": "finish"}[self.followed_by]

    @property
    def reference(self) -> str | None:
        """The reference picture's name, None if there is none."""
        return self.stimuli.reference

    @property
    def has_reference(self) -> bool:
        """Whether there is a reference: a picture, or a real thing beside the screen."""
        return self.layout.reference != NO_REFERENCE

    @property
    def observer_number(self) -> int:
        """The observer's number if the label is one, else a number drawn from it."""
        if self.observer.isdecimal():
            return int(self.observer)
        return int.from_bytes(hashlib.sha256(self.observer.encode()).digest()[:8])

    @property
    def flips_sides(self) -> bool:
        """Whether this is the one of two neighbours, who share an orientation, who takes the other sides."""
        return bool(self.observer_number % 2) != (self.draw.sitting % 2 == 0)

    @property
    def pair_seed(self) -> str:
        """A seed that two neighbouring observers share."""
        return f"{self.shared_seed}/{self.draw.pair_number(self.observer_number)}"

    @property
    def shared_seed(self) -> str:
        """A seed that all observers share."""
        return shared_seed(self.seed, self.experiment, self.index)

    @property
    def own_seed(self) -> str:
        """A seed of this observer alone."""
        again = f"/sitting {self.draw.sitting}" if self.draw.sitting > 1 else ""
        return f"{self.pair_seed}/{self.observer}{again}"

    def pair_layout(self) -> PairLayout:
        """Place two pictures, the question and a reference picture if there is one.

        Raises
        ------
        LayoutError
            If they do not fit an eye's view.
        """
        return pair_layout(self.layout, self.rig.display.panel, self.style, with_reference=self.reference is not None)

    def single_layout(self) -> SingleLayout:
        """Place one picture, what is written above and below it, and a reference picture if there is one.

        Raises
        ------
        LayoutError
            If they do not fit an eye's view.
        """
        return single_layout(self.layout, self.rig.display.panel, self.style, with_reference=self.reference is not None)
