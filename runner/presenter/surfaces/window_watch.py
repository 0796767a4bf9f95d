"""What becomes of windows while a session runs: focus lost, minimised, resized, moved to another monitor."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from devices.compensation import Size

APART_S = 0.5  # changes of one kind that come faster, as while a window is dragged, are one


@dataclass(frozen=True, slots=True)
class WindowState:
    """How a session's windows stand: the size and the monitor of the first, the rest of all."""

    focused: bool
    minimised: bool
    size_px: Size
    monitor: str


# What happened to a window, as a record calls it, with the facts of it.
WindowChange: TypeAlias = tuple[str, dict[str, Any]]


class WindowWatch:
    """Reports how ``read`` differs from what was reported last, once `touch` says that something happened."""

    def __init__(self, read: Callable[[], WindowState]) -> None:
        self._read = read
        self._known: WindowState | None = None
        self._reported_s: dict[str, float] = {}
        self.waiting = False

    def touch(self) -> None:
        """Look at the windows at the next question."""
        self.waiting = True

    def settle(self) -> None:
        """Take the windows as they stand now for what is known."""
        self._known, self.waiting = self._read(), False

    def changes(self, now_s: float) -> tuple[WindowChange, ...]:
        """Return what changed; a change of a kind that was reported within half a second comes later."""
        if not self.waiting or self._known is None:
            return ()
        now, known = self._read(), self._known
        self.waiting = False
        changes = []
        for name in ("minimised", "focused", "size_px", "monitor"):
            value = getattr(now, name)
            if value == getattr(known, name):
                continue
            if now_s - self._reported_s.get(name, -math.inf) < APART_S:
                self.waiting = True
                continue
            self._reported_s[name] = now_s
            known = replace(known, **{name: value})
            changes.append(_change(name, value))
        self._known = known
        return tuple(changes)


def _change(name: str, value: Any) -> WindowChange:
    if name == "focused":
        return "got_focus" if value else "lost_focus", {}
    if name == "minimised":
        return "minimised" if value else "restored", {}
    if name == "size_px":
        return "resized", {"size_px": list(value)}
    return "moved", {"monitor": value}
