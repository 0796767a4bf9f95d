"""Which screens there are, without opening a window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import glfw

from runner.presenter.rectangle import Size
from runner.presenter.surfaces.glfw_session import GlfwSession


@dataclass(frozen=True, slots=True)
class Monitor:
    """A screen as the window system has it; ``refresh_hz`` is None where it does not say."""

    name: str
    size_px: Size
    refresh_hz: float | None

    def __str__(self) -> str:
        rate = f" at {self.refresh_hz:g} Hz" if self.refresh_hz else ""
        return f"{self.size_px[0]} x {self.size_px[1]} px{rate}"


def monitors() -> tuple[Monitor, ...]:
    """Return the screens, the primary one first.

    Raises
    ------
    PresentationError
        If there is no display server, or a window is open already.
    """
    session = GlfwSession()
    try:
        return tuple(_monitor(handle) for handle in glfw.get_monitors())
    finally:
        session.close()


def _monitor(handle: Any) -> Monitor:
    mode = glfw.get_video_mode(handle)
    name = glfw.get_monitor_name(handle)
    words = name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
    return Monitor(words, (int(mode.size.width), int(mode.size.height)), float(mode.refresh_rate) or None)
