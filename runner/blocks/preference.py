"""Stereo or flat? The same picture in both versions, and which of them was closer to the reference.

The thesis's preliminary test (Section 4.5.1.2): every observer chose the stereoscopic version, many without knowing
which of the two it was.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from typing import Literal

from runner.blocks.intervals import SEQUENCE_WORDS, present
from runner.blocks.layouts import PairLayout, SingleLayout
from runner.blocks.message import page
from runner.blocks.pair_order import spread
from runner.blocks.pair_views import SequenceView, SimultaneousView
from runner.blocks.steps import SECONDS_PER_TRIAL, Block, Draft, Hold, Steps, answer
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.tasks import Compare
from runner.ports import Ask
from runner.presenter.scene import Scene

View = Literal["stereo", "flat"]
_OWN_PACE_S = 3.0


@dataclass(frozen=True, slots=True)
class Versions:
    """The two stimuli that show one picture."""

    stereo: str
    flat: str


@dataclass(frozen=True, slots=True)
class Preference(Block):
    """Each picture's two versions once per repeat, the stereo one first in half of them, one more or less.

    A layout for one picture shows them in two intervals, each for ``exposure_s`` or, if that is None, until the
    observer goes on, with ``blank_between_s`` between them; a layout for two shows them at once. ``blank_s`` is black
    between two trials. The response time runs from the onset of the question (of the pair, where it stays).
    """

    versions: tuple[Versions, ...]
    question: str
    layout: PairLayout | SingleLayout
    seed: str
    order_seed: str
    flip_sides: bool = False
    repeats: int = 1
    exposure_s: float | None = None
    blank_between_s: float = 0.0
    blank_s: float = 0.0
    break_every: int | None = None
    style: Style = FULL_HD_HALF
    reference: str | None = None

    @property
    def trials(self) -> int:
        """Pictures times repeats."""
        return len(self.versions) * self.repeats

    @property
    def expected_s(self) -> float:
        """A few seconds for each answer, and as long as the pictures are shown before it."""
        in_sequence = isinstance(self.layout, SingleLayout)
        each_s = self.exposure_s or (_OWN_PACE_S if in_sequence else 0.0)
        shown_s = each_s * (2 if in_sequence else 1) + self.blank_between_s + self.blank_s
        return self.trials * (SECONDS_PER_TRIAL + shown_s)

    @property
    def keys(self) -> dict[str, str]:
        """What chooses."""
        return self.view.keys

    @property
    def view(self) -> SimultaneousView | SequenceView:
        """How the two are shown."""
        if isinstance(self.layout, SingleLayout):
            return SequenceView(self.layout, self.question, self.style, reference=self.reference)
        return SimultaneousView(self.layout, self.question, self.style, reference=self.reference)

    def order(self) -> list[tuple[Versions, bool]]:
        """Return the pictures in the observer's order, and whether the stereo version stands first."""
        sides = list(range(len(self.versions)))
        random.Random(f"{self.seed}/sides").shuffle(sides)
        rng = random.Random(f"{self.order_seed}/preference")
        number = {name: index for index, name in enumerate(self._names)}
        picture = {(number[one.stereo], number[one.flat]): index for index, one in enumerate(self.versions)}
        order: list[tuple[int, int]] = []
        stereo_first: list[bool] = []
        for repeat in range(self.repeats):
            part = spread(list(picture), rng, order[-1] if order else None)
            order += part
            stereo_first += [bool((sides[picture[pair]] + repeat) % 2) != self.flip_sides for pair in part]
        return [(self.versions[picture[pair]], first) for pair, first in zip(order, stereo_first, strict=True)]

    def steps(self) -> Steps:
        """Show both versions of each picture, ask, and record the answer."""
        view = self.view
        order = self.order()
        trials = [(one.stereo, one.flat) if stereo_first else (one.flat, one.stereo) for one, stereo_first in order]
        if isinstance(view, SequenceView):
            yield replace(page(SEQUENCE_WORDS, self.style), upcoming=view.pair(*trials[0]))
        for number, (first, second) in enumerate(trials):
            if self.break_every and number and number % self.break_every == 0:
                words = f"Time for a break.\n{number} of {len(trials)} comparisons are done."
                yield replace(page(words, self.style), upcoming=view.pair(first, second))
            if self.blank_s and number:
                yield Hold("blank", Scene(), self.blank_s)
            shown = present(view, first, second, self.exposure_s, self.blank_between_s)
            scene, interval_s = yield from shown
            upcoming = view.pair(*trials[number + 1]) if number + 1 < len(trials) else None
            task = Compare(first, second, self.reference)
            response = answer((yield Ask(scene, view.keys, upcoming, task, view.targets)))
            chosen, rejected = (first, second) if response.meaning == "first" else (second, first)
            stereo = order[number][0].stereo
            data = {
                "first": first,
                "second": second,
                "answer": response.meaning,
                "chosen": chosen,
                "rejected": rejected,
                "chosen_view": _view(chosen, stereo),
                "first_view": _view(first, stereo),
                "first_position": view.position_names[0],
                **({"interval_s": interval_s} if interval_s else {}),
            }
            yield Draft("preference", data, stimuli=(first, second), response_time_s=response.time_s)

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(name for one in self.versions for name in (one.stereo, one.flat)))


def _view(name: str, stereo: str) -> View:
    return "stereo" if name == stereo else "flat"
