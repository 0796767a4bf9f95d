"""Which screens there are, and whether something stands between a window and the screen."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from typing import Any

from devices.compensation import Size
from devices.display import GammaTable, ReportedMonitor
from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.x11 import compositing_manager


@dataclass(frozen=True, slots=True)
class Monitor:
    """A screen as the window system has it; ``refresh_hz`` is None where it is not reported.

    ``gamma_table`` is what is loaded on it; ``position_px`` is where its top left corner stands on the desktop;
    ``size_mm`` is what the monitor says of its size, 0 where it says nothing.
    """

    name: str
    size_px: Size
    refresh_hz: float | None
    gamma_table: GammaTable
    position_px: tuple[int, int] = (0, 0)
    size_mm: tuple[int, int] = (0, 0)

    def __str__(self) -> str:
        rate = f" at {self.refresh_hz:g} Hz" if self.refresh_hz else ""
        return f"{self.size_px[0]} x {self.size_px[1]} px{rate}"

    @property
    def reported(self) -> ReportedMonitor:
        """What it reports of itself, from which a panel can be known."""
        return ReportedMonitor(self.name, self.size_px, self.size_mm, self.refresh_hz)


def monitors() -> tuple[Monitor, ...]:
    """Return the screens, the primary one first.

    Raises
    ------
    PresentationError
        If there is no display server, or a window is open already.
    """
    import glfw

    from runner.presenter.surfaces.gamma_tables import monitor_names
    from runner.presenter.surfaces.glfw_session import GlfwSession

    session = GlfwSession()
    try:
        tables = session.gamma_tables()
        return tuple(_monitor(glfw, name, handle, tables[name].table) for name, handle in monitor_names(glfw).items())
    finally:
        session.close()


def _monitor(glfw: Any, name: str, handle: Any, table: GammaTable) -> Monitor:
    mode = glfw.get_video_mode(handle)
    size_px = int(mode.size.width), int(mode.size.height)
    left, top = glfw.get_monitor_pos(handle)
    width_mm, height_mm = glfw.get_monitor_physical_size(handle)
    position_px, size_mm = (int(left), int(top)), (int(width_mm), int(height_mm))
    return Monitor(name, size_px, float(mode.refresh_rate) or None, table, position_px, size_mm)


def has_display() -> bool:
    """Return whether there is a display server to ask."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def primary_monitor() -> ReportedMonitor | None:
    """Return what the primary screen reports of itself: whom `devices.display.read_rig` asks for a panel.

    Returns
    -------
    ReportedMonitor or None
        Its pixels, its size in mm and its refresh rate; None without a display server, or where a window is open.

    Examples
    --------
    ``read_rig(path, ask_monitor=primary_monitor)`` reads a rig that names a nominal display without its panel.
    """
    if not has_display():
        return None
    try:
        there = monitors()
    except PresentationError:
        return None
    return there[0].reported if there else None


def compositor() -> str:
    """Return in a few words which compositor the windows of this process go through, as far as is known."""
    if sys.platform != "linux":
        return "the system's own"
    if os.environ.get("WAYLAND_DISPLAY"):
        return f"Wayland compositor ({os.environ.get('XDG_CURRENT_DESKTOP') or 'unnamed'})"
    if not os.environ.get("DISPLAY"):
        return "none (no display server)"
    manager = compositing_manager()
    if manager is None:
        return "X11; compositing manager unknown"
    return "X11 with a compositing manager" if manager else "X11 without a compositing manager"
