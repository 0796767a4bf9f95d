"""`kind: rating`: one picture at a time, rated on scales."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, PositiveInt

from runner.blocks.rating import Rating
from runner.presenter.scene import Offset
from runner.protocol.kinds.block_spec import BlockSpec, Fault, Some, chosen, name_faults
from runner.protocol.kinds.scale_spec import ScaleSpec, scale_faults
from runner.protocol.parts import Seconds, ShortSeconds
from runner.protocol.setting import Setting, Stimuli


class RatingSpec(BlockSpec):
    """Each stimulus alone, once per repeat, rated on every scale in turn.

    Times are in seconds, to the nearest frame: a fixation cross before each picture, a limited exposure of it (it stays
    until it is rated if left out), black between trials.
    """

    kind: Literal["rating"]
    ratings: Annotated[list[ScaleSpec], Field(min_length=1, max_length=12)]
    stimuli: Some = "all"
    repeats: PositiveInt = 1
    break_every: PositiveInt | None = None
    fixation_s: ShortSeconds = 0.0
    exposure_s: Seconds | None = None
    blank_s: ShortSeconds = 0.0

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

    def places_px(self, setting: Setting) -> tuple[Offset, ...]:
        """Return where the pictures stand."""
        return setting.single_layout().places_px
