"""When frames were shown."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

KEPT = 4096


@dataclass(frozen=True, slots=True)
class IntervalSummary:
    """Intervals between frames, in milliseconds; ``frames`` of them counted."""

    frames: int
    median_ms: float
    shortest_ms: float
    longest_ms: float


class SwapLog:
    """The times of the last few thousand swaps, in seconds of ``time.monotonic``."""

    def __init__(self, kept: int = KEPT) -> None:
        self._times_s: deque[float] = deque(maxlen=kept)

    def add(self, time_s: float) -> None:
        """Note a swap."""
        self._times_s.append(time_s)

    @property
    def times_s(self) -> tuple[float, ...]:
        """The times, oldest first."""
        return tuple(self._times_s)

    def summary(self, last: int | None = None) -> IntervalSummary | None:
        """Summarise the intervals between the ``last`` swaps (all that are kept if None); None below two swaps."""
        times = self.times_s[-last:] if last else self.times_s
        intervals = [1000.0 * (after - before) for before, after in pairwise(times)]
        if not intervals:
            return None
        return IntervalSummary(len(intervals), median(intervals), min(intervals), max(intervals))
