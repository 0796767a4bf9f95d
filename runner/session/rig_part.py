"""Parts of a rig that take part in sessions, such as what sends its timing marks: each entry's kind names its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from typing import Any, Protocol

from devices.display import Rig
from documents import Finding
from runner.blocks.context import Factors
from runner.session.events import Listener


class Measured(Protocol):
    """How soon after the swap a part did what it does; `doctor --timing` prints the sentences."""

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was measured, in plain sentences."""


class RigPart(Protocol):
    """A part of one rig: made of it, opened before a session's window, closed after the last session."""

    def __init__(self, rig: Rig) -> None: ...

    def described(self) -> list[str]:
        """Return what `check` says of each entry."""

    def faults(self) -> Iterator[tuple[Finding, bool]]:
        """Yield what keeps an entry from being opened here, and whether it is no more than a doubt."""

    def measured(self, frame: Callable[[], object]) -> Iterator[Measured]:
        """Measure each entry right after ``frame``, which draws and swaps, again and again."""

    def prepare(self, notify: Callable[[str], None]) -> None:
        """Open the part; ``notify`` is told what is waited for. InputError if it cannot be opened."""

    def remarks(self) -> Iterator[str]:
        """Yield in sentences what the session's record says of the open part."""

    @property
    def facts(self) -> Sequence[Mapping[str, Any]]:
        """What the session's header says of each entry of the open part."""

    def listener(
        self,
        since_start_s: Callable[[], float],
        factors: Mapping[str, Factors],
        note: Callable[[str, str], None],
    ) -> Listener:
        """Return what hears a session.

        ``since_start_s`` is the session's clock: the seconds from the start that its header states, now. ``factors``
        are the stimuli's. ``note`` is told what becomes of the part.
        """

    def lost(self) -> Iterator[str]:
        """Yield in sentences what was not done, once a session is over."""

    def close(self) -> None:
        """Close what is open."""


def parts_of(rig: Rig) -> tuple[RigPart, ...]:
    """Return the parts that the entries of the rig's ``timing_marks`` name, each once."""
    named = (each.partition(":") for each in dict.fromkeys(entry.part for entry in rig.marks))
    return tuple(getattr(import_module(module), name)(rig) for module, _, name in named)
