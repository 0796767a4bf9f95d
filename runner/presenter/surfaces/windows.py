"""Windows: one on a screen, one without a screen, and one for each eye on two screens."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import glfw
import moderngl

from devices.compensation import Rectangle, Size
from devices.display import Eye
from runner.ports import KeyPress, WindowClosed
from runner.presenter.depth import Bits, code_texture, given_bits
from runner.presenter.errors import PresentationError
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces import gl_calls
from runner.presenter.surfaces.gamma_tables import LoadedTable
from runner.presenter.surfaces.gl_calls import Codes, GlCalls
from runner.presenter.surfaces.glfw_session import ContextLoader, GlfwSession, context_hints, function_address
from runner.presenter.surfaces.glfw_surface import GlfwSurface
from runner.presenter.surfaces.surface import Buffer

_TITLE = "cyclopean"


class WindowSurface(GlfwSurface):
    """A window of the panel's resolution, with vertical sync and no cursor.

    Where no monitor has that resolution, or ``windowed`` is true, it is an undecorated window at the top left of
    the screen, and a remark says so. ``stereo`` asks for left and right buffers; if the driver has none, the window
    opens without them and its ``stereo`` is false. ``bits`` asks for codes of 8 bits a channel or 10; if the driver has
    not 10, the window opens with 8, and a remark says so. ``identity`` loads the identity as the monitor's gamma table
    until it is closed.
    """

    backend = "window"

    def __init__(
        self,
        size_px: Size,
        *,
        stereo: bool = False,
        windowed: bool = False,
        bits: Bits = 8,
        identity: bool = False,
    ) -> None:
        session = GlfwSession()
        try:
            restored = session.restore_tables()
            monitor = None if windowed else _fitting_monitor(size_px)
            window = _create_window(size_px, monitor, bits, stereo=stereo)
            if stereo and not window:
                window = _create_window(size_px, monitor, bits, stereo=False)
            if not window:
                raise PresentationError(f"the window could not be opened: {session.why()}")
            super().__init__(session, window, size_px, vsync=True, bits=bits)
            self.remarks += restored
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
            if identity:
                self._load_identity()
        except BaseException:
            session.close()
            raise


def _fitting_monitor(size_px: Size) -> Any:
    """Return the first monitor whose mode has ``size_px``, or None."""
    modes = ((monitor, glfw.get_video_mode(monitor)) for monitor in glfw.get_monitors())
    return next((monitor for monitor, mode in modes if tuple(mode.size) == tuple(size_px)), None)


def _refresh_hz(monitor: Any) -> float | None:
    """Return the refresh rate that the monitor, or the first one, reports; None if it reports none."""
    mode = glfw.get_video_mode(monitor or glfw.get_primary_monitor())
    return float(mode.refresh_rate) or None if mode else None


def _create_window(size_px: Size, monitor: Any, bits: Bits, *, stereo: bool) -> Any:
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


class NullWindowSurface(GlfwSurface):
    """A window of ``size_px`` drawn by OSMesa. It has no keys: glfw's null platform never has an event.

    Its codes have 8 bits; a remark says so if ``bits`` asks for more.
    """

    backend = "null"

    def __init__(self, size_px: Size, bits: Bits = 8) -> None:
        session = GlfwSession(glfw.PLATFORM_NULL)
        try:
            glfw.default_window_hints()
            for hint, value in {**context_hints(bits), glfw.CONTEXT_CREATION_API: glfw.OSMESA_CONTEXT_API}.items():
                glfw.window_hint(hint, value)
            window = glfw.create_window(*size_px, "cyclopean", None, None)
            if not window:
                raise PresentationError(
                    f"OSMesa gives no OpenGL context: {session.why()} (install libosmesa6, or use another backend)"
                )
            super().__init__(session, window, size_px, vsync=False, bits=bits)
        except BaseException:
            session.close()
            raise

    def wait_key(self) -> KeyPress:
        """Raise WindowClosed: nobody can press a key here."""
        raise WindowClosed("a window without a screen has no keys")

    def follow_mouse(self, pointer: Pointer | None) -> None:
        """Do nothing: there is no mouse here."""

    def wake(self) -> None:
        """Do nothing: nobody sleeps here."""

    def poll_keys(self) -> tuple[KeyPress, ...]:
        """Return none."""
        return ()


_TITLES = ("cyclopean left", "cyclopean right")


class DualWindowSurface(GlfwSurface):
    """A window for each eye: the left eye's on the monitor that stands further left.

    Both contexts share their textures. All is drawn in the left window's context, the right eye's frame to a texture
    that the right window then copies. Only the left window waits for its screen, so that two screens that are out of
    step do not wait for one another. ``windowed`` puts two windows side by side on one screen.

    Raises PresentationError where fewer than two monitors have the panel's resolution.
    """

    backend = "window"
    windows = 2

    def __init__(self, size_px: Size, *, windowed: bool = False, bits: Bits = 8, identity: bool = False) -> None:
        session = GlfwSession()
        try:
            restored = session.restore_tables()
            monitors: Sequence[Any] = (None, None) if windowed else _two_monitors(size_px)
            first = _create_for_eye(size_px, monitors[0], _TITLES[0], None, bits)
            second = first and _create_for_eye(size_px, monitors[1], _TITLES[1], first, bits)
            if not second:
                raise PresentationError(f"two windows could not be opened: {session.why()}")
            super().__init__(session, first, size_px, vsync=True, bits=bits)
            self._right = self.context.framebuffer([code_texture(self.context, size_px, self.bits)])
            self._second = _RightWindow(second, self._right, size_px)
            if (given := given_bits(bits, self._second.bits)) != (self.bits, self.remarks):
                raise PresentationError(
                    f"the right window has {given[0]} bits a channel and the left one {self.bits} (ask for 8)"
                )
            self.remarks += restored
            glfw.make_context_current(first)
            self._listen(second)
            for window, left_px in ((first, 0), (second, size_px[0])):
                if windowed:
                    glfw.set_window_pos(window, left_px, 0)
                glfw.set_input_mode(window, glfw.CURSOR, glfw.CURSOR_HIDDEN)
                glfw.show_window(window)
            glfw.focus_window(first)
            session.complaints.clear()
            self._settle()
            self._check_size(glfw.get_framebuffer_size(second))
            if identity:
                self._load_identity()
        except BaseException:
            session.close()
            raise

    def target(self, buffer: Buffer) -> moderngl.Framebuffer:
        """Bind what ``buffer`` is drawn to: the left window, or the texture of the right one."""
        if buffer is not Buffer.BACK_RIGHT:
            return super().target(Buffer.BACK)
        self._right.use()
        return self._right

    def swap(self) -> None:
        """Show both windows, the right one first, and wait until the graphics card has done so."""
        self.context.finish()
        self._second.show()
        glfw.make_context_current(self._window)
        super().swap()

    def read(self, eye: Eye | None = None) -> Codes:
        """Return the codes (height, width, 3) of ``eye``'s frame, top row first."""
        if eye != "right":
            return super().read(None)
        self._right.use()
        return self.calls.read_from(gl_calls.COLOUR_ATTACHMENT, self.size_px, self.bits)

    def gamma_tables(self) -> Mapping[Eye, LoadedTable]:
        """Read the gamma table of the monitor that each eye's window stands on."""
        return {"left": self._table_under(self._window), "right": self._table_under(self._second.window)}

    def close(self) -> None:
        """Destroy both windows."""
        self._second.release()
        glfw.make_context_current(self._window)
        super().close()

    def _closed(self) -> bool:
        return super()._closed() or bool(glfw.window_should_close(self._second.window))


class _RightWindow:
    """The second window's own context; it can see the first one's textures but not its framebuffers."""

    def __init__(self, window: Any, drawn: moderngl.Framebuffer, size_px: Size) -> None:
        self.window = window
        self._whole = Rectangle(0, 0, *size_px)
        glfw.make_context_current(window)
        glfw.swap_interval(0)
        # The stubs know no loader but by name.
        self._context = moderngl.create_context(context=ContextLoader())  # type: ignore[arg-type]
        self._calls = GlCalls(function_address)
        shared = drawn.color_attachments[0].glo
        self._drawn = self._context.framebuffer([self._context.external_texture(shared, size_px, 4, 0, "f1")])
        self._screen = self._context.detect_framebuffer(0)
        self._screen.use()
        self.bits = self._calls.bits(gl_calls.BACK_LEFT)

    def show(self) -> None:
        """Copy what was drawn and show it."""
        glfw.make_context_current(self.window)
        self._screen.use()
        self._calls.draw_to(gl_calls.BACK)
        self._calls.copy(self._drawn, self._screen, self._whole, self._whole)
        glfw.swap_buffers(self.window)
        self._context.finish()

    def release(self) -> None:
        """Free the context's objects."""
        glfw.make_context_current(self.window)
        self._context.release()


def _two_monitors(size_px: Size) -> Sequence[Any]:
    fitting = [monitor for monitor in glfw.get_monitors() if tuple(glfw.get_video_mode(monitor).size) == tuple(size_px)]
    if len(fitting) < 2:
        sizes = [tuple(glfw.get_video_mode(monitor).size) for monitor in glfw.get_monitors()]
        screens = " and ".join(f"{width} × {height}" for width, height in sizes) or "none"
        raise PresentationError(
            f"a window for each eye needs two monitors of {size_px[0]} × {size_px[1]} px (there: {screens})"
        )
    return sorted(fitting, key=lambda monitor: tuple(glfw.get_monitor_pos(monitor)))[:2]


def _create_for_eye(size_px: Size, monitor: Any, title: str, shared: Any, bits: Bits) -> Any:
    glfw.default_window_hints()
    for hint, value in {**context_hints(bits), glfw.VISIBLE: glfw.FALSE}.items():
        glfw.window_hint(hint, value)
    return glfw.create_window(*size_px, title, monitor, shared)
