"""What a window and a window without a screen have in common: one glfw window with an OpenGL 3.3 core context."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self, TypeAlias

import glfw
import moderngl

from analysis.records import SurfaceFacts
from devices.compensation import Size
from devices.display import EYES, Eye
from runner.ports import KeyPress, WindowClosed
from runner.presenter.arithmetic_choice import arithmetic_in_words
from runner.presenter.depth import Bits, given_bits
from runner.presenter.errors import GraphicsError, PresentationError
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces import gl_calls
from runner.presenter.surfaces.gamma_tables import SETTABLE, LoadedTable, monitor_names, set_tables
from runner.presenter.surfaces.gl_calls import Codes, GlCalls
from runner.presenter.surfaces.glfw_session import ContextLoader, GlfwSession, function_address
from runner.presenter.surfaces.identity_tables import IdentityTables
from runner.presenter.surfaces.input import PERIOD_S, Gamepads, Input, gamepad_names
from runner.presenter.surfaces.keyboard import keyboard_labels
from runner.presenter.surfaces.screens import Monitor
from runner.presenter.surfaces.surface import Buffer

_GL_DITHER = 0x0BD0
_GL_FRAMEBUFFER_SRGB = 0x8DB9
_REFRESH_HZ = 60.0  # where no monitor reports one
_SHOWN_WITHIN_S = 0.5
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


class GlfwSurface:
    """A surface on a glfw window; a subclass opens the window and names its kind."""

    backend: str
    windows = 1

    def __init__(self, session: GlfwSession, window: Any, size_px: Size, *, vsync: bool, bits: Bits = 8) -> None:
        self.size_px = size_px
        self.position_px = (0, 0)
        self.on_damage: Callable[[], object] | None = None
        self.on_move: Callable[[], object] | None = None
        self.on_wake: Callable[[], object] | None = None
        self.on_frame: Callable[[], object] | None = None
        self.on_point: Callable[[], object] | None = None
        self.on_window: Callable[[str, Mapping[str, Any]], object] | None = None
        self.gamepads = Gamepads()
        self.refresh_hz: float | None = None
        self.on_monitors: tuple[Monitor, ...] = ()
        self.too_large = False
        self._frame_due_s = 0.0
        self._identity = IdentityTables(set_tables)
        self._session = session
        self._window = window
        self._input = Input()
        self._listened: list[Any] = []
        self._watch = WindowWatch(self._window_state)
        self._damaged = False
        self._moved = False
        self._woken = False
        glfw.make_context_current(window)
        session.complaints.clear()
        glfw.swap_interval(1 if vsync else 0)
        self._vsync = vsync and not session.complaints
        session.complaints.clear()
        try:
            # The stubs know no loader but by name.
            self.context = moderngl.create_context(context=ContextLoader())  # type: ignore[arg-type]
        except Exception as error:  # the loader raises bare Exceptions
            raise GraphicsError(f"the window gives no OpenGL 3.3 context: {error}") from error
        self.calls = GlCalls(function_address)
        self.stereo = self.calls.has_stereo()
        back = gl_calls.BACK if self.calls.has_back_buffer() else gl_calls.FRONT
        self._buffers: Mapping[Buffer, int] = {Buffer.BACK: back}
        if self.stereo:
            eyes = {Buffer.BACK_LEFT: gl_calls.BACK_LEFT, Buffer.BACK_RIGHT: gl_calls.BACK_RIGHT}
            self._buffers = {**self._buffers, **eyes}
        for capability in (_GL_DITHER, _GL_FRAMEBUFFER_SRGB):
            self.context.disable_direct(capability)
        self._framebuffer = self.context.detect_framebuffer(0)
        self._framebuffer.use()
        left = gl_calls.BACK_LEFT if back == gl_calls.BACK else gl_calls.FRONT_LEFT
        self.remarks: tuple[str, ...]
        framebuffer_bits = self.calls.bits(left)
        if framebuffer_bits == 0:
            _ = self.context.error  # asking it forgets that the question was an error
        self.bits, self.remarks = given_bits(bits, framebuffer_bits)
        self._check_size(glfw.get_framebuffer_size(window))
        self._listen(window)
        self._input.listen_to_motion(window)
        glfw.set_window_pos_callback(window, self._on_position)

    @property
    def facts(self) -> SurfaceFacts:
        """What to record of it."""
        info = self.context.info
        return SurfaceFacts(
            backend=self.backend,
            display_server=self._session.display_server,
            vendor=str(info["GL_VENDOR"]),
            renderer=str(info["GL_RENDERER"]),
            gl_version=str(info["GL_VERSION"]),
            size_px=self.size_px,
            stereo=self.stereo,
            vsync=self._vsync,
            remarks=self.remarks,
            refresh_hz=self.refresh_hz,
            bits=self.bits,
            gamepads=gamepad_names(),
            gamepad_resolution_ms=1000.0 * PERIOD_S,
            arithmetic=arithmetic_in_words(self.context),
            monitors=tuple(monitor.line for monitor in self.on_monitors),
            larger_than_screen=self.too_large,
        )

    def gamma_tables(self) -> Mapping[Eye, LoadedTable]:
        """Read the gamma table of the monitor that each eye's window stands on."""
        return dict.fromkeys(EYES, self._table_under(self._window))

    def keyboard_labels(self) -> Mapping[str, str]:
        """Return what keys print at the places of digits and Latin letters that none prints."""
        return keyboard_labels()

    def target(self, buffer: Buffer) -> moderngl.Framebuffer:
        """Bind ``buffer`` for drawing and return the window's framebuffer."""
        name = self._buffer(buffer)
        self._framebuffer.use()
        self.calls.draw_to(name)
        return self._framebuffer

    def swap(self) -> None:
        """Show the back buffers and wait until the graphics card has done so."""
        glfw.swap_buffers(self._window)
        self.context.finish()
        self._damaged = False

    def read(self, eye: Eye | None = None) -> Codes:
        """Return the codes (height, width, 3) of the back buffer, or of ``eye``'s, top row first."""
        name = self._buffer(Buffer.of(eye))
        self._framebuffer.use()
        return self.calls.read_from(name, self.size_px, self.bits)

    def wait_key(self) -> KeyPress:
        """Sleep in the event queue until something is pressed, clicked, turned or typed, and return it.

        A letter gives two presses, its key and ``text X``. A key held down gives ``again KEY`` as often as the keyboard
        repeats it; a click gives ``click_at X,Y``, its place in pixels from the middle of a view. Raises WindowClosed
        once the window is closed.
        """
        while not self._input.presses:
            if self._closed():
                raise WindowClosed("the window was closed")
            pads = self._input.read_gamepads(self.gamepads)
            if self._input.presses:
                break
            if self.on_frame is not None:
                self._next_frame(self.on_frame)
            elif pads:
                self._session.signals.heard(glfw.wait_events_timeout, PERIOD_S)
            elif self._watch.waiting:
                self._session.signals.heard(glfw.wait_events_timeout, APART_S)
            else:
                self._session.signals.heard(glfw.wait_events)
            self._mend()
            self._report_windows()
            self._serve()
        self._report_windows()
        return self._input.presses.popleft()

    def follow_mouse(self, pointer: Pointer | None) -> None:
        """Let the mouse move ``pointer`` from now on, and stamp clicks with its place; with None it does neither.

        A gamepad's buttons that are down now are not pressed by what follows.
        """
        self._input.follow_mouse(self._window, pointer)
        self.gamepads.settle()

    def wake(self) -> None:
        """Wake whoever sleeps in ``wait_key``, from any thread, to call ``on_wake``."""
        self._woken = True
        glfw.post_empty_event()

    @property
    def on_lost(self) -> Callable[[], object] | None:
        """What is called if the window system ended, before the process does."""
        return self._session.on_lost

    @on_lost.setter
    def on_lost(self, call: Callable[[], object] | None) -> None:
        self._session.on_lost = call

    def hear(self) -> None:
        """Take what waits in the event queue, without sleeping: each press there is stamped with the time now."""
        self._session.signals.heard(glfw.poll_events)

    def poll_keys(self) -> tuple[KeyPress, ...]:
        """Return the presses that wait, without sleeping; raise WindowClosed once the window is closed."""
        self._session.signals.heard(glfw.poll_events)
        self._mend()
        if self._closed():
            raise WindowClosed("the window was closed")
        presses = tuple(self._input.presses)
        self._input.presses.clear()
        return presses

    def close(self) -> None:
        """Destroy the window; its monitor gets back the gamma table that was there before the identity."""
        self.context.release()
        try:
            self._identity.close(self._session.gamma_tables)
        finally:
            self._session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _load_identity(self) -> None:
        """Load the identity as gamma table of the monitors, until the window is closed."""
        server = self._session.display_server
        if server not in (*SETTABLE, "wayland"):  # Wayland's own reason is with its tables
            raise PresentationError(
                f"the identity cannot be loaded as gamma table on {server}, where a table goes back when the process "
                "that set it ends (take gamma_table out of the rig file, and measure with the table that is loaded)"
            )
        try:
            for before in self.gamma_tables().values():
                self._identity.load(before)
            for loaded in self.gamma_tables().values():
                if not loaded.table.is_identity:
                    raise PresentationError(f"the identity was loaded as gamma table, and there is {loaded}")
        except BaseException:
            self._identity.close(self._session.gamma_tables)
            raise

    def _table_under(self, window: Any) -> LoadedTable:
        """Return the gamma table of the monitor that has the middle of ``window``."""
        name, monitor = self._monitor_under(window)
        if monitor is None:
            return LoadedTable.unknown("the window stands on no monitor")
        return self._session.gamma_table(name, monitor)

    def _monitor_under(self, window: Any) -> tuple[str, Any]:
        there = monitor_names(glfw)
        if full := glfw.get_window_monitor(window):
            return next(((name, handle) for name, handle in there.items() if _same(handle, full)), ("", full))
        left, top = glfw.get_window_pos(window) if self._session.display_server != "wayland" else (0, 0)
        middle = left + self.size_px[0] // 2, top + self.size_px[1] // 2
        for name, handle in there.items():
            corner, size = glfw.get_monitor_pos(handle), glfw.get_video_mode(handle).size
            if all(start <= at < start + length for start, at, length in zip(corner, middle, size, strict=True)):
                return name, handle
        # A window larger than its screen has its middle elsewhere; it stands on the one it was placed on.
        first = next(iter(there), "")
        name = self.on_monitors[0].name if self.on_monitors else first
        return name, there.get(name)

    def _buffer(self, buffer: Buffer) -> int:
        if buffer not in self._buffers:
            raise PresentationError(f"the window has no buffer '{buffer.value}': it is not stereo")
        return self._buffers[buffer]

    def _check_size(self, actual_px: Size) -> None:
        if tuple(actual_px) != tuple(self.size_px):
            raise PresentationError(
                f"the window system gives {actual_px[0]} × {actual_px[1]} px in place of "
                f"{self.size_px[0]} × {self.size_px[1]} (set the screen to the panel's resolution, without scaling)"
            )

    def _closed(self) -> bool:
        return bool(glfw.window_should_close(self._window))

    def _settle(self) -> None:
        """Wait for the window to appear, so that its appearing does not count as damage later."""
        until_s = time.monotonic() + _SHOWN_WITHIN_S
        while not self._damaged and time.monotonic() < until_s:
            self._session.signals.heard(glfw.wait_events_timeout, 0.02)
        self._session.signals.heard(glfw.poll_events)
        self.position_px = on_its_panel(glfw.get_window_pos(self._window))
        self._damaged = self._moved = False
        self._watch.settle()

    def _window_state(self) -> WindowState:
        def any_is(attribute: int) -> bool:
            return any(glfw.get_window_attrib(window, attribute) for window in self._listened)

        width, height = glfw.get_framebuffer_size(self._window)
        name, _ = self._monitor_under(self._window)
        return WindowState(any_is(glfw.FOCUSED), any_is(glfw.ICONIFIED), (width, height), name)

    def _report_windows(self) -> None:
        for what, facts in self._watch.changes(time.monotonic()):
            if self.on_window is not None:
                self.on_window(what, facts)

    def _mend(self) -> None:
        if self._moved:
            self._moved = False
            if self.on_move is not None:
                self.on_move()
        if self._damaged:
            self._damaged = False
            self._input.pointed = False  # it is drawn with all else
            if self.on_damage is not None:
                self.on_damage()
        if self._input.pointed:
            self._input.pointed = False
            if self.on_point is not None:
                self.on_point()

    def _listen(self, window: Any) -> None:
        """Queue what is done at ``window``."""
        self._input.listen(window)
        self._listened.append(window)
        glfw.set_window_refresh_callback(window, self._on_refresh)
        glfw.set_window_focus_callback(window, lambda *_: self._watch.touch())
        glfw.set_window_iconify_callback(window, lambda *_: self._watch.touch())
        glfw.set_framebuffer_size_callback(window, lambda *_: self._watch.touch())

    def _next_frame(self, draw: Callable[[], object]) -> None:
        """Sleep until the next frame is due or something happens; draw the frame if it is due.

        Where the swap waits for the screen, it paces the frames, and drawing begins a quarter of a refresh after it.
        Where it does not, the clock does.
        """
        period_s = 1.0 / (self.refresh_hz or _REFRESH_HZ)
        wait_s = self._frame_due_s - time.monotonic()
        if wait_s > 0.0:
            self._session.signals.heard(glfw.wait_events_timeout, wait_s)
        else:
            self._session.signals.heard(glfw.poll_events)
        begun_s = time.monotonic()
        if self._input.presses or begun_s < self._frame_due_s:
            return
        draw()
        now_s = time.monotonic()
        if now_s - begun_s > period_s / 4.0:
            self._frame_due_s = now_s + period_s / 4.0
        else:
            self._frame_due_s = max(self._frame_due_s + period_s, now_s)

    def _serve(self) -> None:
        """Do what it was woken for, unless a key is waiting: that goes first."""
        if self._woken and not self._input.presses:
            self._woken = False
            if self.on_wake is not None:
                self.on_wake()

    def _on_refresh(self, _window: Any) -> None:
        self._damaged = True

    def _on_position(self, _window: Any, left: int, top: int) -> None:
        self.position_px = on_its_panel((left, top))
        self._moved = True
        self._watch.touch()


def _same(one: Any, other: Any) -> bool:
    """Whether two of glfw's pointers are of one monitor."""
    return ctypes.addressof(one.contents) == ctypes.addressof(other.contents)


def on_its_panel(corner_px: tuple[int, int]) -> tuple[int, int]:
    """Return a place on the desktop as counted from the top left of the monitor that it stands on."""
    for monitor in glfw.get_monitors() or ():
        left, top = glfw.get_monitor_pos(monitor)
        width, height = glfw.get_video_mode(monitor).size
        if left <= corner_px[0] < left + width and top <= corner_px[1] < top + height:
            return corner_px[0] - left, corner_px[1] - top
    return corner_px
