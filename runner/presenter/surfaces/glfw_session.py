"""glfw, initialised for one window and terminated with it: error messages, Ctrl-C while it waits, OpenGL contexts."""

from __future__ import annotations

import signal
import socket
import sys
import threading
from collections.abc import Callable
from ctypes import c_void_p
from types import FrameType
from typing import Any, ParamSpec

import glfw

from runner.presenter.depth import Bits
from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.gamma_tables import LoadedTable, monitor_names, read_table, set_tables, why_unreadable
from runner.presenter.surfaces.identity_tables import restore_left
from runner.presenter.surfaces.x11 import LOST, watch_server


class GlfwSession:
    """glfw between initialising and terminating; only one can be open in a process."""

    def __init__(self, platform: int | None = None) -> None:
        self.complaints: list[str] = []
        self.on_lost: Callable[[], object] | None = None
        self._unreadable: str | None = None
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
        self._watch_server = watch_server(self._lost) if glfw.get_platform() == glfw.PLATFORM_X11 else None

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

    def gamma_tables(self) -> dict[str, LoadedTable]:
        """Read the gamma table of each monitor, by its name."""
        return {name: self.gamma_table(name, monitor) for name, monitor in monitor_names(glfw).items()}

    def gamma_table(self, name: str, monitor: Any) -> LoadedTable:
        """Read the gamma table of ``monitor``, which is called ``name``."""
        if self.display_server == "none":
            return LoadedTable.unknown("there is no screen")
        if self._unreadable is None:
            self._unreadable = why_unreadable(self.display_server)
        return LoadedTable.unknown(self._unreadable, name) if self._unreadable else read_table(glfw, name, monitor)

    def restore_tables(self) -> tuple[str, ...]:
        """Load again the gamma tables that killed sessions did not restore; return remarks."""
        return restore_left(self.gamma_tables, set_tables)

    def why(self) -> str:
        """Return glfw's error messages since the last call, and forget them."""
        words = "; ".join(dict.fromkeys(self.complaints)) or "glfw gives no reason"
        self.complaints.clear()
        return words

    def _lost(self) -> None:
        """Say what happened; the process ends when this returns, because the window library cannot go on."""
        if self.on_lost is not None:
            self.on_lost()
        else:
            sys.stderr.write(f"cyclopean: {LOST}\n")

    def close(self) -> None:
        """Destroy every window and terminate glfw."""
        self.signals.close()
        glfw.terminate()
        if self._watch_server is not None:
            self._watch_server()
        glfw.set_error_callback(self._callback_before)  # type: ignore[arg-type] # None clears it

    def _complain(self, code: int, description: Any) -> None:
        words = description.decode("utf-8", "replace") if isinstance(description, bytes) else str(description)
        self.complaints.append(words)


P = ParamSpec("P")


class SignalWake:
    """Wakes a program that sleeps in the event queue when a signal such as Ctrl-C arrives.

    The sleep is inside the window library, where Python's own handlers cannot run. Python writes a byte to a socket for
    each signal; a thread that sleeps on the other end calls ``wake``, which posts an empty event, the sleep ends, and
    the handler runs. Outside the main thread it does nothing.

    A Ctrl-C that comes while the library calls back would be lost: ctypes prints what a callback raises and drops it.
    So Ctrl-C, or another signal to end that Python handles, is kept during `heard` until the library has returned.
    """

    def __init__(self, wake: Callable[[], object]) -> None:
        self._before: int | None = None
        self._inside = False
        self._interrupted: int | None = None
        if threading.current_thread() is not threading.main_thread():
            return
        self._reading, self._writing = socket.socketpair()
        self._writing.setblocking(False)
        self._before = signal.set_wakeup_fd(self._writing.fileno(), warn_on_full_buffer=False)
        self._thread = threading.Thread(target=self._listen, args=(wake,), daemon=True, name="signal wake")
        self._thread.start()
        self._handlers = {
            number: handler
            for name in ("SIGINT", "SIGTERM", "SIGHUP")
            if callable(handler := signal.getsignal(number := getattr(signal, name, signal.SIGINT)))
        }
        for number in self._handlers:
            signal.signal(number, self._interrupt)

    def heard(self, call: Callable[P, object], *args: P.args, **kwargs: P.kwargs) -> None:
        """Call into the window library, which may call back; Ctrl-C meanwhile is handled once it has returned."""
        self._inside = True
        try:
            call(*args, **kwargs)
        finally:
            self._inside = False
        if self._interrupted is not None:
            number, self._interrupted = self._interrupted, None
            signal.raise_signal(number)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if self._inside:
            self._interrupted = number
        else:
            self._handlers[number](number, frame)

    def _listen(self, wake: Callable[[], object]) -> None:
        # An empty read is the other end's closing.
        while self._reading.recv(64):
            wake()

    def close(self) -> None:
        """Put back what was there before and end the thread."""
        if self._before is None:
            return
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(self._before)
        self._before = None
        self._writing.close()
        self._thread.join()
        self._reading.close()


class ContextLoader:
    """The window's own loader, as moderngl takes it; moderngl's would look for another libGL."""

    def load_opengl_function(self, name: str) -> int:
        """Return a function's address."""
        return function_address(name)

    def __enter__(self) -> ContextLoader:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def release(self) -> None:
        """Do nothing: it holds nothing."""


def function_address(name: str) -> int:
    """Return the address of an OpenGL function in the current context, 0 if it has none."""
    address = glfw.get_proc_address(name)
    if isinstance(address, c_void_p):
        return address.value or 0
    return int(address or 0)


def context_hints(bits: Bits = 8) -> dict[int, int]:
    """Return the window hints that every window needs: OpenGL 3.3 core, ``bits`` a channel, no smoothing.

    The driver gives the nearest that it has, so that the window must be asked afterwards what it got.
    """
    return {
        glfw.CONTEXT_VERSION_MAJOR: 3,
        glfw.CONTEXT_VERSION_MINOR: 3,
        glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
        # macOS has a core profile without what is deprecated, and no other.
        **({glfw.OPENGL_FORWARD_COMPAT: glfw.TRUE} if sys.platform == "darwin" else {}),
        glfw.RED_BITS: bits,
        glfw.GREEN_BITS: bits,
        glfw.BLUE_BITS: bits,
        **({glfw.ALPHA_BITS: 2} if bits == 10 else {}),
        glfw.DEPTH_BITS: 0,
        glfw.STENCIL_BITS: 0,
        glfw.SAMPLES: 0,
        glfw.SRGB_CAPABLE: glfw.FALSE,
        glfw.RESIZABLE: glfw.FALSE,
        glfw.DECORATED: glfw.FALSE,
        glfw.AUTO_ICONIFY: glfw.FALSE,
    }
