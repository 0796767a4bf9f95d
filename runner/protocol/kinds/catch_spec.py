"""`catch:` of a block of pairs: trials that tell whether an observer attends, and which side they favour."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field, NonNegativeInt, PositiveInt, model_validator

from runner.blocks.catch_trials import CatchTrials
from runner.protocol.kinds.block_spec import Fault, name_faults
from runner.protocol.parts import Strict
from runner.protocol.setting import Stimuli

Pair = Annotated[list[str], Field(min_length=2, max_length=2)]


class CatchSpec(Strict):
    """``pairs`` of stimuli (better, worse) with an obvious answer, and how many trials show one stimulus twice.

    One catch trial comes for ``every`` so many others, or for a ``share`` of them; ``identical`` of these show a
    stimulus of the block twice, the rest go through ``pairs``. Without ``every`` and ``share``, each pair comes once.
    """

    every: PositiveInt | None = None
    share: Annotated[float, Field(gt=0, le=0.5)] | None = None
    pairs: tuple[Pair, ...] = ()
    identical: NonNegativeInt = 0

    @model_validator(mode="after")
    def _one_number(self) -> CatchSpec:
        if self.every and self.share:
            raise ValueError("give 'every' or 'share', not both")
        return self

    def count(self, trials: int) -> int:
        """Return how many catch trials there are among so many others."""
        if self.every:
            return trials // self.every
        if self.share:
            return max(1, round(self.share * trials))
        return len(self.pairs) + self.identical

    def make(self, trials: int) -> CatchTrials:
        """Return the catch trials for a block of so many others."""
        pairs = tuple((better, worse) for better, worse in self.pairs)
        return CatchTrials(self.count(trials), pairs, self.identical)

    def faults(self, stimuli: Stimuli, trials: int) -> Iterator[Fault]:
        """Yield unknown names, catch trials without anything to show, and more of them than fit."""
        for index, pair in enumerate(self.pairs):
            yield from name_faults(pair, stimuli, "catch", "pairs", index)
        if not self.pairs and not self.identical:
            yield Fault(
                "catch trials need something to show", ("catch",), "name pairs [better, worse], or give 'identical'"
            )
            return
        count = self.count(trials)
        if count == 0:
            yield Fault(
                f"{trials} trials have no catch trial every {self.every}", ("catch", "every"), f"at most {trials}"
            )
        elif count > trials:
            yield Fault(f"{count} catch trials are too many among {trials}", ("catch",), f"at most {trials}")
        elif self.identical > count:
            yield Fault(
                f"{self.identical} of {count} catch trials cannot be identical", ("catch", "identical"), "give fewer"
            )
        elif count > self.identical and not self.pairs:
            yield Fault(
                f"{count - self.identical} of {count} catch trials have no pair to show",
                ("catch",),
                "name pairs [better, worse], or leave out 'every' and 'share'",
            )
