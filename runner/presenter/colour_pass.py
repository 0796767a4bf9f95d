"""The colour pass: a picture in XYZ to device codes, on the graphics card, once per picture and display model."""

from __future__ import annotations

from typing import Literal

import moderngl
import numpy as np

from devices.code_table import code_tables
from devices.display import DisplayModel
from runner.presenter.placing import squeezed_size
from runner.presenter.shaders import compile_program, shader_file

CODE_LEVELS = 255.0


def release_codes(codes: moderngl.Framebuffer) -> None:
    """Free what `ColourPass.run` returned, with its texture."""
    texture = codes.color_attachments[0]
    codes.release()
    texture.release()


class ColourPass:
    """The colour pass for one display model (DESIGN: linear = M⁻¹(XYZ − black), then a table per channel).

    ``squeeze`` is how many pixels of the picture, across and down, share one pixel of the codes: their XYZ is averaged.
    """

    def __init__(self, context: moderngl.Context, model: DisplayModel, squeeze: tuple[int, int] = (1, 1)) -> None:
        self._context = context
        self._squeeze = squeeze
        parts = [shader_file("table_fourth_root.glsl"), shader_file("colour_pass.frag")]
        self._program = compile_program(context, shader_file("area.vert"), parts, doubles=True)
        self._area = context.vertex_array(self._program, [])
        tables = code_tables(model)
        entries = tables.codes.shape[1]
        self._table = context.texture((entries, 3), 1, tables.codes.tobytes(), dtype="f4")
        self._table.filter = (moderngl.NEAREST, moderngl.NEAREST)
        lift = np.array([curve.lift for curve in model.curves])
        uniforms = {
            "linear_from_XYZ": tuple(model.linear_from_XYZ.T.ravel().tolist()),  # GL reads matrices by columns
            "black_XYZ": tuple(model.black_XYZ_cd_m2.tolist()),
            "lift": tuple(lift.tolist()),
            "scale": tuple((1.0 / (1.0 - lift)).tolist()),
            "picture_XYZ": 0,
            "code_table": 1,
            "box": squeeze,
        }
        for name, value in uniforms.items():
            self._program[name].value = value  # type: ignore[union-attr]

    def run(self, picture_XYZ: moderngl.Texture, dtype: Literal["f1", "f4"] = "f1") -> moderngl.Framebuffer:
        """Return a new framebuffer of the picture's codes: ``f1`` rounded to 8 bits, ``f4`` as computed.

        Its texture has the bottom row first, as windows have, so that a frame can be copied straight from it.
        """
        size_px = squeezed_size(picture_XYZ.size, self._squeeze)
        codes = self._context.texture(size_px, 4, dtype=dtype)
        codes.filter = (moderngl.NEAREST, moderngl.NEAREST)
        target = self._context.framebuffer([codes])
        before = self._context.fbo
        try:
            target.use()
            target.viewport = (0, 0, *size_px)
            self._context.disable(moderngl.BLEND)
            self._program["levels"].value = CODE_LEVELS if dtype == "f1" else 0.0  # type: ignore[union-attr]
            picture_XYZ.use(0)
            self._table.use(1)
            self._area.render(moderngl.TRIANGLE_STRIP, vertices=4)
        finally:
            before.use()
        return target

    def release(self) -> None:
        """Free the program and its table."""
        for held in (self._area, self._program, self._table):
            held.release()
