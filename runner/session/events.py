"""What happens in a session: one stream of typed events, which its log and its other listeners hear.

`Session` sends each event to its log and then to its listeners, in the order in which they were added, one event after
the other; in its own thread, but for notes, marks and what becomes of the window, which come from anywhere. The log is
the first to hear of a record: when another listener hears `Recorded`, the record is on disk.

Timing marks, the mirror, the status, the costs of clipping and the watch on the gamma table are listeners, and
`SessionOptions` adds guests, by name those of other packages (`docs/extend.md`). A guest hears only what has happened,
and its faults cost no answer: it may end the session by SessionStoppedError, or as the observer does; any other error
is noted in the log, and it hears nothing more. A listener is quick: the next scene waits for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeAlias

from analysis.kinds import Trial
from analysis.records import Mark, Note, PooledBatch, StimulusCosts, WindowEvent
from documents.extensions import Registry

Record: TypeAlias = Trial | Note | Mark | WindowEvent | PooledBatch | StimulusCosts


@dataclass(frozen=True, slots=True)
class Shown:
    """What stands on the screen: of which trial, the name of a timed scene, its stimuli; ``trials`` were recorded."""

    block: int
    trial: int
    attempt: int
    timed: str
    stimuli: tuple[str, ...]
    trials: int


class Notes(Protocol):
    """What a listener may do to a session; from any thread."""

    def note(self, words: str, by: str) -> None:
        """Keep a note."""

    def mark(self, by: str) -> tuple[int, int] | None:
        """Mark the last trial to be asked again, and return its place."""


@dataclass(frozen=True, slots=True)
class SessionBegan:
    """The first scene of ``session`` is about to come.

    Of its ``blocks`` it says the kind, how many scored trials they have, and how many seconds they are expected to
    take. ``missed_elsewhere`` gives the missed frames that no trial records.
    """

    session: Notes
    blocks: Sequence[tuple[str, int, float]]
    missed_elsewhere: Callable[[], int]


@dataclass(frozen=True, slots=True)
class BlockBegan:
    """A block, counted from 0, is about to ask something that the log does not hold."""

    block: int


@dataclass(frozen=True, slots=True)
class SceneShown:
    """A scene of a block is on the screen, since ``onset_s`` on the monotonic clock; sent right after the swap."""

    shown: Shown
    onset_s: float


@dataclass(frozen=True, slots=True)
class Answered:
    """A press at ``time_s`` on the monotonic clock meant something to the question that is ``shown``."""

    shown: Shown
    time_s: float


@dataclass(frozen=True, slots=True)
class Paused:
    """The observer's menu is about to be shown in this trial."""

    block: int
    trial: int


@dataclass(frozen=True, slots=True)
class Recording:
    """A trial is about to be recorded: add to ``data`` what its record says beside the block's own.

    Guests do not hear it. A listener that raises ends the session without this answer.
    """

    attempt: int
    stimuli: tuple[str, ...]
    data: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Recorded:
    """A record is on disk: the log, which hears it first, wrote it. ``repeatable`` trials can be asked once more."""

    record: Record
    repeatable: bool = False


@dataclass(frozen=True, slots=True)
class Replayed:
    """A session that is resumed has read ``trial`` from its log; ``left`` are still to be read."""

    trial: Trial
    left: int


@dataclass(frozen=True, slots=True)
class Ending:
    """Nothing is left to be asked: add to ``facts`` what the log's last line says.

    Guests do not hear it.
    """

    facts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Ended:
    """The session is complete, and its last line is on disk."""

    facts: dict[str, Any]


Event: TypeAlias = (
    SessionBegan | BlockBegan | SceneShown | Answered | Paused | Recording | Recorded | Replayed | Ending | Ended
)


class Listener(Protocol):
    """Hears what happens in a session."""

    def hear(self, event: Event) -> None:
        """Act on ``event``, or pass it over."""


# Listeners of other packages, by name: a class, of which each session that names it has an object.
LISTENERS: Registry[Callable[[], Listener]] = Registry(
    "cyclopean.listeners",
    {},
    lambda name, kind: None if isinstance(kind, type) and hasattr(kind, "hear") else "is no class with hear",
)


def listeners_named(names: Iterable[str]) -> tuple[Listener, ...]:
    """Return listeners of other packages, made.

    Raises
    ------
    InputError
        If there is none of a name, or it cannot be made.
    """
    made = []
    for name in names:
        with LISTENERS.blamed(name):
            made.append(LISTENERS.wanted(name, "listener")())
    return tuple(made)
