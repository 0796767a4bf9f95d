"""`kind: practice`: some trials of another block, not scored."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, PositiveInt

from runner.blocks.practice import Feedback, Passing, Practice
from runner.presenter.scene import Offset
from runner.protocol.kinds.block_spec import BlockSpec, Fault
from runner.protocol.parts import Strict
from runner.protocol.setting import Setting, Stimuli

if TYPE_CHECKING:
    from runner.protocol.schema import AnyBlockSpec

NOT_PRACTISED = ("instructions", "break", "questionnaire", "practice")


class UntilSpec(Strict):
    """Enough: of the last ``of`` answers with a right and a wrong, at least the share ``correct`` was right."""

    correct: Annotated[float, Field(gt=0, le=1)]
    of: PositiveInt


class PracticeSpec(BlockSpec):
    """At most ``trials`` trials of ``block``; ``until`` may end it sooner. `schema` says what ``block`` can be."""

    kind: Literal["practice"]
    block: AnyBlockSpec
    trials: PositiveInt
    feedback: Feedback = "correctness"
    until: UntilSpec | None = None

    def make(self, setting: Setting) -> Practice:
        """Return the practice of the block as the observer of ``setting`` meets it."""
        until = Passing(self.until.correct, self.until.of) if self.until else None
        return Practice(self.block.make(setting), self.trials, self.feedback, until, setting.style)

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield a block that cannot be practised, one's own wishes that cannot be met, and the block's faults."""
        if self.block.kind in NOT_PRACTISED:
            yield Fault(f"'{self.block.kind}' has no trials to practise", ("block", "kind"), "name a scored kind")
        if getattr(self.block, "on_fail", None) == "stop":
            yield Fault("a practice cannot end the session", ("block", "on_fail"), "on_fail: continue")
        if self.until and self.until.of > self.trials:
            yield Fault(f"until looks at {self.until.of} answers, of {self.trials}", ("until", "of"), "raise trials")
        for fault in self.block.faults(stimuli):
            yield Fault(fault.message, ("block", *fault.path), fault.remedy)

    def places_px(self, setting: Setting) -> tuple[Offset, ...]:
        """Return where the block shows stimuli."""
        return self.block.places_px(setting)
