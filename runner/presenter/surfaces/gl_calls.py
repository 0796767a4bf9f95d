"""The few OpenGL calls that moderngl does not make: choosing a back buffer, reading it, and copying a part.

moderngl never calls glDrawBuffer on the default framebuffer, so the left and right back buffers of a stereo window
are chosen here, through the window's own loader. Its copy of framebuffers takes whole ones only.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from devices.compensation import Rectangle, Size
from runner.presenter.depth import Bits
from runner.presenter.errors import GraphicsError

if TYPE_CHECKING:
    import moderngl

Codes = NDArray[np.uint8] | NDArray[np.uint16]

FRONT = 0x0404
BACK = 0x0405
COLOUR_ATTACHMENT = 0x8CE0
FRONT_LEFT = 0x0400
BACK_LEFT = 0x0402
BACK_RIGHT = 0x0403

_STEREO = 0x0C33
_DOUBLEBUFFER = 0x0C32
_PACK_ALIGNMENT = 0x0D05
_RGB = 0x1907
_RGBA = 0x1908
_UNSIGNED_BYTE = 0x1401
_UNSIGNED_INT_2_10_10_10_REV = 0x8368
_FRAMEBUFFER = 0x8D40
_READ_FRAMEBUFFER = 0x8CA8
_CHANNEL_SIZES = (0x8212, 0x8213, 0x8214)  # GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE, green, blue
_COLOR_BUFFER_BIT = 0x4000
_NEAREST = 0x2600

_BYTES = ctypes.POINTER(ctypes.c_ubyte)
_INTEGERS = ctypes.POINTER(ctypes.c_int)
_SIGNATURES: tuple[tuple[str, tuple[Any, ...]], ...] = (
    ("glDrawBuffer", (ctypes.c_uint,)),
    ("glReadBuffer", (ctypes.c_uint,)),
    ("glGetBooleanv", (ctypes.c_uint, _BYTES)),
    ("glPixelStorei", (ctypes.c_uint, ctypes.c_int)),
    ("glBindFramebuffer", (ctypes.c_uint, ctypes.c_uint)),
    ("glBlitFramebuffer", (*(ctypes.c_int,) * 8, ctypes.c_uint, ctypes.c_uint)),
    ("glGetFramebufferAttachmentParameteriv", (*(ctypes.c_uint,) * 3, _INTEGERS)),
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

    def bits(self, attachment: int) -> int:
        """Return the bits of the channel that has fewest, of ``attachment`` of the framebuffer that is bound.

        0 if the driver does not report it.
        """
        sizes = []
        for name in _CHANNEL_SIZES:
            value = ctypes.c_int(0)
            self._calls["glGetFramebufferAttachmentParameteriv"](_FRAMEBUFFER, attachment, name, ctypes.pointer(value))
            sizes.append(value.value)
        return min(sizes)

    def draw_to(self, buffer: int) -> None:
        """Draw to ``buffer`` of the default framebuffer from now on."""
        self._calls["glDrawBuffer"](buffer)

    def read_from(self, buffer: int, size_px: Size, bits: Bits = 8) -> Codes:
        """Return the codes (height, width, 3) of ``buffer`` of the bound framebuffer, top row first.

        Codes of 8 bits are uint8; codes of 10 bits are uint16 in 0..1023, read in the layout that the buffer has.
        """
        width, height = size_px
        if bits == 10:
            return self._read_10_bits(buffer, size_px)
        codes = np.empty((height, width, 3), dtype=np.uint8)
        self._calls["glReadBuffer"](buffer)
        self._calls["glPixelStorei"](_PACK_ALIGNMENT, 1)
        self._calls["glReadPixels"](0, 0, width, height, _RGB, _UNSIGNED_BYTE, codes.ctypes.data)
        return codes[::-1].copy()

    def copy(
        self,
        source: moderngl.Framebuffer,
        target: moderngl.Framebuffer,
        place: Rectangle,
        shown: Rectangle,
        mirror: tuple[bool, bool] = (False, False),
    ) -> None:
        """Copy pixels 1:1 from ``source``, which stands at ``place``, into ``shown`` of ``target``.

        ``target`` is bound for drawing. Both rectangles count from its top left corner; OpenGL counts from below. A
        mirrored source stands in ``place`` reversed (left to right, top to bottom).
        """
        left, low = shown.left, target.height - shown.top - shown.height
        from_left, from_low = left - place.left, place.top + place.height - shown.top - shown.height
        to_left, to_low = from_left + shown.width, from_low + shown.height
        if mirror[0]:
            from_left, to_left = place.width - from_left, place.width - to_left
        if mirror[1]:
            from_low, to_low = place.height - from_low, place.height - to_low
        taken = from_left, from_low, to_left, to_low
        given = left, low, left + shown.width, low + shown.height
        self._calls["glBindFramebuffer"](_READ_FRAMEBUFFER, source.glo)
        self._calls["glBlitFramebuffer"](*taken, *given, _COLOR_BUFFER_BIT, _NEAREST)
        self._calls["glBindFramebuffer"](_READ_FRAMEBUFFER, target.glo)

    def _boolean(self, name: int) -> bool:
        value = ctypes.c_ubyte(0)
        self._calls["glGetBooleanv"](name, ctypes.pointer(value))
        return value.value != 0

    def _read_10_bits(self, buffer: int, size_px: Size) -> NDArray[np.uint16]:
        width, height = size_px
        packed = np.empty((height, width), dtype=np.uint32)
        self._calls["glReadBuffer"](buffer)
        self._calls["glPixelStorei"](_PACK_ALIGNMENT, 4)
        self._calls["glReadPixels"](0, 0, width, height, _RGBA, _UNSIGNED_INT_2_10_10_10_REV, packed.ctypes.data)
        channels = [packed[::-1] >> shift & 1023 for shift in (0, 10, 20)]
        return np.stack(channels, axis=-1).astype(np.uint16)
