"""What every colour pass has: tables of inverse tone curves, and a framebuffer of codes that it draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray

from devices.compensation import Size
from devices.display import Curve, Eye, curve_table, entries_for, knot_tables
from documents import Finding
from runner.presenter.arithmetic import Reals
from runner.presenter.arithmetic_choice import arithmetic_of
from runner.presenter.bands import InBands, bands, to_the_end
from runner.presenter.depth import BITS, CODE_FORMATS, Bits, CodeFormat, code_texture, highest_code
from runner.presenter.dithering import Dithering
from runner.presenter.errors import PresentationError
from runner.presenter.shaders import Uniform, compile_program, set_uniform, shader_file


def release_codes(codes: moderngl.Framebuffer) -> None:
    """Free what a colour pass returned, with its texture."""
    texture = codes.color_attachments[0]
    codes.release()
    texture.release()


class CodePass:
    """A fragment shader that ends in codes, rounded or dithered: two programs, so that neither does the other's work.

    Its textures of XYZ are units 0 and up, the tables the units after them. ``eye`` chooses the dither mask.
    Codes have ``bits``; to round to 10, the tables of codes have twice the entries and so about a quarter of the error.
    ``between`` are files that the shader calls, and that call the encoding; ``more_tables`` are numbers (rows, texels,
    4) that these read. Curves that are tables are inverted piece by piece (`devices.display.knot_tables`), because they
    may be nearly flat; all others by one table
    (`devices.display.code_table`).
    """

    def __init__(
        self,
        context: moderngl.Context,
        shader: str,
        curves: Sequence[Curve],
        textures: Sequence[str],
        uniforms: Mapping[str, Uniform],
        dithering: Dithering | None = None,
        eye: Eye = "left",
        bits: Bits = 8,
        between: Sequence[str] = (),
        more_tables: Mapping[str, NDArray[np.float32]] | None = None,
    ) -> None:
        self._context = context
        if dithering is not None and dithering.levels is None:
            dithering = dithering.on_surface(bits)
        self._dithering = dithering
        self._format = CODE_FORMATS[bits]
        encoder = "encode.glsl" if dithering is None else "dither.glsl"
        by_knots = [curve.tabled for curve in curves]
        files = [encoder, *between, shader]
        tables = {name: _texels(context, texels) for name, texels in (more_tables or {}).items()}
        common: dict[str, Uniform] = {}
        if any(by_knots) and not all(by_knots):
            files.insert(0, "knots_or_table.glsl")
            common["by_knots"] = tuple(int(by_knot) for by_knot in by_knots)
        else:
            files.insert(0, "by_knots.glsl" if any(by_knots) else "by_table.glsl")
        if not all(by_knots):
            files.insert(0, "table_fourth_root.glsl")
            entries = entries_for(highest_code(bits), dithered=dithering is not None)
            tables["code_table"] = _code_table(context, curves, entries)
        if any(by_knots):
            files.insert(0, "knots.glsl")
            tables["knots"] = _knots(context, curves)
        parts = [shader_file(name) for name in files]
        self._program = compile_program(context, shader_file("area.vert"), parts, arithmetic_of(context).kind)
        self._area = context.vertex_array(self._program, [])
        lift = np.array([curve.lift for curve in curves])
        common |= {"lift": Reals(lift), "scale": Reals(1.0 / (1.0 - lift))}
        if dithering is not None:
            tables |= dithering.textures(context, curves)
            common["mask_shifts_px"] = dithering.shifts_px(eye)
        self._tables = tuple(tables.values())
        units = {name: unit for unit, name in enumerate([*textures, *tables])}
        for name, value in {**common, **units, **uniforms}.items():
            set_uniform(self._program, name, value)

    def draw(
        self, textures: Sequence[moderngl.Texture], size_px: Size, dtype: CodeFormat | None
    ) -> moderngl.Framebuffer:
        """Return a new framebuffer of codes, as `drawing` ends in."""
        return to_the_end(self.drawing(textures, size_px, dtype))

    def drawing(
        self,
        textures: Sequence[moderngl.Texture],
        size_px: Size,
        dtype: CodeFormat | None,
        band_px: int | None = None,
    ) -> InBands[moderngl.Framebuffer]:
        """Draw a new framebuffer of codes, in bands of about ``band_px`` pixels; all at once if None.

        ``f1`` has codes of 8 bits, ``rgb10_a2`` of 10, ``f4`` as computed, dithered ones in steps of 1/levels; None is
        the format of the pass's bits. Bands change no code: a pixel does not know which it is in.

        Its texture has the bottom row first, as windows have, so that a frame can be copied straight from it.

        Raises
        ------
        PresentationError
            If codes dithered to other levels than those of 8 or 10 bits are to be held in so many.
        """
        bits = BITS.get(dtype or self._format)
        if bits is None:
            codes = self._context.texture(size_px, 4, dtype="f4")
            codes.filter = (moderngl.NEAREST, moderngl.NEAREST)
        else:
            self._refuse_other_levels(bits)
            codes = code_texture(self._context, size_px, bits)
        target = self._context.framebuffer([codes])
        try:
            for first, rows in bands(size_px, band_px):
                if first:
                    yield
                self._draw_band(target, textures, first, rows, bits)
        except BaseException:
            release_codes(target)
            raise
        return target

    def release(self) -> None:
        """Free the program and its tables."""
        self._area.release()
        self._program.release()
        for table in self._tables:
            table.release()

    def _draw_band(
        self,
        target: moderngl.Framebuffer,
        textures: Sequence[moderngl.Texture],
        first: int,
        rows: int,
        bits: Bits | None,
    ) -> None:
        """Draw ``rows`` rows from ``first``, from below; all state is set, as frames may have been drawn in between.

        The viewport chooses the rows: gl_FragCoord counts from the corner of the framebuffer all the same.
        """
        before = self._context.fbo
        try:
            target.use()
            target.viewport = (0, first, target.width, rows)
            self._context.disable(moderngl.BLEND)
            if self._dithering is None:
                set_uniform(self._program, "levels", float(highest_code(bits)) if bits else 0.0)
            else:
                set_uniform(self._program, "height_px", target.height)
            for unit, texture in enumerate([*textures, *self._tables]):
                texture.use(unit)
            self._area.render(moderngl.TRIANGLE_STRIP, vertices=4)
        finally:
            before.use()

    def _refuse_other_levels(self, bits: Bits) -> None:
        if self._dithering is not None and self._dithering.highest_code != highest_code(bits):
            raise PresentationError(
                Finding(
                    f"codes dithered to 0..{self._dithering.highest_code} cannot be held in {bits} bits",
                    remedy=f"dither to {highest_code(bits)} levels, or draw to floats ('f4')",
                )
            )


def _texels(context: moderngl.Context, texels: NDArray[np.float32]) -> moderngl.Texture:
    rows, across, _ = texels.shape
    table = context.texture((across, rows), 4, texels.tobytes(), dtype="f4")
    table.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return table


def _knots(context: moderngl.Context, curves: Sequence[Curve]) -> moderngl.Texture:
    tables = knot_tables(curves)
    rows, pieces, numbers = tables.shape
    table = context.texture((pieces * numbers // 4, rows), 4, tables.tobytes(), dtype="f4")
    table.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return table


def _code_table(context: moderngl.Context, curves: Sequence[Curve], entries: int) -> moderngl.Texture:
    tables = np.stack([curve_table(curve, entries) for curve in curves]).astype(np.float32)
    table = context.texture((tables.shape[1], len(tables)), 1, tables.tobytes(), dtype="f4")
    table.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return table
