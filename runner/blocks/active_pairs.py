"""Paired comparisons of many stimuli: after each batch of answers, those pairs that promise to tell the most."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from runner.blocks.all_pairs import fixation
from runner.blocks.layouts import PairLayout
from runner.blocks.message import page
from runner.blocks.pair_choice import Gain, PairChooser
from runner.blocks.pair_views import SimultaneousView
from runner.blocks.steps import SECONDS_PER_TRIAL, Block, Draft, Hold, Steps, answer
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.tasks import Compare
from runner.blocks.ties import Ties
from runner.ports import Ask
from runner.presenter.scene import Scene

_FIRST_SHARE = {"first": 1.0, "second": 0.0}  # of a win; any other answer prefers neither and is half a win for each


@dataclass(frozen=True, slots=True)
class ActivePairs(Block):
    """``trials_wanted`` pairs, chosen in batches of at most ``batch`` by what they are expected to tell.

    The first answers follow a path through all stimuli in random order; then each batch is chosen by all the answers
    that this observer gave, as `runner.blocks.pair_choice` says. Times are those of `AllPairs`, and so is the response
    time. The record has the number of the ``batch`` too.
    """

    stimuli: tuple[str, ...]
    question: str
    layout: PairLayout
    seed: str
    trials_wanted: int
    batch: int
    gain: Gain = "variance"
    break_every: int | None = None
    fixation_s: float = 0.0
    exposure_s: float | None = None
    blank_s: float = 0.0
    style: Style = FULL_HD_HALF
    reference: str | None = None
    ties: Ties = "none"

    @property
    def trials(self) -> int:
        """As many as are wanted."""
        return self.trials_wanted

    @property
    def expected_s(self) -> float:
        """A few seconds for each answer, and the timed scenes."""
        return self.trials * (SECONDS_PER_TRIAL + self.fixation_s + (self.exposure_s or 0.0) + self.blank_s)

    @property
    def keys(self) -> dict[str, str]:
        """What chooses."""
        return self.view.keys

    @property
    def view(self) -> SimultaneousView:
        """How the two are shown."""
        return SimultaneousView(self.layout, self.question, self.style, self.ties, self.reference)

    def steps(self) -> Steps:
        """Choose a batch, ask for its pairs and record each answer, until there are enough."""
        chooser = PairChooser(len(self.stimuli), self.batch, random.Random(self.seed), self.gain)
        view = self.view
        done = batches = 0
        while done < self.trials_wanted:
            pairs = chooser.next_batch(self.trials_wanted - done)
            scenes = [view.pair(self.stimuli[first], self.stimuli[second]) for first, second in pairs]
            for number, (first, second) in enumerate(pairs):
                if self.break_every and done and done % self.break_every == 0:
                    words = f"Time for a break.\n{done} of {self.trials_wanted} comparisons are done."
                    yield replace(page(words, self.style), upcoming=scenes[number])
                yield from self._before(scenes[number], first_of_all=done == 0)
                names = self.stimuli[first], self.stimuli[second]
                response = answer(
                    (
                        yield Ask(
                            view.question() if self.exposure_s else scenes[number],
                            view.keys,
                            scenes[number + 1] if number + 1 < len(scenes) else None,
                            Compare(*names, self.reference),
                            view.targets,
                        )
                    )
                )
                chooser.learn(first, second, first_share=_FIRST_SHARE.get(response.meaning, 0.5))
                data = {**_data(*names, response.meaning), "batch": batches}
                data["first_position"] = view.position_names[0]
                yield Draft("active_pairs", data, stimuli=names, response_time_s=response.time_s)
                done += 1
            batches += 1

    def _before(self, pair: Scene, *, first_of_all: bool) -> Iterator[Hold]:
        if self.blank_s and not first_of_all:
            yield Hold("blank", Scene(), self.blank_s)
        if self.fixation_s:
            yield Hold("fixation", fixation(self.style), self.fixation_s)
        if self.exposure_s:
            yield Hold("pair", pair, self.exposure_s)


def _data(first: str, second: str, meaning: str) -> dict[str, Any]:
    data = {"first": first, "second": second, "answer": meaning}
    if meaning not in _FIRST_SHARE:
        return data
    chosen, rejected = (first, second) if meaning == "first" else (second, first)
    return data | {"chosen": chosen, "rejected": rejected}
