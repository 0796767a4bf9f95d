"""Where a session stands, for the experimenter: trial, block, time left, last answers, missed frames."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from analysis.kinds import Trial
from analysis.observers import FastAnswers
from analysis.records import WindowEvent
from documents.text import visible
from runner.session.events import Event, Recorded, Replayed, SessionBegan

_PACE_OF = 20  # trials
_SHOWN = 3
_LONGEST_ANSWER = 24
# The kind of a block, how many scored trials it has, and how long it is expected to take.
Planned: TypeAlias = tuple[str, int, float]
_AWAY = {"lost_focus": "the window has lost the focus", "minimised": "the window is minimised"}


def time_left(minutes: float) -> str:
    """Return how long it takes still, in words."""
    return f"about {minutes:.0f} min left" if minutes >= 1.5 else f"about {max(0, round(60 * minutes))} s left"


@dataclass(slots=True)
class SessionStatus:
    """Where a session stands, from the trials that `update` is called with; ``clock`` is monotonic, in seconds.

    A session that it listens to says what its ``blocks`` are; until then there are none. ``missed_elsewhere`` gives the
    missed frames that no trial records.
    """

    blocks: Sequence[Planned] = ()
    clock: Callable[[], float] = time.monotonic
    missed_elsewhere: Callable[[], int] = lambda: 0
    _answered: dict[int, set[int]] = field(default_factory=dict)
    _pace: deque[float] = field(default_factory=lambda: deque(maxlen=_PACE_OF))
    _last: deque[str] = field(default_factory=lambda: deque(maxlen=_SHOWN))
    _haste: FastAnswers = field(default_factory=FastAnswers)
    _window: str = ""
    _unmarked: str = ""
    _block: int = 0
    _before_s: float = field(init=False)
    _missed: int = 0

    def __post_init__(self) -> None:
        self._before_s = self.clock()

    @property
    def trials(self) -> int:
        """How many scored trials there are."""
        return sum(trials for _, trials, _ in self.blocks)

    @property
    def answered(self) -> int:
        """How many of them were answered; one asked again counts once."""
        return sum(self._done(number) for number in range(len(self.blocks)))

    @property
    def minutes_left(self) -> float:
        """What the blocks expect of what is left, times how fast this observer was in the last trials."""
        usual = statistics.median(pace) if (pace := tuple(self._pace)) else 1.0
        left_s = 0.0
        for number, (_, trials, expected_s) in enumerate(self.blocks):
            if trials:
                left_s += expected_s * (1 - self._done(number) / trials)
            elif number not in self._answered:
                left_s += expected_s
        return usual * left_s / 60

    def hear(self, event: Event) -> None:
        """Count each trial, also one that a resumed session read from its log, and watch the window."""
        match event:
            case SessionBegan():
                self.blocks, self.missed_elsewhere = event.blocks, event.missed_elsewhere
                self._before_s = self.clock()
            case Recorded(Trial() as trial) | Replayed(trial):
                self.update(trial)
            case Recorded(WindowEvent() as window):
                self._window = _AWAY.get(window.what, "")

    def update(self, trial: Trial) -> None:
        """Count ``trial``."""
        now_s = self.clock()
        took_s, self._before_s = now_s - self._before_s, now_s
        if trial.attempt == 0 and not trial.is_outcome:
            self._answered.setdefault(trial.block, set()).add(trial.trial)
            self._block = max(self._block, trial.block)
        self._haste.add(trial)
        unsent = [mark.port for mark in trial.timing_marks if mark.failed is not None]
        self._unmarked = f"timing marks are not sent on {visible(unsent[-1])}" if unsent else ""
        self._missed += sum(scene.missed_frames for scene in trial.timed)
        _, trials, expected_s = self.blocks[trial.block]
        if not trials or trial.is_outcome or took_s < trial.response_time_s:
            return  # a page of words, or what came of a test; or read from the log, which takes no time
        self._pace.append(took_s * trials / max(expected_s, 1e-9))
        again = " (again)" if trial.attempt else ""
        self._last.append(f"{_answer(trial)} {trial.response_time_s:.1f} s{again}")

    @property
    def missed(self) -> int:
        """How many frames were missed."""
        return self._missed + self.missed_elsewhere()

    @property
    def last(self) -> tuple[str, ...]:
        """The last answers, each with its response time, the latest last."""
        return tuple(self._last)

    def line(self) -> str:
        """Return all of it on one line."""
        minutes = self.minutes_left
        left = time_left(minutes)
        parts = [
            f"trial {self.answered} of {self.trials}",
            f"block {self._block + 1} of {len(self.blocks)}: {self.blocks[self._block][0].replace('_', ' ')}",
            left if self.answered < self.trials else "all answered",
            f"missed frames {self.missed}",
            *([f"presses ignored in {self._haste.ignored}"] if self._haste.ignored else []),
            *(["CHECK: too fast, or pressed too often"] if self._haste.striking else []),
            *([f"CHECK: {self._window}"] if self._window else []),
            *([f"CHECK: {self._unmarked}"] if self._unmarked else []),
        ]
        last = self.last
        return " · ".join([*parts, f"last: {', '.join(last)}"] if last else parts)

    def _done(self, number: int) -> int:
        return min(len(self._answered.get(number, ())), self.blocks[number][1])


def _answer(trial: Trial) -> str:
    """Return what was answered in a word or two."""
    return _short(trial.said or (trial.events[-1][0] if trial.events else trial.kind))


def _short(text: str) -> str:
    words = visible(text)
    return words if len(words) <= _LONGEST_ANSWER else f"{words[: _LONGEST_ANSWER - 1]}…"
