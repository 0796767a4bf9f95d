"""`kind: all_pairs`: every two stimuli together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import PositiveInt

from runner.blocks.all_pairs import AllPairs
from runner.presenter.scene import Offset
from runner.protocol.kinds.block_spec import BlockSpec, Fault, Some, chosen, name_faults
from runner.protocol.parts import Seconds, ShortSeconds
from runner.protocol.setting import Setting, Stimuli


class AllPairsSpec(BlockSpec):
    """Every two of the stimuli together, one answer each.

    Times are in seconds, to the nearest frame: a fixation cross before each pair, a limited exposure of the pair (it
    stays until answered if left out), black between trials.
    """

    kind: Literal["all_pairs"]
    stimuli: Some = "all"
    sides: Literal["counterbalanced"] = "counterbalanced"
    repeats: PositiveInt = 1
    break_every: PositiveInt | None = None
    fixation_s: ShortSeconds = 0.0
    exposure_s: Seconds | None = None
    blank_s: ShortSeconds = 0.0

    def make(self, setting: Setting) -> AllPairs:
        """Return the block in the observer's own order."""
        return AllPairs(
            chosen(self.stimuli, setting.stimuli),
            setting.question,
            setting.pair_layout(),
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
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli, or too few."""
        yield from name_faults(self.stimuli, stimuli, "stimuli", at_least=2)

    def places_px(self, setting: Setting) -> tuple[Offset, ...]:
        """Return where the pictures stand."""
        return setting.pair_layout().places_px
