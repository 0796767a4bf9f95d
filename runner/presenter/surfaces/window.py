"""A window on a screen: full-screen where the screen has the panel's resolution."""

from __future__ import annotations

from typing import Any

import glfw

from runner.presenter.depth import Bits
from runner.presenter.errors import PresentationError
from runner.presenter.rectangle import Size
from runner.presenter.surfaces.glfw_session import GlfwSession
from runner.presenter.surfaces.glfw_surface import GlfwSurface, context_hints

_TITLE = "cyclopean"


class WindowSurface(GlfwSurface):
    """A window of the panel's resolution, with vertical sync and no cursor.

    Where no monitor has that resolution, or ``windowed`` is true, it is an undecorated window at the top left of
    the screen, and a remark says so. ``stereo`` asks for left and right buffers; if the driver has none, the window
    opens without them and its ``stereo`` is false. ``bits`` asks for codes of 8 bits a channel or 10; if the driver has
    not 10, the window opens with 8, and a remark says so.
    """

    backend = "window"

    def __init__(self, size_px: Size, *, stereo: bool = False, windowed: bool = False, bits: Bits = 8) -> None:
        session = GlfwSession()
        try:
            monitor = None if windowed else _monitor(size_px)
            window = _create(size_px, monitor, bits, stereo=stereo)
            if stereo and not window:
                window = _create(size_px, monitor, bits, stereo=False)
            if not window:
                raise PresentationError(f"the window could not be opened: {session.why()}")
            super().__init__(session, window, size_px, vsync=True, bits=bits)
            if monitor is None:
                glfw.set_window_pos(window, 0, 0)
            if monitor is None and not windowed:
                self.remarks += (_not_full_screen(size_px),)
            glfw.set_input_mode(window, glfw.CURSOR, glfw.CURSOR_HIDDEN)
            glfw.show_window(window)
            glfw.focus_window(window)
            session.complaints.clear()
            self.refresh_hz = _refresh_hz(monitor)
            self._settle()
            self._check_size(glfw.get_framebuffer_size(window))
        except BaseException:
            session.close()
            raise


def _monitor(size_px: Size) -> Any:
    """Return the first monitor whose mode has ``size_px``, or None."""
    modes = ((monitor, glfw.get_video_mode(monitor)) for monitor in glfw.get_monitors())
    return next((monitor for monitor, mode in modes if tuple(mode.size) == tuple(size_px)), None)


def _refresh_hz(monitor: Any) -> float | None:
    """Return what the monitor, or the first one, says of its refresh; None if it says nothing."""
    mode = glfw.get_video_mode(monitor or glfw.get_primary_monitor())
    return float(mode.refresh_rate) or None if mode else None


def _create(size_px: Size, monitor: Any, bits: Bits, *, stereo: bool) -> Any:
    glfw.default_window_hints()
    hints = {**context_hints(bits), glfw.STEREO: int(stereo), glfw.VISIBLE: glfw.FALSE}
    if monitor is not None:
        hints[glfw.REFRESH_RATE] = glfw.get_video_mode(monitor).refresh_rate
    for hint, value in hints.items():
        glfw.window_hint(hint, value)
    return glfw.create_window(*size_px, _TITLE, monitor, None)


def _not_full_screen(size_px: Size) -> str:
    sizes = [tuple(glfw.get_video_mode(monitor).size) for monitor in glfw.get_monitors()]
    screens = " and ".join(f"{width} × {height}" for width, height in sizes) or "none"
    return (
        f"no screen shows {size_px[0]} × {size_px[1]} px (there: {screens}); "
        "the window stands at the top left of the screen and is not full-screen"
    )
