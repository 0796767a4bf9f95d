"""Records of `best_of_series`: a picture chosen from a series, and how the series was gone through."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, ClassVar

from pydantic import Field, Strict

from analysis.kinds.fields import Count, Name, Seconds
from analysis.kinds.rating import RatedRecord
from analysis.kinds.trial import ROUNDING_S, TIMES, SoFar, is_near

Visit = Annotated[tuple[Count, Seconds], Strict(False)]
_LEAF = {
    **dict.fromkeys(("left", "wheel_up", "pad_left"), "previous"),
    **dict.fromkeys(("right", "wheel_down", "pad_right"), "next"),
    **dict.fromkeys(("enter", "space", "pad_a"), "choose"),
}


class BestOfSeriesRecord(RatedRecord):
    """A picture chosen from a series, and how the series was gone through."""

    heading = "Best of series"
    description = "a series to browse, one stimulus chosen"
    did = "chose one picture from each series"
    counted_as = ("choice", "choices")
    report_part = "series"
    not_reported: ClassVar[Mapping[str, str]] = {
        "rating_times_s": TIMES,
        "start": "the picture that was shown first",
    }

    no_stimulus: ClassVar[tuple[str, ...]] = ("series",)
    asked: ClassVar[tuple[str, ...]] = ("series", "members", "start")

    written = ("series", "stimuli", "start", "chosen", "chosen_index", "path", "dwell_s")

    series: Name
    members: list[Name] = Field(alias="stimuli", min_length=2)
    start: Count
    """The number of the picture that was shown first, from 0."""
    chosen: Name
    chosen_index: Count
    path: list[Visit] = Field(min_length=1)
    """Each picture that was shown, by its number, and for how many seconds."""
    dwell_s: list[Seconds]
    """How long each picture was shown, in s."""

    @property
    def said(self) -> str:
        """What was answered."""
        return self.chosen

    @property
    def stimuli(self) -> tuple[str, ...]:
        """Those of the series."""
        return tuple(self.members)

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the choice with the path, and the times with those on the path."""
        yield from super().contradictions(session, practised=practised)
        count = len(self.members)
        places = [index for index, _ in self.path]
        if len(set(self.members)) < count:
            yield "the series shows a picture twice"
        elif max(places) >= count or places[0] != self.start or places[-1] != self.chosen_index:
            yield f"the path does not lead from picture {self.start} to picture {self.chosen_index} of {count}"
        elif self.members[self.chosen_index] != self.chosen:
            yield f"'{self.chosen}' is chosen, but picture {self.chosen_index} is '{self.members[self.chosen_index]}'"
        elif len(self.dwell_s) != count or not self._dwelt():
            yield "'dwell_s' is not how long each picture of the path was shown"
        elif abs(self.response_time_s - sum([s for _, s in self.path])) > ROUNDING_S * (1 + len(self.path)):
            yield f"the response time is {self.response_time_s:g} s, which is not that of its path"

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the path with the presses."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self._pressed(session)

    def _dwelt(self) -> bool:
        sums = [0.0] * len(self.members)
        for index, seconds in self.path:
            sums[index] += seconds
        near = ROUNDING_S * (1 + len(self.path))
        return all(abs(total - stated) <= near for total, stated in zip(sums, self.dwell_s, strict=True))

    def _pressed(self, session: SoFar) -> Iterator[str]:
        """Yield what is wrong if no run of presses has the times of the path and leads along it.

        Presses of a page before, or of a rating after, may have the same times.
        """
        times = [seconds for _, seconds in self.path]
        wrong: list[str] = []
        for begin in range(len(self.events) - len(times) + 1):
            events = self.events[begin : begin + len(times)]
            if all(is_near(seconds, (time_s,)) for (_, seconds), time_s in zip(events, times, strict=True)):
                faults = list(self._led([key for key, _ in events], own_keys=session.own_keys))
                if not faults:
                    return
                wrong = wrong or faults
        yield from wrong or ["the times of its path are not those of its presses"]

    def _led(self, keys: Sequence[str], *, own_keys: bool) -> Iterator[str]:
        """Yield what is wrong if ``keys`` were pressed along the path; older logs have presses that moved nothing."""
        count = len(self.members)
        places = [index for index, _ in self.path]
        for place, key, after in zip(places, keys, [*places[1:], None], strict=True):
            moves = {"next": (place + 1) % count, "previous": (place - 1) % count}
            possible = ["choose"] if after is None else [way for way, index in moves.items() if index == after]
            if not possible and after != place:
                yield f"picture {after} does not follow picture {place}"
                return
            # One key may mean next and choose, where they are never possible at once.
            known = key.removeprefix("click ") if key.startswith("click ") else None if own_keys else _LEAF.get(key)
            # Of two pictures in a ring, each follows the other both ways.
            if known is not None and len(possible) == 1 and known != possible[0]:
                yield f"the answer is '{possible[0]}', but the key '{key}' means '{known}'"
