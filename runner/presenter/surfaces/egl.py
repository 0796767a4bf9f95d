"""An offscreen surface without a window: on EGL, which needs no display server; on Windows and macOS on WGL and CGL."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Mapping
from typing import Any, Self

import glcontext
import moderngl
import numpy as np

from analysis.records import SurfaceFacts
from devices.compensation import Size
from devices.display import EYES, Eye
from runner.ports import KeyPress, WindowClosed
from runner.presenter.arithmetic_choice import arithmetic_in_words
from runner.presenter.depth import Bits, code_texture, given_bits
from runner.presenter.errors import PresentationError
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces import gl_calls
from runner.presenter.surfaces.gamma_tables import LoadedTable
from runner.presenter.surfaces.gl_calls import Codes, GlCalls
from runner.presenter.surfaces.surface import Buffer

_GL_DITHER = 0x0BD0
_GL, _LIBRARY = "libGL.so.1", "libEGL.so.1"


def _open_context() -> Any:
    """Return a context of its own, with a loader of OpenGL functions, as moderngl takes it."""
    if sys.platform == "linux":  # which asks a program for each library that it is not told
        return glcontext.get_backend_by_name("egl")(mode="standalone", glversion=330, libgl=_GL, libegl=_LIBRARY)
    return glcontext.default_backend()(mode="standalone", glversion=330)


def _leave_thread() -> None:
    """Release EGL's context in this thread, which moderngl leaves current; until then no window can make its own."""
    if sys.platform == "linux":
        ctypes.CDLL(_LIBRARY).eglReleaseThread()


class EglSurface:
    """A framebuffer on an offscreen context of its own, two in place of two windows. It has no keys.

    ``bits`` asks for codes of 8 bits a channel or 10; what there is, its ``bits`` and ``facts`` say.
    """

    stereo = False

    def __init__(self, size_px: Size, windows: int = 1, bits: Bits = 8) -> None:
        self.size_px = size_px
        self.windows = windows
        self.position_px = (0, 0)
        self.on_damage: Callable[[], object] | None = None
        self.on_move: Callable[[], object] | None = None
        self.on_wake: Callable[[], object] | None = None
        self.on_frame: Callable[[], object] | None = None
        self.on_point: Callable[[], object] | None = None
        self.on_window: Callable[[str, Mapping[str, Any]], object] | None = None
        self.on_lost: Callable[[], object] | None = None
        try:
            loader = _open_context()
            self.context = moderngl.create_context(standalone=True, context=loader)
        except Exception as error:  # the loader raises bare Exceptions
            install = "libegl1 and libgl1-mesa-dri" if sys.platform == "linux" else "the graphics card's driver"
            raise PresentationError(
                f"there is no OpenGL 3.3 context without a window: {error} (install {install}, or take another backend)"
            ) from error
        limit = int(self.context.info["GL_MAX_RENDERBUFFER_SIZE"])
        if max(size_px) > limit or min(size_px) < 1:
            self.context.release()
            raise PresentationError(
                f"a surface of {size_px[0]} × {size_px[1]} px cannot be made; this driver goes to {limit} × {limit}"
            )
        self.calls = GlCalls(loader.load_opengl_function)
        self.context.disable_direct(_GL_DITHER)
        self._colour = _attachment(self.context, size_px, bits)
        self._framebuffer = self.context.framebuffer([self._colour])
        self._framebuffer.use()
        try:
            self.bits, self._remarks = given_bits(bits, self.calls.bits(gl_calls.COLOUR_ATTACHMENT))
        except PresentationError:
            self.close()
            raise
        self._framebuffers = {Buffer.BACK: self._framebuffer}
        if windows == 2:
            self._second = self.context.framebuffer([_attachment(self.context, size_px, bits)])
            self._framebuffers |= {Buffer.BACK_LEFT: self._framebuffer, Buffer.BACK_RIGHT: self._second}
        self._framebuffer.use()

    @property
    def facts(self) -> SurfaceFacts:
        """What to record of it."""
        info = self.context.info
        return SurfaceFacts(
            backend={"linux": "egl", "win32": "wgl", "darwin": "cgl"}.get(sys.platform, sys.platform),
            display_server="none",
            vendor=str(info["GL_VENDOR"]),
            renderer=str(info["GL_RENDERER"]),
            gl_version=str(info["GL_VERSION"]),
            size_px=self.size_px,
            stereo=False,
            vsync=False,
            remarks=self._remarks,
            bits=self.bits,
            arithmetic=arithmetic_in_words(self.context),
        )

    def keyboard_labels(self) -> Mapping[str, str]:
        """Return nothing: there is no keyboard."""
        return {}

    def gamma_tables(self) -> Mapping[Eye, LoadedTable]:
        """Return that there is no monitor."""
        return dict.fromkeys(EYES, LoadedTable.unknown("it was drawn without a window"))

    def target(self, buffer: Buffer) -> moderngl.Framebuffer:
        """Bind the framebuffer and return it."""
        framebuffer = self._of(buffer)
        framebuffer.use()
        return framebuffer

    def swap(self) -> None:
        """Wait until the graphics card is done."""
        self.context.finish()

    def read(self, eye: Eye | None = None) -> Codes:
        """Return the codes (height, width, 3), top row first."""
        framebuffer = self._of(Buffer.of(eye))
        if self.bits == 10:
            framebuffer.use()
            return self.calls.read_from(gl_calls.COLOUR_ATTACHMENT, self.size_px, 10)
        width, height = self.size_px
        data = framebuffer.read(components=3, alignment=1)
        return np.frombuffer(data, dtype=np.uint8).reshape(height, width, 3)[::-1].copy()

    def wait_key(self) -> KeyPress:
        """Raise WindowClosed: nobody can press a key here."""
        raise WindowClosed("an offscreen surface has no keys")

    def follow_mouse(self, pointer: Pointer | None) -> None:
        """Do nothing: there is no mouse here."""

    def wake(self) -> None:
        """Do nothing: nobody sleeps here."""

    def hear(self) -> None:
        """Do nothing: nothing is pressed here."""

    def poll_keys(self) -> tuple[KeyPress, ...]:
        """Return none."""
        return ()

    def close(self) -> None:
        """Release the context with all that it holds."""
        self._framebuffer.release()
        self._colour.release()
        self.context.release()
        _leave_thread()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _of(self, buffer: Buffer) -> moderngl.Framebuffer:
        if buffer not in self._framebuffers:
            raise PresentationError(f"an offscreen surface has no buffer '{buffer.value}': it is not stereo")
        return self._framebuffers[buffer]


def _attachment(context: moderngl.Context, size_px: Size, bits: Bits) -> moderngl.Texture | moderngl.Renderbuffer:
    return code_texture(context, size_px, 10) if bits == 10 else context.renderbuffer(size_px, 4)
