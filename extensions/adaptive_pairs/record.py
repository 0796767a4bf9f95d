"""Records of `active_pairs`: two stimuli compared, which the answers so far chose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from analysis.kinds import Count, PairRecord, SoFar


class ActivePairsRecord(PairRecord):
    """A pair of `active_pairs`, in its batch."""

    heading = "Paired comparisons"
    description = "two stimuli, one chosen; the next pair is the most informative"
    did = "compared pairs of {stimuli} stimuli that were chosen by {answers}"
    by_answers = True
    not_reported: ClassVar[Mapping[str, str]] = {
        "batch": "which pairs were chosen together",
        "group_factor": "as of all_pairs",
    }

    written = ("first", "second", "answer", "chosen", "rejected", "batch")

    batch: Count
    """The number of the batch that chose it, from 0."""

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the batch with the one before."""
        yield from super().contradictions(session, practised=practised)
        if self.attempt == 0:
            before = session.seen.get(("batch", self.block), 0)
            if self.batch not in (before, before + 1):
                yield f"batch {self.batch} follows batch {before}"
            session.seen["batch", self.block] = self.batch
