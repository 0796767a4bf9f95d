"""Two stimuli shown before the question: at once, or one after the other, for a time or until the observer goes on."""

from __future__ import annotations

from collections.abc import Generator

from runner.blocks.message import CONTINUE_KEYS
from runner.blocks.pair_views import SequenceView, SimultaneousView
from runner.blocks.steps import Hold, Response, answer
from runner.ports import Ask, Target
from runner.presenter.scene import Scene

SEQUENCE_WORDS = "You will see two pictures, one after the other.\nThen comes the question."
_OWN_PACE_HINT = "Press the space bar to go on"

Showing = Generator[Ask | Hold, Response | None, list[float]]


def present(
    view: SimultaneousView | SequenceView, first: str, second: str, exposure_s: float | None, blank_between_s: float
) -> Generator[Ask | Hold, Response | None, tuple[Scene, list[float]]]:
    """Show both as far as they come before the question; to be used with ``yield from``.

    Returned are the scene to ask with, and the times in s that the observer stayed on each interval; none where time
    was not theirs: timed scenes are recorded as such.
    """
    if isinstance(view, SequenceView):
        dwell_s = yield from _intervals(view, first, second, exposure_s, blank_between_s)
        return view.question(), dwell_s
    scene = view.pair(first, second)
    if exposure_s is None:
        return scene, []
    yield Hold("pair", scene, exposure_s)
    return view.question(), []


def _intervals(
    view: SequenceView, first: str, second: str, exposure_s: float | None, blank_between_s: float
) -> Showing:
    dwell_s: list[float] = []
    for number, stimulus in enumerate((first, second)):
        if number and blank_between_s:
            yield Hold("between", view.between(), blank_between_s)
        if exposure_s is not None:
            yield Hold(view.position_names[number], view.interval(number, stimulus), exposure_s)
            continue
        scene = view.interval(number, stimulus, hint=_OWN_PACE_HINT)
        upcoming = view.interval(1, second, hint=_OWN_PACE_HINT) if number == 0 else None
        picture = Target(view.layout.picture_px, view.layout.aperture_px)
        response = answer((yield Ask(scene, CONTINUE_KEYS, upcoming, targets={"continue": picture})))
        dwell_s.append(response.time_s)
    return dwell_s
