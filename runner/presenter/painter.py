"""Putting pictures and words on a buffer, one texel to one pixel."""

from __future__ import annotations

import moderngl

from runner.presenter.rectangle import Rectangle
from runner.presenter.shaders import compile_program, shader_file
from runner.presenter.surfaces.gl_calls import GlCalls


class Painter:
    """Draws into rectangles of a framebuffer that is bound; places count from its top left corner."""

    def __init__(self, context: moderngl.Context, calls: GlCalls) -> None:
        self._context = context
        self._calls = calls
        self._text = compile_program(context, shader_file("area.vert"), [shader_file("text.frag")])
        self._text["ink"].value = 1  # type: ignore[union-attr]
        self._area = context.vertex_array(self._text, [])

    def picture(
        self, target: moderngl.Framebuffer, codes: moderngl.Framebuffer, place: Rectangle, shown: Rectangle
    ) -> None:
        """Copy the pixels of ``shown`` from ``codes``, which stands at ``place``."""
        if not shown.is_empty:
            self._calls.copy(codes, target, place, shown)

    def words(
        self,
        target: moderngl.Framebuffer,
        coverage: moderngl.Texture,
        ink: moderngl.Texture,
        place: Rectangle,
        shown: Rectangle,
    ) -> None:
        """Draw words, which stand at ``place``, over what is there: ink + (1 − coverage) · below."""
        if shown.is_empty:
            return
        self._text["corner_px"].value = (place.left, target.height - 1 - place.top)  # type: ignore[union-attr]
        target.viewport = (shown.left, target.height - shown.top - shown.height, shown.width, shown.height)
        self._context.enable(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        coverage.use(0)
        ink.use(1)
        self._area.render(moderngl.TRIANGLE_STRIP, vertices=4)
        self._context.disable(moderngl.BLEND)

    def release(self) -> None:
        """Free the program."""
        self._area.release()
        self._text.release()
