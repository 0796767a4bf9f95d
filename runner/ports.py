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


class WindowClosed(Exception):
    """The window was closed while an answer was awaited."""


@dataclass(frozen=True, slots=True)
class Ask:
    """A scene, what each key would mean to the block that shows it, and the scene to expect after it."""

    scene: Scene
    keys: Mapping[str, str] = field(default_factory=dict)
    upcoming: Scene | None = None


class Presenter(Protocol):
    """Shows scenes."""

    def show(self, scene: Scene) -> float:
        """Show ``scene`` and return its onset in seconds on the monotonic clock; an equal scene is not redrawn."""

    def prefetch(self, scene: Scene) -> None:
        """Make ready what ``scene`` will need, while there is time."""


class Observer(Protocol):
    """Answers what is shown: a person, a simulation or a replay; the engine cannot tell which."""

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Return the first press of one of ``ask.keys`` or of ``escape`` after ``onset_s``.

        Raises WindowClosed if there is nothing left to answer to.
        """
