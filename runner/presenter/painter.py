"""Putting pictures and words on a buffer, one texel to one pixel."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from devices.compensation.eye_view import Rectangle
from runner.presenter.modes.mode import EyeArea, Weave
from runner.presenter.shaders import compile_program, set_uniform, shader_file
from runner.presenter.surfaces.gl_calls import GlCalls


class Painter:
    """Draws into rectangles of a framebuffer that is bound; places count from its top left corner.

    ``place`` is where the whole of a thing stands, ``shown`` the part that is seen. A picture is copied by the driver;
    one whose pixels are woven with the other eye's is drawn through a mask.
    """

    def __init__(self, context: moderngl.Context, calls: GlCalls) -> None:
        self._context = context
        self._calls = calls
        self._text = _program(context, "text.frag")
        set_uniform(self._text, "ink", 1)
        self._picture = _program(context, "picture.frag")
        self._text_area = context.vertex_array(self._text, [])
        self._picture_area = context.vertex_array(self._picture, [])

    def picture(
        self,
        target: moderngl.Framebuffer,
        codes: moderngl.Framebuffer,
        place: Rectangle,
        shown: Rectangle,
        area: EyeArea,
    ) -> None:
        """Copy a picture's codes, whose bottom row is first."""
        if shown.is_empty:
            return
        if area.weave is None:
            self._calls.copy(codes, target, place, shown, area.mirror)
            return
        low = target.height - place.top - place.height
        _aim(self._picture, target, shown, area.weave)
        across = _axis(place.left, place.width, reverse=area.mirror[0])
        up = _axis(low, place.height, reverse=area.mirror[1])
        _map(self._picture, across, up)
        codes.color_attachments[0].use(0)  # type: ignore[union-attr]  # codes are in a texture, not a renderbuffer
        self._picture_area.render(moderngl.TRIANGLE_STRIP, vertices=4)

    def words(
        self,
        target: moderngl.Framebuffer,
        coverage: moderngl.Texture,
        ink: moderngl.Texture,
        place: Rectangle,
        shown: Rectangle,
        area: EyeArea,
    ) -> None:
        """Draw words, whose top row is first, over what is there: ink + (1 − coverage) · below."""
        if shown.is_empty:
            return
        low = target.height - place.top - place.height
        _aim(self._text, target, shown, area.weave)
        across = _axis(place.left, place.width, reverse=area.mirror[0])
        up = _axis(low, place.height, reverse=not area.mirror[1])
        _map(self._text, across, up)
        self._context.enable(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        coverage.use(0)
        ink.use(1)
        self._text_area.render(moderngl.TRIANGLE_STRIP, vertices=4)
        self._context.disable(moderngl.BLEND)

    def fill(self, target: moderngl.Framebuffer, place: Rectangle, codes: tuple[float, float, float]) -> None:
        """Fill ``place`` with codes in 0..1, as they are."""
        low = target.height - place.top - place.height
        if not place.is_empty:
            target.clear(*codes, 1.0, viewport=(place.left, low, place.width, place.height))

    def release(self) -> None:
        """Free the programs."""
        for held in (self._text_area, self._picture_area, self._text, self._picture):
            held.release()


def _program(context: moderngl.Context, name: str) -> moderngl.Program:
    return compile_program(context, shader_file("area.vert"), [shader_file("weave.glsl"), shader_file(name)])


def _aim(program: moderngl.Program, target: moderngl.Framebuffer, shown: Rectangle, weave: Weave | None) -> None:
    target.viewport = (shown.left, target.height - shown.top - shown.height, shown.width, shown.height)
    woven = (weave.column_step, weave.row_step, weave.start) if weave else (0, 0, 0)
    set_uniform(program, "weave", woven)
    set_uniform(program, "height_px", target.height)


def _axis(first: int, count: int, *, reverse: bool) -> tuple[int, int]:
    """Return (origin, direction) of the texels 0 to ``count`` that stand on the pixels from ``first``."""
    return (first + count - 1, -1) if reverse else (-first, 1)


def _map(program: moderngl.Program, across: Sequence[int], up: Sequence[int]) -> None:
    set_uniform(program, "origin", (across[0], up[0]))
    set_uniform(program, "direction", (across[1], up[1]))
