"""How many bits a channel's code has: 8 or 10, what a surface was given of those asked for, and a texture of codes."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

from devices.compensation import Size
from documents import Finding
from runner.presenter.errors import PresentationError

if TYPE_CHECKING:
    import moderngl

Bits = Literal[8, 10]
# What a colour pass writes: codes of 8 bits, codes of 10, or 32-bit floats as computed.
CodeFormat = Literal["f1", "rgb10_a2", "f4"]
CODE_FORMATS: Mapping[Bits, CodeFormat] = MappingProxyType({8: "f1", 10: "rgb10_a2"})
BITS: Mapping[CodeFormat, Bits] = MappingProxyType({"f1": 8, "rgb10_a2": 10})

_GL_RGB10_A2 = 0x8059


def highest_code(bits: Bits) -> int:
    """Return the code of full drive: 255 or 1023."""
    return (1 << bits) - 1


def code_texture(context: moderngl.Context, size_px: Size, bits: Bits) -> moderngl.Texture:
    """Return a new texture that holds codes of ``bits`` exactly, 4 bytes a pixel: RGBA8, or RGB10_A2."""
    internal_format = _GL_RGB10_A2 if bits == 10 else None
    texture = context.texture(size_px, 4, dtype="f1", internal_format=internal_format)
    texture.filter = (context.NEAREST, context.NEAREST)
    return texture


def given_bits(asked: Bits, framebuffer_bits: int) -> tuple[Bits, tuple[str, ...]]:
    """Return the bits of the codes on a framebuffer of ``framebuffer_bits`` a channel, and remarks on them.

    A framebuffer of too few bits for 10 gets codes of 8, as does one whose bits the driver does not report (0), and one
    of more bits than asked shows the codes asked.

    Raises
    ------
    PresentationError
        If other bits are asked than 8 or 10, or the framebuffer has fewer than 8.
    """
    if asked not in (8, 10):
        raise PresentationError(Finding(f"codes of {asked} bits cannot be shown", remedy="ask for 8 or 10"))
    if framebuffer_bits == 0:
        return 8, ("the driver does not report how many bits its framebuffer has: codes have 8",)
    if framebuffer_bits < 8:
        raise PresentationError(
            Finding(
                f"the driver gives a framebuffer of {framebuffer_bits} bits a channel, and codes have at least 8",
                remedy="set the screen to a depth of 24 or 30",
            )
        )
    if framebuffer_bits < asked:
        return 8, (f"10 bits a channel were asked for, and the driver gives {framebuffer_bits}: codes have 8 bits",)
    if framebuffer_bits > asked:
        return asked, (f"codes have {asked} bits, on a framebuffer of {framebuffer_bits} bits a channel",)
    return asked, ()
