"""glfw, initialised for one window and terminated with it; what it complains of, in words."""

from __future__ import annotations

from typing import Any

import glfw

from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.signal_wake import SignalWake


class GlfwSession:
    """glfw between initialising and terminating; only one can be open in a process."""

    def __init__(self, platform: int | None = None) -> None:
        self.complaints: list[str] = []
        self._callback_before = glfw.set_error_callback(self._complain)
        if glfw.get_platform():
            glfw.set_error_callback(self._callback_before)  # type: ignore[arg-type] # None clears it
            raise PresentationError("a window is open already; close it before opening another")
        self.complaints.clear()
        glfw.init_hint(glfw.PLATFORM, glfw.ANY_PLATFORM if platform is None else platform)
        if not glfw.init():
            why = self.why()
            glfw.set_error_callback(self._callback_before)  # type: ignore[arg-type] # None clears it
            raise PresentationError(
                f"no window can be opened: {why} (set DISPLAY to a running display; without one, take --simulate, "
                "--backend egl or --headless, whichever the command has)"
            )
        self.signals = SignalWake(glfw.post_empty_event)

    @property
    def display_server(self) -> str:
        """Which window system it is."""
        names = {
            glfw.PLATFORM_X11: "x11",
            glfw.PLATFORM_WAYLAND: "wayland",
            glfw.PLATFORM_WIN32: "win32",
            glfw.PLATFORM_COCOA: "cocoa",
            glfw.PLATFORM_NULL: "none",
        }
        return names.get(glfw.get_platform(), "unknown")

    def why(self) -> str:
        """Return what glfw has complained of since the last time, and forget it."""
        words = "; ".join(dict.fromkeys(self.complaints)) or "glfw gives no reason"
        self.complaints.clear()
        return words

    def close(self) -> None:
        """Destroy every window and give glfw back."""
        self.signals.close()
        glfw.terminate()
        glfw.set_error_callback(self._callback_before)  # type: ignore[arg-type] # None clears it

    def _complain(self, code: int, description: Any) -> None:
        words = description.decode("utf-8", "replace") if isinstance(description, bytes) else str(description)
        self.complaints.append(words)
