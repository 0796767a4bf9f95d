"""Records of pages of words: `instructions`, `break`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from analysis.kinds.trial import SoFar, Trial


class PageRecord(Trial):
    """A page of words was read."""

    description = "a page of instructions"
    not_reported: ClassVar[Mapping[str, str]] = {"response_time_s": "how long the page stood"}

    answers_task = False
    is_page = True

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the time with the press that ended it."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self.timed_by_press(last=True)


class BreakRecord(PageRecord):
    """A break was ended."""

    description = "a break, ended by the observer"
    counted_as = ("break", "breaks")
