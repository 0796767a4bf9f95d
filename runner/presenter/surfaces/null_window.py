"""A window without a screen: glfw's null platform with its OSMesa context. No display server, no graphics card."""

from __future__ import annotations

import glfw

from runner.ports import KeyPress, WindowClosed
from runner.presenter.depth import Bits
from runner.presenter.errors import PresentationError
from runner.presenter.pointer import Pointer
from runner.presenter.rectangle import Size
from runner.presenter.surfaces.glfw_session import GlfwSession
from runner.presenter.surfaces.glfw_surface import GlfwSurface, context_hints


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
