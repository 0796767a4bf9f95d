"""Two stimuli one after the other, for a time or until the observer goes on."""

from __future__ import annotations

from collections.abc import Generator

from runner.blocks.message import CONTINUE_KEYS
from runner.blocks.pair_views import SequenceView
from runner.blocks.steps import Hold, Response, answer
from runner.ports import Ask, Target

OWN_PACE_HINT = "Press the space bar to go on"


def intervals(
    view: SequenceView, first: str, second: str, exposure_s: float | None, blank_between_s: float
) -> Generator[Ask | Hold, Response | None, list[float]]:
    """Show both intervals and what is between; to be used with ``yield from``.

    Each stays for ``exposure_s``, or if that is None until the observer goes on; returned are the times from onset to
    press in s, none where the intervals were timed: those are recorded as timed scenes.
    """
    dwell_s: list[float] = []
    for number, stimulus in enumerate((first, second)):
        if number and blank_between_s:
            yield Hold("between", view.between(), blank_between_s)
        if exposure_s:
            yield Hold(view.position_names[number], view.interval(number, stimulus), exposure_s)
            continue
        scene = view.interval(number, stimulus, hint=OWN_PACE_HINT)
        upcoming = view.interval(1, second, hint=OWN_PACE_HINT) if number == 0 else None
        picture = Target(view.layout.picture_px, view.layout.aperture_px)
        response = answer((yield Ask(scene, CONTINUE_KEYS, upcoming, targets={"continue": picture})))
        dwell_s.append(response.time_s)
    return dwell_s
