"""`kind: all_pairs`: every two stimuli together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, PositiveInt, model_validator

from runner.blocks.all_pairs import AllPairs
from runner.blocks.layouts import PairLayout, SingleLayout
from runner.blocks.pair_ratings import PairRating, PairRatings
from runner.blocks.scale import Scale
from runner.blocks.ties import Ties
from runner.presenter.scene import Offset
from runner.protocol.kinds.block_spec import BlockSpec, Fault, Some, chosen, name_faults
from runner.protocol.kinds.catch_spec import CatchSpec
from runner.protocol.kinds.scale_spec import ScaleSpec, scale_faults
from runner.protocol.parts import Seconds, ShortSeconds
from runner.protocol.setting import Setting, Stimuli

BLANK_BETWEEN_S = 0.5


class PairRatingSpec(ScaleSpec):
    """A scale that follows each choice: about the stimulus chosen, or about both."""

    of: Literal["chosen", "both"] = "chosen"

    def make(self) -> Scale:
        """Return the scale."""
        return Scale(**self.model_dump(exclude={"of"}))


class AllPairsSpec(BlockSpec):
    """Every two of the stimuli together, one answer each.

    Times are in seconds, to the nearest frame: a fixation cross before each pair, a limited exposure of the pair (it
    stays until answered if left out), black between trials. In a ``sequence``, ``exposure_s`` is each interval's and
    ``blank_between_s`` lies between the two. ``ties`` are answers that prefer neither, ``ratings`` scales that follow
    each choice.
    """

    kind: Literal["all_pairs"]
    stimuli: Some = "all"
    presentation: Literal["simultaneous", "sequence"] = "simultaneous"
    sides: Literal["counterbalanced"] = "counterbalanced"
    repeats: PositiveInt = 1
    break_every: PositiveInt | None = None
    fixation_s: ShortSeconds = 0.0
    exposure_s: Seconds | None = None
    blank_between_s: ShortSeconds | None = None
    blank_s: ShortSeconds = 0.0
    ties: Ties = "none"
    catch: CatchSpec | None = None
    ratings: Annotated[tuple[PairRatingSpec, ...], Field(max_length=10)] = ()

    @model_validator(mode="after")
    def _intervals(self) -> AllPairsSpec:
        if self.presentation == "sequence" and self.exposure_s is None:
            raise ValueError("'presentation: sequence' needs 'exposure_s', the time of each interval")
        if self.presentation == "simultaneous" and self.blank_between_s is not None:
            raise ValueError("'blank_between_s' belongs to 'presentation: sequence'; 'blank_s' lies between trials")
        return self

    def make(self, setting: Setting) -> AllPairs:
        """Return the block in the observer's own order."""
        between_s = BLANK_BETWEEN_S if self.blank_between_s is None else self.blank_between_s
        return AllPairs(
            chosen(self.stimuli, setting.stimuli),
            setting.question,
            self._layout(setting),
            setting.pair_seed,
            order_seed=setting.own_seed,
            flip_sides=setting.is_second_of_pair,
            repeats=self.repeats,
            break_every=self.break_every,
            fixation_s=self.fixation_s,
            exposure_s=self.exposure_s,
            blank_s=self.blank_s,
            style=setting.style,
            reference=setting.reference,
            blank_between_s=between_s if self.presentation == "sequence" else 0.0,
            ties=self.ties,
            catch=self.catch.make(self._pairs(setting.stimuli)) if self.catch else None,
            ratings=self._ratings(setting),
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli, or too few, and what is wrong with catch trials and ratings."""
        wrong = list(name_faults(self.stimuli, stimuli, "stimuli", at_least=2))
        yield from wrong
        if self.catch and not wrong:
            yield from self.catch.faults(stimuli, self._pairs(stimuli))
        yield from scale_faults(self.ratings, "ratings")

    def places_px(self, setting: Setting) -> tuple[Offset, ...]:
        """Return where the pictures stand."""
        places = self._layout(setting).places_px
        return (*places, *setting.single_layout().places_px) if self.ratings else places

    def _layout(self, setting: Setting) -> PairLayout | SingleLayout:
        return setting.single_layout() if self.presentation == "sequence" else setting.pair_layout()

    def _pairs(self, stimuli: Stimuli) -> int:
        count = len(chosen(self.stimuli, stimuli))
        return count * (count - 1) // 2 * self.repeats

    def _ratings(self, setting: Setting) -> PairRatings | None:
        if not self.ratings:
            return None
        scales = tuple(PairRating(rating.make(), rating.of) for rating in self.ratings)
        return PairRatings(scales, setting.single_layout(), setting.style, setting.reference)
