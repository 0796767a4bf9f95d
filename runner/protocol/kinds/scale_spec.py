"""A rating scale, as any kind of block may have some."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated

from pydantic import Field, model_validator

from runner.blocks.scale import Scale
from runner.protocol.kinds.block_spec import Fault
from runner.protocol.parts import Label, Line, Strict

WIDEST = 100
Anchor = Annotated[str, Field(max_length=60)]


class ScaleSpec(Strict):
    """A scale of whole numbers, ``lowest`` to ``highest``; more than 11 make a slider.

    ``name`` is what the record calls it. The anchors stand at the ends and in the middle. Without ``confirm`` a number
    key or a click is the answer at once, except on a slider.
    """

    name: Label
    question: Line
    lowest: Annotated[int, Field(ge=-WIDEST, le=WIDEST)] = 1
    highest: Annotated[int, Field(ge=-WIDEST, le=WIDEST)] = 10
    low_anchor: Anchor = ""
    middle_anchor: Anchor = ""
    high_anchor: Anchor = ""
    confirm: bool = True

    @model_validator(mode="after")
    def _rises(self) -> ScaleSpec:
        if not 1 <= self.highest - self.lowest <= WIDEST:
            raise ValueError(f"'highest' must be above 'lowest', by {WIDEST} at most")
        return self

    def make(self) -> Scale:
        """Return the scale."""
        return Scale(**self.model_dump())


def scale_faults(scales: Sequence[ScaleSpec], *path: str | int) -> Iterator[Fault]:
    """Yield the faults of a list of scales: names that stand twice."""
    names = [scale.name for scale in scales]
    for index, name in enumerate(names):
        if name in names[:index]:
            yield Fault(f"two scales are called '{name}'", (*path, index, "name"), "give each a name of its own")
