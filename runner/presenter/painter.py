"""Putting textures on a buffer, one texel to one pixel."""

from __future__ import annotations

import moderngl

from runner.presenter.rectangle import Rectangle
from runner.presenter.shaders import compile_program, shader_file


class Painter:
    """Draws pictures and words into rectangles of a framebuffer; places count from its top left corner."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        vertex = shader_file("area.vert")
        self._copy = compile_program(context, vertex, [shader_file("copy.frag")])
        self._text = compile_program(context, vertex, [shader_file("text.frag")])
        self._text["ink"].value = 1  # type: ignore[union-attr]
        self._areas = {program: context.vertex_array(program, []) for program in (self._copy, self._text)}

    def picture(
        self, target: moderngl.Framebuffer, codes: moderngl.Texture, place: Rectangle, shown: Rectangle
    ) -> None:
        """Copy the pixels of ``shown`` from ``codes``, whose top left corner is that of ``place``."""
        self._context.disable(moderngl.BLEND)
        codes.use(0)
        self._render(self._copy, target, place, shown)

    def words(
        self,
        target: moderngl.Framebuffer,
        coverage: moderngl.Texture,
        ink: moderngl.Texture,
        place: Rectangle,
        shown: Rectangle,
    ) -> None:
        """Draw words over what is there: ink + (1 − coverage) · below."""
        self._context.enable(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        coverage.use(0)
        ink.use(1)
        self._render(self._text, target, place, shown)
        self._context.disable(moderngl.BLEND)

    def release(self) -> None:
        """Free the programs."""
        for program, area in self._areas.items():
            area.release()
            program.release()

    def _render(
        self, program: moderngl.Program, target: moderngl.Framebuffer, place: Rectangle, shown: Rectangle
    ) -> None:
        if shown.is_empty:
            return
        height = target.height
        program["corner_px"].value = (place.left, height - 1 - place.top)  # type: ignore[union-attr]
        target.viewport = (shown.left, height - shown.top - shown.height, shown.width, shown.height)
        self._areas[program].render(moderngl.TRIANGLE_STRIP, vertices=4)
