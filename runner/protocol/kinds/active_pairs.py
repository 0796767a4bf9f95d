"""`kind: active_pairs`: of many stimuli, the pairs that promise to tell the most."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, PositiveInt, model_validator

from runner.blocks.active_pairs import ActivePairs
from runner.blocks.pair_choice import Gain
from runner.blocks.ties import Ties
from runner.presenter.scene import Offset
from runner.protocol.kinds.block_spec import BlockSpec, Fault, Some, chosen, name_faults
from runner.protocol.parts import Seconds, ShortSeconds
from runner.protocol.setting import Setting, Stimuli


class ActivePairsSpec(BlockSpec):
    """Pairs of many stimuli, each batch of them chosen by the answers so far.

    How many is said by ``trials`` or by ``trials_per_stimulus``. A ``batch`` holds each stimulus once at most; left
    out, it is as large as that allows. ``gain`` is what pairs are chosen by: how far an answer is expected to bring
    down the ``variance`` of the scores, or the ``entropy`` of what is known of the pair. Times are in seconds.
    """

    kind: Literal["active_pairs"]
    stimuli: Some = "all"
    trials: Annotated[int, Field(ge=1, le=100_000)] | None = None
    trials_per_stimulus: Annotated[int, Field(ge=2, le=10_000)] | None = None
    batch: PositiveInt | None = None
    gain: Gain = "variance"
    break_every: PositiveInt | None = None
    fixation_s: ShortSeconds = 0.0
    exposure_s: Seconds | None = None
    blank_s: ShortSeconds = 0.0
    ties: Ties = "none"

    @model_validator(mode="after")
    def _how_many(self) -> ActivePairsSpec:
        if (self.trials is None) == (self.trials_per_stimulus is None):
            raise ValueError("'active_pairs' needs either 'trials' or 'trials_per_stimulus'")
        return self

    def make(self, setting: Setting) -> ActivePairs:
        """Return the block as this observer begins it."""
        names = chosen(self.stimuli, setting.stimuli)
        return ActivePairs(
            names,
            setting.question,
            setting.pair_layout(),
            setting.own_seed,
            self._trials(len(names)),
            self._batch(len(names)),
            gain=self.gain,
            break_every=self.break_every,
            fixation_s=self.fixation_s,
            exposure_s=self.exposure_s,
            blank_s=self.blank_s,
            style=setting.style,
            reference=setting.reference,
            ties=self.ties,
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli, too few of them, or too few trials to link them all."""
        yield from name_faults(self.stimuli, stimuli, "stimuli", at_least=2)
        count = len(chosen(self.stimuli, stimuli))
        if self._trials(count) < count - 1:
            what = f"{self.trials} trials cannot link {count} stimuli"
            yield Fault(what, ("trials",), f"ask for {count - 1} or more, better ten for each stimulus")
        if self.batch is not None and self.batch > max(1, count // 2):
            what = f"a batch of {self.batch} pairs cannot hold each of {count} stimuli once at most"
            yield Fault(what, ("batch",), f"make it {max(1, count // 2)} or less, or leave it out")

    def places_px(self, setting: Setting) -> tuple[Offset, ...]:
        """Return where the pictures stand."""
        return setting.pair_layout().places_px

    def _trials(self, count: int) -> int:
        return self.trials or -(-count * (self.trials_per_stimulus or 0) // 2)

    def _batch(self, count: int) -> int:
        return self.batch or max(1, count // 2)
