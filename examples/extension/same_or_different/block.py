"""`kind: same_or_different`: what observers meet."""

from __future__ import annotations

import random
from functools import partial
from typing import Annotated, Literal

from pydantic import Field

from runner.blocks import Block, BlockContext, BlockKind, Draft, Steps
from runner.ports import Ask, Choose, Hold, answer
from runner.scene import Scene
from runner.views import SequenceView

KEYS = {"s": "same", "d": "different"}


class SameOrDifferent(BlockKind):
    """Two pictures, one after the other: half of them the same one twice. Were they the same?"""

    kind: Literal["same_or_different"]
    trials: Annotated[int, Field(ge=2, le=10_000)] = 20
    """How many trials there are."""
    exposure_s: Annotated[float, Field(gt=0, le=60)] = 0.5
    """Seconds that each picture is shown."""

    def meet(self, setting: BlockContext) -> Block:
        """Return the block as one observer meets it, in an order of their own."""
        view = SequenceView(setting.single_layout(), "Same (s) or different (d)?", setting.style)
        return Block(
            entry=self,
            steps=partial(self._steps, setting, view),
            trials=self.trials,
            expected_s=self.trials * (2 * self.exposure_s + 2.0),
            keys=KEYS,
            places_px=view.layout.places_px,
        )

    def _steps(self, setting: BlockContext, view: SequenceView) -> Steps:
        draw = random.Random(f"{setting.own_seed}/same_or_different")
        truths = [("same", "different")[number % 2] for number in range(self.trials)]
        draw.shuffle(truths)
        question = Scene((setting.style.text_at(view.words, view.layout.question_px),))
        for truth in truths:
            first, other = draw.sample(setting.stimuli.names, 2)
            second = first if truth == "same" else other
            for number, name in enumerate((first, second)):
                yield Hold(view.position_names[number], view.interval(number, name), self.exposure_s)
            task = Choose(self.kind, tuple(KEYS.values()), correct=truth, strength=1.0)
            response = answer((yield Ask(question, KEYS, task=task)))
            data = {"first": first, "second": second, "answer": response.meaning}
            yield Draft(self.kind, data, (first, second), response.time_s)
