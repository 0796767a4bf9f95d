"""Records of pages of words: `instructions`, `break`."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.kinds.trial import Session, Trial


class PageRecord(Trial):
    """A page of words was read."""

    answers_task = False

    def pressed_otherwise(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the time with the press that ended it."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self.timed_by_press(last=True)
