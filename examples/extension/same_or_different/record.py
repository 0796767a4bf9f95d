"""What a trial of `same_or_different` records, and what the report says of all of them."""

from __future__ import annotations

from typing import ClassVar, Literal

from analysis.kinds import Name, Trial


class SameOrDifferentRecord(Trial):
    """Two pictures, and whether they were called the same."""

    heading = "Same or different"
    description = "two pictures one after the other, called the same or different"
    did = "told whether two pictures were the same"
    counted_as = ("same-or-different trial", "same-or-different trials")
    report_part = "same_or_different"
    asked: ClassVar[tuple[str, ...]] = ("first", "second")

    first: Name
    second: Name
    answer: Literal["same", "different"]

    @property
    def stimuli(self) -> tuple[str, ...]:
        """The two that were shown."""
        return (self.first, self.second)
