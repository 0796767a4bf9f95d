"""The few OpenGL calls that moderngl does not make: choosing a back buffer, and reading it.

moderngl never calls glDrawBuffer on the default framebuffer, so the left and right back buffers of a stereo window
are chosen here, through the window's own loader.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

from runner.presenter.errors import GraphicsError
from runner.presenter.rectangle import Size
from runner.presenter.surfaces.surface import Codes

FRONT = 0x0404
BACK = 0x0405
BACK_LEFT = 0x0402
BACK_RIGHT = 0x0403

_STEREO = 0x0C33
_DOUBLEBUFFER = 0x0C32
_PACK_ALIGNMENT = 0x0D05
_RGB = 0x1907
_UNSIGNED_BYTE = 0x1401

_BYTES = ctypes.POINTER(ctypes.c_ubyte)
_SIGNATURES: tuple[tuple[str, tuple[Any, ...]], ...] = (
    ("glDrawBuffer", (ctypes.c_uint,)),
    ("glReadBuffer", (ctypes.c_uint,)),
    ("glGetBooleanv", (ctypes.c_uint, _BYTES)),
    ("glPixelStorei", (ctypes.c_uint, ctypes.c_int)),
    ("glReadPixels", (*(ctypes.c_int,) * 4, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p)),
)


class GlCalls:
    """Calls into the context that ``loader`` belongs to; ``loader`` gives a function's address, 0 if unknown."""

    def __init__(self, loader: Callable[[str], int]) -> None:
        self._calls = {}
        for name, arguments in _SIGNATURES:
            address = loader(name)
            if not address:
                raise GraphicsError(f"the graphics driver has no {name}")
            self._calls[name] = ctypes.CFUNCTYPE(None, *arguments)(address)

    def has_stereo(self) -> bool:
        """Whether the default framebuffer has left and right buffers (GL_STEREO)."""
        return self._boolean(_STEREO)

    def has_back_buffer(self) -> bool:
        """Whether the default framebuffer is double-buffered (GL_DOUBLEBUFFER)."""
        return self._boolean(_DOUBLEBUFFER)

    def draw_to(self, buffer: int) -> None:
        """Draw to ``buffer`` of the default framebuffer from now on."""
        self._calls["glDrawBuffer"](buffer)

    def read_from(self, buffer: int, size_px: Size) -> Codes:
        """Return the codes (height, width, 3) of ``buffer`` of the default framebuffer, top row first."""
        width, height = size_px
        codes = np.empty((height, width, 3), dtype=np.uint8)
        self._calls["glReadBuffer"](buffer)
        self._calls["glPixelStorei"](_PACK_ALIGNMENT, 1)
        self._calls["glReadPixels"](0, 0, width, height, _RGB, _UNSIGNED_BYTE, codes.ctypes.data)
        return codes[::-1].copy()

    def _boolean(self, name: int) -> bool:
        value = ctypes.c_ubyte(0)
        self._calls["glGetBooleanv"](name, ctypes.pointer(value))
        return value.value != 0
