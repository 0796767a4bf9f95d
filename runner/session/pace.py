"""When the next scene of a timed sequence must be drawn, so that it appears on the frame that was asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pace:
    """A screen of frames of ``period_s``.

    Where swaps wait for the screen (``swaps_wait``), the next scene must be handed over within the last frame before
    its own: half a frame early is safest. Where they do not, the clock alone decides. ``instantly`` does not wait at
    all, for simulated observers.
    """

    period_s: float
    swaps_wait: bool
    instantly: bool = False

    def frames(self, seconds: float) -> int:
        """Return the whole number of frames nearest to ``seconds``, at least 1."""
        return max(1, round(seconds / self.period_s))

    def wait(
        self,
        onset_s: float,
        frames: int,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        each_frame: Callable[[], object] | None = None,
    ) -> None:
        """Sleep until the scene after one shown at ``onset_s`` for ``frames`` frames must be drawn.

        ``each_frame``, where a mode has something to draw at every refresh, is called in place of sleeping.
        """
        if self.instantly:
            return
        early = 0.5 if self.swaps_wait else 0.0
        until_s = onset_s + (frames - early) * self.period_s
        while each_frame is not None and clock() < until_s - self.period_s:
            each_frame()
            if not self.swaps_wait:
                sleep(self.period_s)
        left_s = until_s - clock()
        if left_s > 0:
            sleep(left_s)
