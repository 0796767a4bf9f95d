"""What the session engine needs of the world, and no more: a presenter, an observer, a clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from runner.presenter.scene import Scene


@dataclass(frozen=True, slots=True)
class KeyPress:
    """A key going down at ``time_s`` on the presenter's monotonic clock; ``key`` as in ``up``, ``space``, ``a``."""

    key: str
    time_s: float


@dataclass(frozen=True, slots=True)
class Holding:
    """A scene held for ``frames`` frames of ``period_s`` from ``onset_s`` on; the next onset says how long it was."""

    onset_s: float
    frames: int
    period_s: float

    def missed(self, next_onset_s: float) -> int:
        """Return how many frames longer than asked the scene stood, to the nearest frame; 0 if it was not longer."""
        return max(0, round((next_onset_s - self.onset_s) / self.period_s) - self.frames)


class WindowClosed(Exception):
    """The window was closed while an answer was awaited."""


@dataclass(frozen=True, slots=True)
class Ask:
    """A scene, what each key would mean to the block that shows it, and the scene to expect after it.

    ``about`` are the stimuli that the answer chooses between, in the order of the meanings ``first`` and ``second``;
    the scene need not show them any more.
    """

    scene: Scene
    keys: Mapping[str, str] = field(default_factory=dict)
    upcoming: Scene | None = None
    about: tuple[str, ...] = ()


class Presenter(Protocol):
    """Shows scenes."""

    def show(self, scene: Scene) -> float:
        """Show ``scene`` and return its onset in seconds on the monotonic clock; an equal scene is not redrawn."""

    def prefetch(self, scene: Scene) -> None:
        """Make ready what ``scene`` will need, while there is time."""

    def hold(self, scene: Scene, seconds: float) -> Holding:
        """Show ``scene`` and return in time for the next scene to follow after the nearest whole number of frames.

        Keys pressed meanwhile mean nothing.
        """


class Observer(Protocol):
    """Answers what is shown: a person, a simulation or a replay; the engine cannot tell which."""

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Return the first press of one of ``ask.keys`` or of ``escape`` after ``onset_s``.

        Raises WindowClosed if there is nothing left to answer to.
        """
