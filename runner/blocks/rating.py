"""`kind: rating`: single stimuli, each rated on one scale or more.

This is absolute category rating, as in ITU-R BT.500 and ITU-T P.910.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from documents.yaml import Natural
from runner.blocks.block import (
    SECONDS_PER_TRIAL,
    Block,
    BlockSpec,
    Draft,
    Fault,
    Hold,
    Named,
    Steps,
    StimulusNames,
    chosen,
    name_faults,
)
from runner.blocks.field_types import Seconds, ShortSeconds
from runner.blocks.layout import SingleLayout
from runner.blocks.message import page
from runner.blocks.orders import repeated
from runner.blocks.scale import Scale, ScaleSpec, ends_of, rate, scale_faults, scale_items, scales_named
from runner.blocks.setting import Setting, Stimuli
from runner.blocks.style import FULL_HD_HALF, Style
from runner.presenter.scene import Item, Offset, Picture, Scene


@dataclass(frozen=True, slots=True)
class Rating(Block):
    """Each of the ``stimuli`` alone, once per repeat, rated on every one of the ``scales`` in turn.

    In seconds, to the nearest frame: ``fixation_s`` shows a cross where the picture will be, ``exposure_s`` takes the
    picture away again and leaves the scale (None: it stays until the last rating), ``blank_s`` is black between two.
    The response time is that of all ratings together, from when the first scale is shown.
    """

    stimuli: tuple[str, ...]
    scales: tuple[Scale, ...]
    layout: SingleLayout
    seed: str
    repeats: int = 1
    break_every: int | None = None
    fixation_s: float = 0.0
    exposure_s: float | None = None
    blank_s: float = 0.0
    style: Style = FULL_HD_HALF
    reference: str | None = None

    @property
    def trials(self) -> int:
        """Stimuli times repeats."""
        return len(self.stimuli) * self.repeats

    @property
    def scale_ends(self) -> dict[str, tuple[int, int]]:
        """Those of its scales."""
        return ends_of(self.scales)

    @property
    def expected_s(self) -> float:
        """As long as its ratings take."""
        return self.trials * (SECONDS_PER_TRIAL * len(self.scales) + (self.exposure_s or 0.0) + self.blank_s)

    @property
    def keys(self) -> dict[str, str]:
        """What moves the marker and what accepts it."""
        return {key: meaning for scale in self.scales for key, meaning in scale.keys.items()}

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where the pictures stand."""
        return self.layout.places_px

    def steps(self) -> Steps:
        """Ask for the ratings of every stimulus and record them together."""
        order = repeated(self.stimuli, self.repeats, random.Random(self.seed))
        for number, stimulus in enumerate(order):
            if self.break_every and number and number % self.break_every == 0:
                words = self.style.say("images_done", done=number, all=len(order))
                yield replace(page(words, self.style), upcoming=self._scene(stimulus))
            if self.blank_s and number:
                yield Hold("blank", Scene(), self.blank_s)
            if self.fixation_s:
                cross = self.style.text_at("+", self.layout.picture_px, height=48)
                yield Hold("fixation", Scene((cross,)), self.fixation_s)
            pictures = self._pictures(stimulus)
            if self.exposure_s:
                question = scale_items(self.scales[0], self.style, None, self.layout)[0]
                yield Hold("picture", Scene((*pictures, question)), self.exposure_s)
                pictures = ()
            following = order[number + 1] if number + 1 < len(order) else None
            ratings: dict[str, int] = {}
            times_s: dict[str, float] = {}
            for scale in self.scales:
                ratings[scale.name], time_s = yield from rate(
                    scale,
                    self.style,
                    layout=self.layout,
                    items=pictures,
                    stimulus=stimulus,
                    reference=self.reference,
                    upcoming=None if following is None else self._scene(following),
                )
                times_s[scale.name] = round(time_s, 6)
            yield Draft(
                "rating",
                {"stimulus": stimulus, "ratings": ratings, "rating_times_s": times_s},
                stimuli=(stimulus,),
                response_time_s=round(sum(times_s.values()), 6),
            )

    def _pictures(self, stimulus: str) -> tuple[Item, ...]:
        layout = self.layout
        return Picture(stimulus, layout.picture_px, layout.aperture_px), *layout.reference(self.reference)

    def _scene(self, stimulus: str) -> Scene:
        """Return what is first seen of a trial."""
        return Scene((*self._pictures(stimulus), *scale_items(self.scales[0], self.style, None, self.layout)))


class RatingSpec(BlockSpec):
    """Each stimulus alone, once per repeat, rated on every scale in turn.

    Times are in seconds, to the nearest frame: a fixation cross before each picture, a limited exposure of it (it stays
    until it is rated if left out), black between trials.
    """

    kind: Literal["rating"]
    """Which kind of entry this is; it decides which other keys there are."""
    ratings: Annotated[list[ScaleSpec], Field(min_length=1, max_length=12)]
    """The scales that each picture is rated on."""
    stimuli: StimulusNames = "all"
    """Which stimuli take part: all, or a list of their names."""
    repeats: Annotated[Natural, Field(le=100_000)] = 1
    """How many times each one is asked."""
    break_every: Natural | None = None
    """After how many trials there is a page to rest; left out, there is none."""
    fixation_s: ShortSeconds = 0.0
    """Seconds of a fixation mark before each trial."""
    exposure_s: Seconds | None = None
    """Seconds that the pictures are shown; left out, until the answer."""
    blank_s: ShortSeconds = 0.0
    """Seconds of an empty screen between trials."""

    def make(self, setting: Setting) -> Rating:
        """Return the block in the observer's own order."""
        return Rating(
            chosen(self.stimuli, setting.stimuli),
            tuple(scale.make() for scale in self.ratings),
            setting.single_layout(),
            setting.own_seed,
            repeats=self.repeats,
            break_every=self.break_every,
            fixation_s=self.fixation_s,
            exposure_s=self.exposure_s,
            blank_s=self.blank_s,
            style=setting.style,
            reference=setting.reference,
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli, and scales of one name."""
        yield from name_faults(self.stimuli, stimuli, "stimuli")
        yield from scale_faults(self.ratings, "ratings")

    def named(self, stimuli: Stimuli) -> Iterator[Named]:
        """Yield its scales."""
        yield from scales_named(self.ratings)
