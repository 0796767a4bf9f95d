"""`kind: rating`: single stimuli, each rated on one scale or more.

This is absolute category rating, as in ITU-R BT.500 and ITU-T P.910.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from functools import partial
from typing import Annotated, Literal

from pydantic import Field

from documents.yaml import Natural
from runner.blocks.block import SECONDS_PER_TRIAL, Block, Draft, Fault, Named, Steps, StimulusNames, chosen, name_faults
from runner.blocks.context import BlockContext, Stimuli
from runner.blocks.message import TimedKind
from runner.blocks.orders import repeated
from runner.blocks.scale import RatedScene, Scale, ends_of, rate_all, scale_faults, scale_items, scales_named
from runner.ports import Hold
from runner.scene import Item, Picture, Scene
from runner.views.layout import SingleLayout


class Rating(TimedKind):
    """Each stimulus alone, once per repeat, rated on every scale in turn.

    Times are in seconds, to the nearest frame: a fixation cross before each picture, a limited exposure of it (it stays
    until it is rated if left out), black between trials.
    """

    kind: Literal["rating"]
    ratings: Annotated[list[Scale], Field(min_length=1, max_length=12)]
    """The scales that each picture is rated on."""
    stimuli: StimulusNames = "all"
    """Which stimuli take part: all, or a list of their names."""
    repeats: Annotated[Natural, Field(le=100_000)] = 1
    """How many times each one is asked."""

    def meet(self, setting: BlockContext) -> Block:
        """Return the block in the observer's own order.

        The response time is that of all ratings together, from when the first scale is shown.
        """
        layout = setting.single_layout()
        trials = len(chosen(self.stimuli, setting.stimuli)) * self.repeats
        return Block(
            entry=self,
            steps=partial(self._steps, setting, layout),
            trials=trials,
            expected_s=trials * (SECONDS_PER_TRIAL * len(self.ratings) + (self.exposure_s or 0.0) + self.blank_s),
            keys={key: meaning for scale in self.ratings for key, meaning in scale.keys.items()},
            places_px=layout.places_px,
            scale_ends=ends_of(self.ratings),
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli, and scales of one name."""
        yield from name_faults(self.stimuli, stimuli, "stimuli")
        yield from scale_faults(self.ratings, "ratings")

    def named(self, stimuli: Stimuli) -> Iterator[Named]:
        """Yield its scales."""
        yield from scales_named(self.ratings)

    def _steps(self, setting: BlockContext, layout: SingleLayout) -> Steps:
        """Ask for the ratings of every stimulus and record them together."""
        style, reference = setting.style, setting.reference
        order = repeated(chosen(self.stimuli, setting.stimuli), self.repeats, random.Random(setting.own_seed))
        first_seen = {
            name: Scene((*_pictures(name, layout, reference), *scale_items(self.ratings[0], style, None, layout)))
            for name in order
        }
        for number, stimulus in enumerate(order):
            yield from self.rests(style, "images_done", number, len(order), first_seen[stimulus])
            yield from self.before(style, layout.picture_px, first_of_all=number == 0)
            pictures = _pictures(stimulus, layout, reference)
            if self.exposure_s:
                question = scale_items(self.ratings[0], style, None, layout)[0]
                yield Hold("picture", Scene((*pictures, question)), self.exposure_s)
                pictures = ()
            upcoming = first_seen[order[number + 1]] if number + 1 < len(order) else None
            about = RatedScene(layout, pictures, stimulus, reference, upcoming)
            ratings, times_s = yield from rate_all(self.ratings, style, about)
            yield Draft(
                "rating",
                {"stimulus": stimulus, "ratings": ratings, "rating_times_s": times_s},
                stimuli=(stimulus,),
                response_time_s=round(sum(times_s.values()), 6),
            )


def _pictures(stimulus: str, layout: SingleLayout, reference: str | None) -> tuple[Item, ...]:
    return Picture(stimulus, layout.picture_px, layout.aperture_px), *layout.reference(reference)
