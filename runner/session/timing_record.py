"""How evenly frames come: black frames are timed, for a session's record and for the doctor."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analysis.records import SurfaceFacts
from devices.display import Verification
from runner.presenter.counters import IntervalSummary
from runner.presenter.surfaces.screens import compositor
from runner.scene import Scene

if TYPE_CHECKING:
    from runner.presenter.presenter import Presenter

NOT_VERIFIED = "not verified with a photodiode"
# The first swaps fill the driver's queue and come faster than the screen shows them.
_SETTLING_SWAPS = 10


def swap_intervals(
    frame: Callable[[], object],
    seconds: float,
    progress: Callable[[float], None] = lambda done_s: None,
    refresh_hz: float | None = None,
) -> IntervalSummary:
    """Call ``frame``, which draws and swaps, for ``seconds`` and return the intervals between the swaps.

    ``refresh_hz`` is the rate that the monitor reports.
    """
    for _ in range(_SETTLING_SWAPS):
        frame()
    times = [time.monotonic()]
    while times[-1] - times[0] < seconds or len(times) < 3:
        frame()
        times.append(time.monotonic())
        progress(times[-1] - times[0])
    return IntervalSummary.of([1000.0 * (after - before) for before, after in pairwise(times)], refresh_hz)


@dataclass(frozen=True, slots=True)
class Judgement:
    """Whether a photodiode's verification holds here: the ``words`` of a record, and what is to be remarked."""

    words: str
    remarks: tuple[str, ...] = ()


def judge(verification: Verification | None, mode: str, surface: SurfaceFacts, rate_hz: float | None) -> Judgement:
    """Say whether onsets in ``mode`` on a surface that swaps ``rate_hz`` times a second are verified.

    ``rate_hz`` is None on a surface without a screen, where no record holds.
    """
    if verification is None:
        return Judgement(NOT_VERIFIED)
    differs = verification.mismatches(
        mode=mode, refresh_hz=rate_hz, display_server=surface.display_server, renderer=surface.renderer
    )
    if rate_hz is None:
        differs += ("there is no screen here",)
    if not differs:
        return Judgement(verification.sentence())
    name = Path(verification.file).name
    return Judgement(
        NOT_VERIFIED, (f"onsets are {NOT_VERIFIED}: the record {name} does not hold here ({'; '.join(differs)})",)
    )


def timing_facts(
    presenter: Presenter, seconds: float, verification: Verification | None = None
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return what a session's record states of timing, measured on black frames, and what to remark on it.

    ``verification`` is the rig's: its contents are in the facts, and whether they hold in this session. On a surface
    without a screen there is nothing to measure.
    """
    surface = presenter.surface.facts
    facts: dict[str, Any] = {"compositor": compositor()}
    rate_hz = None
    if surface.vsync:
        presenter.show(Scene())
        summary = swap_intervals(presenter.redraw, seconds, refresh_hz=surface.refresh_hz)
        rate_hz = swaps_per_second(summary)
        facts["swap_intervals"] = asdict(summary)
    judgement = judge(verification, presenter.mode.name, surface, rate_hz)
    facts["verification"] = judgement.words
    if verification is not None:
        facts["verification_record"] = verification.to_json()
    return facts, judgement.remarks


def swaps_per_second(summary: IntervalSummary) -> float:
    """Return the rate of the median interval."""
    return 1000.0 / summary.median_ms if summary.median_ms > 0 else float("inf")


def explain(summary: IntervalSummary, vsync_asked: bool, judgement: Judgement | None = None) -> list[str]:
    """Return what the intervals mean, in plain sentences, and whether a photodiode has seen onsets like these."""
    rate_hz = swaps_per_second(summary)
    sentences = [
        f"{summary.frames} intervals: median {summary.median_ms:.2f} ms ({rate_hz:.1f} frames per second), "
        f"99th percentile {summary.p99_ms:.2f} ms, longest {summary.longest_ms:.2f} ms.",
    ]
    if summary.missed is None:
        sentences.append("Late frames cannot be counted: without a screen to wait for, no frame is ever due.")
    else:
        refreshes = summary.frames + summary.missed
        sentences.append(
            f"{summary.late} of {summary.frames} frames came late, by a refresh or more; {summary.missed} of "
            f"{refreshes} refreshes showed the frame before them again."
        )
    if vsync_asked and summary.missed is None:
        sentences.append(
            "Swaps do not wait for the screen: there is no vertical synchronisation here (a virtual screen, or a "
            "driver that ignores it). Onsets are when the driver was done, not when light changed."
        )
    elif summary.missed:
        sentences.append("Close other programs, switch the compositor off or use full screen, and measure again.")
    sentences += [f"{remark[:1].upper()}{remark[1:]}." for remark in judgement.remarks] if judgement else []
    sentences.append(f"All this is the program's clock: {judgement.words if judgement else NOT_VERIFIED}.")
    if judgement is None or judgement.words == NOT_VERIFIED:
        sentences.append(
            "To verify: put 'photodiode_corner: bottom-right' in the rig's mode_options, measure when that square "
            "changes, and name the record in the rig's photodiode_verification (docs/timing.md)."
        )
    return sentences
