"""What the presenter did: its work, counted (counts are exact where clocks are noisy), and when frames were shown."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from statistics import median


@dataclass(frozen=True, slots=True)
class Counters:
    """Work done since the presenter was made.

    ``frames_drawn`` counts scenes put on the screen, ``frames_redrawn`` the same scene drawn again because the window
    system had lost it, and ``scenes_skipped`` scenes equal to what was already shown. Where the eyes are shown in turn,
    ``frames_alternated`` counts the same scene drawn for the next eye, and ``frames_missed`` the refreshes that no new
    frame was ready for. ``pointers_drawn`` counts the same scene drawn because a mouse was moved. ``uploads``,
    ``bytes_uploaded``, ``colour_passes`` and ``pixels_shaded`` are about pictures; ``decodes`` are calls for a
    picture's data; ``texts_rasterised`` and ``evictions`` are what their names say.
    """

    frames_drawn: int = 0
    frames_redrawn: int = 0
    scenes_skipped: int = 0
    frames_alternated: int = 0
    frames_missed: int = 0
    pointers_drawn: int = 0
    decodes: int = 0
    uploads: int = 0
    bytes_uploaded: int = 0
    colour_passes: int = 0
    pixels_shaded: int = 0
    texts_rasterised: int = 0
    evictions: int = 0


class Work:
    """The running count that the presenter and its caches share."""

    def __init__(self) -> None:
        self._totals = {field.name: 0 for field in fields(Counters)}

    @property
    def counters(self) -> Counters:
        """The work done so far."""
        return Counters(**self._totals)

    def add(self, **increments: int) -> None:
        """Add ``increments`` to the counters of those names."""
        for name, amount in increments.items():
            self._totals[name] += amount

    def total(self, name: str) -> int:
        """Return one counter, as often as a frame is drawn."""
        return self._totals[name]


KEPT = 4096


# An interval this many periods long holds a refresh that showed the frame before it again.
_MISSED_FROM = 1.5
# No monitor that we know of refreshes as often as this: where none reports a rate, such swaps wait for none.
_NO_SCREEN_MS = 2.0
# Rates are reported as whole numbers: 59.94 Hz as 60 or 59.
_REPORTED_WITHIN = 0.05
# How far swaps that wait for a screen may be from a whole number of its refreshes, in refreshes, half of them.
_STEADY_WITHIN = 0.1


def refresh_period_ms(intervals_ms: Sequence[float], refresh_hz: float | None) -> float | None:
    """Return the period of the refresh that swaps wait for; None if they wait for none.

    It is the median interval, or a whole part of it where the monitor reports a faster rate, ``refresh_hz``. Swaps that
    wait for a screen come a whole number of periods apart; those that do not come when the drawing is done.
    """
    period_ms = median(intervals_ms)
    if refresh_hz:
        period_ms /= max(1, round(period_ms * refresh_hz / 1000.0))
        if abs(period_ms * refresh_hz / 1000.0 - 1.0) > _REPORTED_WITHIN:
            return None
    elif period_ms < _NO_SCREEN_MS:
        return None
    periods = [interval / period_ms for interval in intervals_ms]
    off = median(abs(each - max(1, round(each))) for each in periods)
    return period_ms if off <= _STEADY_WITHIN else None


@dataclass(frozen=True, slots=True)
class IntervalSummary:
    """Intervals between swaps, in milliseconds; ``frames`` of them counted.

    A frame is late if it came a refresh or more after it was due: an interval of 1.5 refreshes or more. ``late`` counts
    such frames, ``missed`` the refreshes that passed without a new frame: k - 1 in an interval of about k refreshes. Of
    ``frames + missed`` refreshes, ``missed`` showed the frame before them again. Both are None where swaps do not wait
    for the screen, so that no frame is ever due.
    """

    frames: int
    median_ms: float
    p99_ms: float
    shortest_ms: float
    longest_ms: float
    missed: int | None
    late: int | None = None

    @classmethod
    def of(cls, intervals_ms: Sequence[float], refresh_hz: float | None = None) -> IntervalSummary:
        """Summarise at least one interval, on a screen that reports ``refresh_hz``."""
        ordered = sorted(intervals_ms)
        middle = median(ordered)
        period_ms = refresh_period_ms(ordered, refresh_hz)
        rate_hz = 1000.0 / period_ms if period_ms else None
        missed = [missed_frames(interval / 1000.0, rate_hz) for interval in ordered] if rate_hz else None
        return cls(
            frames=len(ordered),
            median_ms=middle,
            p99_ms=ordered[min(len(ordered) - 1, math.ceil(0.99 * len(ordered)) - 1)],
            shortest_ms=ordered[0],
            longest_ms=ordered[-1],
            missed=None if missed is None else sum(missed),
            late=None if missed is None else sum(map(bool, missed)),
        )


def missed_frames(interval_s: float, refresh_hz: float | None) -> int:
    """Return how many refreshes passed without a new frame between two swaps ``interval_s`` apart; 0 if unknown."""
    periods = interval_s * (refresh_hz or 0.0)
    return round(periods) - 1 if periods > _MISSED_FROM else 0


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
        return IntervalSummary.of(intervals) if intervals else None
