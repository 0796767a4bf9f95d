"""Windows: one on a screen, one without a screen, and one for each eye on two screens."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import glfw
import moderngl

from devices.compensation import Rectangle, Size
from devices.display import Eye
from documents import Finding
from runner.ports import KeyPress, WindowClosed
from runner.presenter.depth import Bits, code_texture, given_bits
from runner.presenter.errors import PresentationError
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces import gl_calls
from runner.presenter.surfaces.gamma_tables import LoadedTable
from runner.presenter.surfaces.gl_calls import Codes, GlCalls
from runner.presenter.surfaces.glfw_session import ContextLoader, GlfwSession, context_hints, function_address
from runner.presenter.surfaces.glfw_surface import GlfwSurface
from runner.presenter.surfaces.screens import Placement, listed_monitors, place_two_windows, place_window
from runner.presenter.surfaces.surface import Buffer

_TITLE = "cyclopean"


class WindowSurface(GlfwSurface):
    """A window of the panel's resolution, with vertical sync and no cursor.

    It is on the monitor that ``monitors`` names, else on the first of that resolution. Where that monitor has another,
    or ``windowed`` is true, it is an undecorated window at the top left of it, and a remark says so; with
    ``refuse_larger``, a window of which screens show only a part is refused. ``stereo`` asks for left and right
    buffers; if the driver has none, the window opens without them and its ``stereo`` is false. ``bits`` asks for codes
    of 8 bits a channel or 10; if the driver has not 10, the window opens with 8, and a remark says so. ``identity``
    loads the identity as the monitor's gamma table until it is closed.
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
        monitors: Sequence[str] = (),
        refuse_larger: bool = False,
    ) -> None:
        session = GlfwSession()
        try:
            there = listed_monitors(glfw)
            placement = place_window(size_px, tuple(there), monitors, windowed=windowed)
            _refuse_larger(placement, refuse=refuse_larger)
            restored = session.restore_tables()
            monitor = there[placement.monitors[0]] if placement.full_screen else None
            window = _create_window(size_px, monitor, bits, stereo=stereo)
            if stereo and not window:
                window = _create_window(size_px, monitor, bits, stereo=False)
            if not window:
                raise PresentationError(f"the window could not be opened: {session.why()}")
            super().__init__(session, window, size_px, vsync=True, bits=bits)
            self.remarks += restored
            self.on_monitors, self.too_large = placement.monitors, placement.too_large
            if not placement.full_screen:
                glfw.set_window_pos(window, *(placement.monitors[0].position_px if placement.monitors else (0, 0)))
            if placement.remark:
                self.remarks += (placement.remark,)
            glfw.set_input_mode(window, glfw.CURSOR, glfw.CURSOR_HIDDEN)
            glfw.show_window(window)
            glfw.focus_window(window)
            session.complaints.clear()
            self.refresh_hz = placement.monitors[0].refresh_hz if placement.monitors else None
            self._settle()
            self._check_size(glfw.get_framebuffer_size(window))
            if identity:
                self._load_identity()
        except BaseException:
            session.close()
            raise


def _refuse_larger(placement: Placement, *, refuse: bool) -> None:
    if refuse and placement.too_large:
        remedy = (
            "connect or choose the rig's own monitor (`cyclopean doctor` lists those that are there, --monitor NUMBER "
        )
        remedy += (
            "takes one), set it to the panel's resolution, or name a rig for this screen; to go on although a part "
        )
        remedy += "is not seen, which every trial's record then states, add --wrong-screen"
        raise PresentationError(Finding((placement.remark or "").partition(";")[0], remedy=remedy))


def _create_window(size_px: Size, monitor: Any, bits: Bits, *, stereo: bool) -> Any:
    glfw.default_window_hints()
    hints = {**context_hints(bits), glfw.STEREO: int(stereo), glfw.VISIBLE: glfw.FALSE}
    if monitor is not None:
        hints[glfw.REFRESH_RATE] = glfw.get_video_mode(monitor).refresh_rate
    for hint, value in hints.items():
        glfw.window_hint(hint, value)
    return glfw.create_window(*size_px, _TITLE, monitor, None)


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

    def hear(self) -> None:
        """Do nothing: nothing is pressed here."""

    def poll_keys(self) -> tuple[KeyPress, ...]:
        """Return none."""
        return ()


_TITLES = ("cyclopean left", "cyclopean right")


class DualWindowSurface(GlfwSurface):
    """A window for each eye: the left eye's on the monitor that stands further left.

    Both contexts share their textures. All is drawn in the left window's context, the right eye's frame to a texture
    that the right window then copies. Only the left window waits for its screen, so that two screens that are out of
    step do not wait for one another. ``windowed`` puts two windows side by side on one screen.

    ``monitors`` names two others, the left eye's first. Raises PresentationError where fewer than two monitors have the
    panel's resolution.
    """

    backend = "window"
    windows = 2

    def __init__(
        self,
        size_px: Size,
        *,
        windowed: bool = False,
        bits: Bits = 8,
        identity: bool = False,
        monitors: Sequence[str] = (),
        refuse_larger: bool = False,
    ) -> None:
        session = GlfwSession()
        try:
            there = listed_monitors(glfw)
            both_px = 2 * size_px[0], size_px[1]
            placement = (
                place_window(both_px, tuple(there), monitors, windowed=True)
                if windowed
                else place_two_windows(size_px, tuple(there), monitors)
            )
            _refuse_larger(placement, refuse=refuse_larger)
            restored = session.restore_tables()
            left, right = (None, None) if windowed else (there[monitor] for monitor in placement.monitors)
            first = _create_for_eye(size_px, left, _TITLES[0], None, bits)
            second = first and _create_for_eye(size_px, right, _TITLES[1], first, bits)
            if not second:
                raise PresentationError(f"two windows could not be opened: {session.why()}")
            super().__init__(session, first, size_px, vsync=True, bits=bits)
            self._right = self.context.framebuffer([code_texture(self.context, size_px, self.bits)])
            self._second = _RightWindow(second, self._right, size_px)
            if (given := given_bits(bits, self._second.bits)) != (self.bits, self.remarks):
                raise PresentationError(
                    f"the right window has {given[0]} bits a channel and the left one {self.bits} (ask for 8)"
                )
            self.remarks += (*restored, *filter(None, (placement.remark,)))
            self.on_monitors, self.too_large = placement.monitors, placement.too_large
            glfw.make_context_current(first)
            corner_px = placement.monitors[0].position_px if placement.monitors else (0, 0)
            self._listen(second)
            for window, left_px in ((first, 0), (second, size_px[0])):
                if windowed:
                    glfw.set_window_pos(window, corner_px[0] + left_px, corner_px[1])
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


def _create_for_eye(size_px: Size, monitor: Any, title: str, shared: Any, bits: Bits) -> Any:
    glfw.default_window_hints()
    for hint, value in {**context_hints(bits), glfw.VISIBLE: glfw.FALSE}.items():
        glfw.window_hint(hint, value)
    return glfw.create_window(*size_px, title, monitor, shared)
