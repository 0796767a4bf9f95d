"""What every colour pass has: tables of inverse tone curves, and a framebuffer of codes that it draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from devices.code_table import curve_table
from devices.tone_curve import ToneCurve
from runner.presenter.rectangle import Size
from runner.presenter.shaders import compile_program, shader_file

CODE_LEVELS = 255.0
Uniform = int | tuple[int, ...] | tuple[float, ...]


def by_columns(matrix: NDArray[np.float64]) -> tuple[float, ...]:
    """Return a matrix as OpenGL reads it."""
    return tuple(matrix.T.ravel().tolist())


def release_codes(codes: moderngl.Framebuffer) -> None:
    """Free what a colour pass returned, with its texture."""
    texture = codes.color_attachments[0]
    codes.release()
    texture.release()


class CodePass:
    """A fragment shader that ends in codes. Its textures of XYZ are units 0 and up, the tables the unit after them."""

    def __init__(
        self,
        context: moderngl.Context,
        shader: str,
        curves: Sequence[ToneCurve],
        textures: Sequence[str],
        uniforms: Mapping[str, Uniform],
    ) -> None:
        self._context = context
        parts = [shader_file("table_fourth_root.glsl"), shader_file("encode.glsl"), shader_file(shader)]
        self._program = compile_program(context, shader_file("area.vert"), parts, doubles=True)
        self._area = context.vertex_array(self._program, [])
        tables = np.stack([curve_table(curve) for curve in curves]).astype(np.float32)
        self._table = context.texture((tables.shape[1], len(tables)), 1, tables.tobytes(), dtype="f4")
        self._table.filter = (moderngl.NEAREST, moderngl.NEAREST)
        lift = np.array([curve.lift for curve in curves])
        common: dict[str, Uniform] = {
            "lift": tuple(lift.tolist()),
            "scale": tuple((1.0 / (1.0 - lift)).tolist()),
            "code_table": len(textures),
        }
        units = {name: unit for unit, name in enumerate(textures)}
        for name, value in {**common, **units, **uniforms}.items():
            self._program[name].value = value  # type: ignore[union-attr]

    def draw(
        self, textures: Sequence[moderngl.Texture], size_px: Size, dtype: Literal["f1", "f4"]
    ) -> moderngl.Framebuffer:
        """Return a new framebuffer of codes: ``f1`` rounded to 8 bits, ``f4`` as computed.

        Its texture has the bottom row first, as windows have, so that a frame can be copied straight from it.
        """
        codes = self._context.texture(size_px, 4, dtype=dtype)
        codes.filter = (moderngl.NEAREST, moderngl.NEAREST)
        target = self._context.framebuffer([codes])
        before = self._context.fbo
        try:
            target.use()
            target.viewport = (0, 0, *size_px)
            self._context.disable(moderngl.BLEND)
            self._program["levels"].value = CODE_LEVELS if dtype == "f1" else 0.0  # type: ignore[union-attr]
            for unit, texture in enumerate([*textures, self._table]):
                texture.use(unit)
            self._area.render(moderngl.TRIANGLE_STRIP, vertices=4)
        finally:
            before.use()
        return target

    def release(self) -> None:
        """Free the program and its table."""
        for held in (self._area, self._program, self._table):
            held.release()
