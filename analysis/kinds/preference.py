"""Records of `preference`: the stereo and the flat version of a picture, and which was preferred."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field, Strict

from analysis.kinds.fields import Seconds
from analysis.kinds.pair import Answer, PairRecord
from analysis.kinds.trial import TIME, SoFar, is_near


class PreferenceRecord(PairRecord):
    """Both versions of a picture, and which was preferred."""

    heading = "Stereo or flat"
    description = "two intervals, one chosen"
    did = "chose between the stereo and the flat version of pictures"
    counted_as = ("preference", "preferences")
    report_part = "preferences"
    not_reported: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("answer", "chosen", "rejected"), "as chosen_view says"),
        "first_position": "where the first picture stood",
        "response_time_s": TIME,
        "interval_s": "how long each interval was looked at",
    }

    written = ("first", "second", "answer", "chosen", "rejected", "chosen_view", "first_view")

    answer: Answer
    chosen_view: Literal["stereo", "flat"]
    first_view: Literal["stereo", "flat"]
    interval_s: Annotated[tuple[Seconds, Seconds], Strict(False)] | None = Field(default=None)
    """How long each interval of a sequence stood, in s."""

    @property
    def is_scored(self) -> bool:
        """Never: it compares versions of a picture."""
        return False

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the versions with the choice."""
        yield from super().contradictions(session, practised=practised)
        if (self.chosen_view == self.first_view) != (self.answer == "first"):
            yield f"the first is {self.first_view}, the answer {self.answer} and the chosen one {self.chosen_view}"

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the times on the intervals with the presses."""
        yield from super().pressed_otherwise(session, practised=practised)
        times = [seconds for _, seconds in self.events]
        if any(not is_near(seconds, times) for seconds in self.interval_s or ()):
            yield "the observer stayed on an interval for a time that no press ended"
