"""Time in a session: a clock for the record that cannot be set back, and the pace of timed scenes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from documents.platform import elapsed_s
from runner.ports import Holding
from runner.scene import Scene

if TYPE_CHECKING:
    from runner.presenter.presenter import Presenter


class SteadyClock:
    """Gives UTC to the millisecond; never runs back and never jumps, however the machine's clock is set meanwhile.

    It starts no earlier than ``not_before``, the last time that a session's log states: ``behind_s`` is how far the
    machine's clock stood before that.
    """

    def __init__(
        self,
        wall: Callable[[], datetime] = lambda: datetime.now(UTC),
        elapsed: Callable[[], float] = elapsed_s,
        not_before: datetime | None = None,
    ) -> None:
        now = wall()
        self._began = max(now, not_before or now)
        self.behind_s = round((self._began - now).total_seconds(), 3)
        self._elapsed = elapsed
        self._began_s = elapsed()

    def __call__(self) -> str:
        """Return the time now, such as ``2026-01-31T12:00:00.250+00:00``."""
        return self._now().isoformat(timespec="milliseconds")

    def since(self, start: datetime) -> float:
        """Return the seconds from ``start`` until now, to the microsecond."""
        return (self._now() - start).total_seconds()

    def _now(self) -> datetime:
        return self._began + timedelta(seconds=self._elapsed() - self._began_s)


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


class PacedPresenter:
    """Shows scenes on ``presenter``, timed ones at ``pace``.

    Work beside the session is to ``pause`` before a timed scene, and may ``resume`` after another. ``on_onset`` is
    called with each scene's onset right after the swap, before anything else is done.
    """

    def __init__(
        self,
        presenter: Presenter,
        pace: Pace,
        pause: Callable[[], object] = lambda: None,
        resume: Callable[[], object] = lambda: None,
        on_onset: Callable[[float], object] = lambda onset_s: None,
    ) -> None:
        self._presenter = presenter
        self._pace = pace
        self._pause, self._resume = pause, resume
        self._on_onset = on_onset

    def show(self, scene: Scene) -> float:
        """Show ``scene`` and return its onset."""
        onset_s = self._presenter.show(scene)
        self._on_onset(onset_s)
        self._resume()
        return onset_s

    def prefetch(self, scene: Scene) -> None:
        """Make ready what ``scene`` will need."""
        self._presenter.prefetch(scene)

    def hold(self, scene: Scene, seconds: float) -> Holding:
        """Show ``scene`` for the whole frames nearest to ``seconds``: drawn once, slept through, keys dropped."""
        self._pause()
        frames = self._pace.frames(seconds)
        onset_s = self._presenter.show(scene)
        self._on_onset(onset_s)
        self._pace.wait(onset_s, frames, each_frame=self._presenter.surface.on_frame)
        self._presenter.surface.poll_keys()
        return Holding(onset_s, frames, self._pace.period_s)
