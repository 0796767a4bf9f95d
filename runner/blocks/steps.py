"""The words that blocks and the engine exchange."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from runner.ports import Ask
from runner.presenter.scene import Scene
from stimuli.pictures.stereo_image import StereoImage

SECONDS_PER_TRIAL = 5.0


@dataclass(frozen=True, slots=True)
class Response:
    """What came back for an Ask: the key, what it means to the block, and the time since the scene's onset."""

    key: str
    meaning: str
    time_s: float


@dataclass(frozen=True, slots=True)
class Hold:
    """A scene to be shown for ``seconds``, to the nearest whole frame; ``what`` names it in the record."""

    what: str
    scene: Scene
    seconds: float


class Ended(Exception):
    """Raised by a block after its last record to end the session there, complete; ``facts`` stand in its end record."""

    def __init__(self, facts: Mapping[str, Any]) -> None:
        super().__init__()
        self.facts = dict(facts)


@dataclass(frozen=True, slots=True)
class Draft:
    """What a block wants recorded of one trial; the engine adds where and when.

    ``stimuli`` are the names shown, for the record of what the gamut clip cost. ``repeatable`` says whether it makes
    sense to ask it once more, as it does not of a page of words.
    """

    kind: str
    data: Mapping[str, Any] = field(default_factory=dict)
    stimuli: tuple[str, ...] = ()
    response_time_s: float = 0.0
    repeatable: bool = True


# A block yields an Ask and is sent its Response, yields a Hold and is sent None when it is time for the next scene, or
# yields a Draft and is sent None once that is on disk.
Steps: TypeAlias = Generator[Ask | Hold | Draft, Response | None, None]


class Block(ABC):
    """One part of a session."""

    __slots__ = ()

    @property
    def trials(self) -> int:
        """How many scored trials it will record."""
        return 0

    @property
    def expected_s(self) -> float:
        """About how long it will take."""
        return SECONDS_PER_TRIAL * self.trials

    @property
    def keys(self) -> Mapping[str, str]:
        """What the keys mean in it, beside the space bar that goes on."""
        return {}

    @property
    def pictures(self) -> Mapping[str, Callable[[], StereoImage]]:
        """Pictures of its own making, by the names that its scenes show them by."""
        return {}

    @abstractmethod
    def steps(self) -> Steps:
        """Start the coroutine; called again after an interruption it must yield the same steps."""


def answer(response: Response | None) -> Response:
    """Return ``response``, which the engine never leaves out after an Ask."""
    if response is None:
        raise RuntimeError("the engine sent no response to an Ask")
    return response
