"""Which screens there are, and whether something stands between a window and the screen."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from devices.compensation import Size
from devices.display import GammaTable, ReportedMonitor
from documents import Finding
from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.x11 import compositing_manager

NOT_READ = GammaTable.unreadable("it was not read")


@dataclass(frozen=True, slots=True)
class Monitor:
    """A screen as the window system has it; ``refresh_hz`` is None where it is not reported.

    ``number`` counts from 1, the primary one. ``gamma_table`` is what is loaded on it, unknown where it was not read;
    ``position_px`` is where its top left corner stands on the desktop; ``size_mm`` is what the monitor says of its
    size, 0 where it says nothing.
    """

    name: str
    size_px: Size
    refresh_hz: float | None
    gamma_table: GammaTable
    position_px: tuple[int, int] = (0, 0)
    size_mm: tuple[int, int] = (0, 0)
    number: int = 1

    def __str__(self) -> str:
        rate = f" at {self.refresh_hz:g} Hz" if self.refresh_hz else ""
        return f"{self.size_px[0]} x {self.size_px[1]} px{rate}"

    @property
    def reported(self) -> ReportedMonitor:
        """What it reports of itself, from which a panel can be known."""
        return ReportedMonitor(self.name, self.size_px, self.size_mm, self.refresh_hz)

    @property
    def line(self) -> str:
        """All of it in a line: number, name, pixels, Hz, mm, place on the desktop."""
        size = f", {self.size_mm[0]} x {self.size_mm[1]} mm" if all(self.size_mm) else ", size in mm not known"
        rate = "" if self.refresh_hz else ", refresh rate not known"
        primary = ", primary" if self.number == 1 else ""
        left, top = self.position_px
        return f"{self.number} '{self.name}': {self}{rate}{size}, at {left},{top}{primary}"


def monitors() -> tuple[Monitor, ...]:
    """Return the screens, the primary one first.

    Raises
    ------
    PresentationError
        If there is no display server, or a window is open already.
    """
    import glfw

    from runner.presenter.surfaces.glfw_session import GlfwSession

    session = GlfwSession()
    try:
        tables = session.gamma_tables()
        return tuple(replace(monitor, gamma_table=tables[monitor.name].table) for monitor in listed_monitors(glfw))
    finally:
        session.close()


def listed_monitors(glfw: Any) -> dict[Monitor, Any]:
    """Return the monitors of glfw, which is initialised, and its handle of each; gamma tables are not read."""
    from runner.presenter.surfaces.gamma_tables import monitor_names

    there = {}
    for number, (name, handle) in enumerate(monitor_names(glfw).items(), start=1):
        mode = glfw.get_video_mode(handle)
        size_px = int(mode.size.width), int(mode.size.height)
        left, top = glfw.get_monitor_pos(handle)
        width_mm, height_mm = glfw.get_monitor_physical_size(handle)
        place_px, size_mm = (int(left), int(top)), (int(width_mm), int(height_mm))
        there[Monitor(name, size_px, float(mode.refresh_rate) or None, NOT_READ, place_px, size_mm, number)] = handle
    return there


def choose_monitors(there: Iterable[Monitor], wanted: Sequence[str]) -> tuple[Monitor, ...]:
    """Return the monitors that ``wanted`` names, each by its name or its number, in that order.

    Raises
    ------
    PresentationError
        If there is no such monitor, with a list of those that there are, or one is named twice.
    """
    there = tuple(there)
    chosen = []
    for words in wanted:
        named = [monitor for monitor in there if monitor.name == words] or [
            monitor for monitor in there if words == str(monitor.number) or words.casefold() == monitor.name.casefold()
        ]
        if not named:
            what = f"there is no monitor {words if words.isdigit() else repr(words)} here"
            remedy = f"there are: {'; '.join(monitor.line for monitor in there) or 'none'}"
            raise PresentationError(Finding(what, remedy=remedy))
        chosen.append(named[0])
    if len({monitor.number for monitor in chosen}) < len(chosen):
        raise PresentationError(Finding(f"the monitor '{chosen[0].name}' is named for both eyes", remedy="name two"))
    return tuple(chosen)


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a window goes, or one for each eye: on which ``monitors``, and whether it fills them.

    ``remark`` says that it does not; with ``too_large``, a part of it is on no screen.
    """

    monitors: tuple[Monitor, ...]
    full_screen: bool
    remark: str | None = None
    too_large: bool = False


def place_window(
    size_px: Size, there: Sequence[Monitor], wanted: Sequence[str] = (), *, windowed: bool = False
) -> Placement:
    """Return where a window of ``size_px`` goes: on a monitor of that size, else on one that holds it.

    ``wanted`` names the monitor, at most one. A window as large as all monitors together is spread over them.
    """
    chosen = choose_monitors(there, wanted)
    if len(chosen) > 1:
        raise PresentationError(Finding("one window is on one monitor, and two are named", remedy="name one"))
    candidates = chosen or tuple(there)
    exact = [monitor for monitor in candidates if monitor.size_px == tuple(size_px)]
    if exact and not windowed:
        return Placement((exact[0],), full_screen=True)
    screens = " and ".join(f"{width} × {height}" for width, height in (each.size_px for each in candidates)) or "none"
    what = f"no screen shows {size_px[0]} × {size_px[1]} px (there: {screens})"
    if chosen:
        what = f"the monitor '{chosen[0].name}' shows {screens} px, not {size_px[0]} × {size_px[1]} px"
    holding = [each for each in candidates if all(a <= b for a, b in zip(size_px, each.size_px, strict=True))]
    stands = "; the window stands at the top left of the screen and is not full-screen"
    if holding:
        return Placement((holding[0],), full_screen=False, remark=None if windowed else what + stands)
    if not chosen and _fill(size_px, there):
        stands = "; the window is spread over all of them, and is not full-screen"
        first = min(there, key=lambda monitor: monitor.position_px)
        return Placement((first,), full_screen=False, remark=None if windowed else what + stands)
    beyond = f"{stands}: what lies beyond the screen's edges is not seen"
    return Placement(candidates[:1], full_screen=False, remark=what + beyond, too_large=True)


def _fill(size_px: Size, there: Sequence[Monitor]) -> bool:
    """Return whether the monitors side by side make a desktop of ``size_px`` without gaps."""
    spans = [
        max(each.position_px[axis] + each.size_px[axis] for each in there)
        - min(each.position_px[axis] for each in there)
        for axis in (0, 1)
        if there
    ]
    area_px = sum(each.size_px[0] * each.size_px[1] for each in there)
    return spans == list(size_px) and area_px == size_px[0] * size_px[1]


def place_two_windows(size_px: Size, there: Sequence[Monitor], wanted: Sequence[str] = ()) -> Placement:
    """Return where a window for each eye goes, the left eye's first: as ``wanted``, else from left to right.

    Raises
    ------
    PresentationError
        If there are no two monitors of ``size_px``, or ``wanted`` does not name two.
    """
    chosen = choose_monitors(there, wanted)
    if len(chosen) == 1:
        remedy = "name two: the left eye's monitor first, then the right eye's"
        raise PresentationError(Finding("a window for each eye needs two monitors, and one is named", remedy=remedy))
    fitting = [monitor for monitor in chosen or there if monitor.size_px == tuple(size_px)]
    if len(fitting) < 2:
        screens = " and ".join(f"{m.size_px[0]} × {m.size_px[1]}" for m in chosen or there) or "none"
        raise PresentationError(
            f"a window for each eye needs two monitors of {size_px[0]} × {size_px[1]} px (there: {screens})"
        )
    return Placement(chosen or tuple(sorted(fitting, key=lambda each: each.position_px))[:2], full_screen=True)


def has_display() -> bool:
    """Return whether there is a display server to ask."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def primary_monitor(wanted: Sequence[str] = ()) -> ReportedMonitor | None:
    """Return what the primary screen reports of itself: whom `devices.display.read_rig` asks for a panel.

    Parameters
    ----------
    wanted
        Another monitor in place of the primary one, by name or number.

    Returns
    -------
    ReportedMonitor or None
        Its pixels, its size in mm and its refresh rate; None without a display server, or where a window is open.

    Raises
    ------
    PresentationError
        If there is no such monitor.

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
    if not there:
        return None
    return (choose_monitors(there, wanted)[0] if wanted else there[0]).reported


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
