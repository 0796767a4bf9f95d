"""How evenly frames come: black frames are timed, for a session's record and for the doctor."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict
from itertools import pairwise
from typing import Any

from runner.presenter.compositor import compositor
from runner.presenter.presenter import Presenter
from runner.presenter.scene import Scene
from runner.presenter.timing import IntervalSummary

NOT_VERIFIED = "not verified with a photodiode"
# The first swaps fill the driver's queue and come faster than the screen shows them.
_SETTLING_SWAPS = 10


def swap_intervals(
    frame: Callable[[], object], seconds: float, progress: Callable[[float], None] = lambda done_s: None
) -> IntervalSummary:
    """Call ``frame``, which draws and swaps, for ``seconds`` and return the intervals between the swaps."""
    for _ in range(_SETTLING_SWAPS):
        frame()
    times = [time.monotonic()]
    while times[-1] - times[0] < seconds or len(times) < 3:
        frame()
        times.append(time.monotonic())
        progress(times[-1] - times[0])
    return IntervalSummary.of([1000.0 * (after - before) for before, after in pairwise(times)])


def timing_facts(presenter: Presenter, seconds: float, verification: str = "") -> dict[str, Any]:
    """Return what a session's record says of timing, measured on black frames; ``verification`` is the rig's.

    On a surface without a screen there is nothing to measure.
    """
    facts: dict[str, Any] = {"compositor": compositor(), "verification": verification or NOT_VERIFIED}
    if presenter.surface.facts.vsync:
        presenter.show(Scene())
        facts["swap_intervals"] = asdict(swap_intervals(presenter.redraw, seconds))
    return facts


def explain(summary: IntervalSummary, vsync_asked: bool) -> list[str]:
    """Return what the intervals mean, in plain sentences."""
    rate_hz = 1000.0 / summary.median_ms if summary.median_ms > 0 else float("inf")
    told = [
        f"{summary.frames} intervals: median {summary.median_ms:.2f} ms ({rate_hz:.1f} frames per second), "
        f"99th percentile {summary.p99_ms:.2f} ms, longest {summary.longest_ms:.2f} ms.",
        f"{summary.missed} frames came late (an interval of 1.5 medians or more).",
    ]
    if vsync_asked and rate_hz > 500:
        told.append(
            "Swaps do not wait for the screen: there is no vertical synchronisation here (a virtual screen, or a "
            "driver that ignores it). Onsets are when the driver was done, not when light changed."
        )
    elif summary.missed:
        told.append("Close other programs, switch the compositor off or use full screen, and measure again.")
    told.append(f"All this is the program's clock: {NOT_VERIFIED}.")
    return told
