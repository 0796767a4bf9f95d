"""Showing patches to somebody else's instrument: by keys, or each for so long."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from devices.patches import Arrangement, PatchEye, Step
from runner.measuring.keys import Keys
from runner.measuring.patch_screen import PatchScreen

_BACK = ("left", "page_up", "backspace")
_ON = ("right", "enter", "page_down")


@dataclass(frozen=True, slots=True)
class Shown:
    """The patch that was just shown: the ``number`` of ``of``, and how long the rest takes."""

    step: Step
    number: int
    of: int
    left_s: float
    highest: int


def show_patches(
    screen: PatchScreen,
    order: Sequence[Step],
    eye: PatchEye,
    hold_s: float | None,
    tell: Callable[[str], None],
    on_shown: Callable[[Shown], None],
) -> dict[int, float]:
    """Show ``order`` and return when each was last shown, in seconds from the first, by position.

    Each stands for ``hold_s`` seconds, or until a key if that is None. What a person must move before it is told, and
    with keys stands on the screen until one is pressed.
    """
    keys = Keys(screen, tell)
    times_s: dict[int, float] = {}
    begun_s = time.monotonic()
    index = 0
    stands = Arrangement(eye)
    while index < len(order) and not keys.stops:
        step = order[index]
        screen.show_patch(step.patch, eye)
        wanted = step.patch.arrangement(eye)
        if request := wanted.request(stands):
            if hold_s is not None:
                tell(request)
            elif not keys.ask(request):
                break
        stands = wanted
        times_s[step.position] = round(time.monotonic() - begun_s, 3)
        left_s = sum(max(hold_s or 0.0, later.patch.wait_s) for later in order[index:])
        on_shown(Shown(step, index + 1, len(order), left_s, screen.highest))
        wait_s = order[index + 1].patch.wait_s if index + 1 < len(order) else 0.0
        index = max(0, index + _held(keys, None if hold_s is None else max(hold_s, wait_s)))
    return times_s


def patch_table(
    order: Sequence[Step], eye: str, mode: str, bits: int, times_s: Mapping[int, float] | None = None
) -> str:
    """Return what was shown as CSV whose X, Y and Z are to be filled in; all of ``order`` without ``times_s``."""
    highest = (1 << bits) - 1
    out = io.StringIO()
    out.write(f"# codes: 0..{highest}\n# mode: {mode}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(
        ["name", "red", "green", "blue", "X", "Y", "Z", *(["time_s"] if times_s is not None else []), "eye"]
    )
    for step in order:
        if times_s is None or step.position in times_s:
            codes = [round(code * highest) for code in step.patch.codes]
            time_s = [times_s[step.position]] if times_s is not None else []
            writer.writerow([step.patch.name, *codes, "", "", "", *time_s, step.patch.eye or eye])
    return out.getvalue()


def _held(keys: Keys, hold_s: float | None) -> int:
    """Keep the screen until it is time, or a key says so; return how many patches to go on by."""
    held_s, last_s = 0.0, time.monotonic()
    while not keys.stops and (hold_s is None or held_s < hold_s):
        key = keys.poll()
        now_s = time.monotonic()
        held_s += 0.0 if keys.paused else now_s - last_s
        last_s = now_s
        if key in _ON:
            return 1
        if key in _BACK:
            return -1
    return 1
