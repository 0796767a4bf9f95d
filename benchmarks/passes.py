"""The passes over a frame: colour, channels that act on each other, crosstalk, dithering, a graphics card's times.

The colour pass: run time against error for each way to invert a tone curve, and what a frame costs after it.

Errors are the largest over the picture, in 8-bit codes before rounding, against the float64 model; times are those of
one pass over 1920 × 1080 pixels, or of one frame, until the driver says that it is done.

The colour pass for channels that act on each other: run time against error for each way to undo them.

The display is PLVC fitted to a simulated liquid crystal one. Errors are the largest over the picture, in 8-bit codes
before rounding, against the float64 model; times are those of one pass over 960 × 540 pixels, until the driver says
that it is done. Beside it, the one-table pass of the same display without drift and mixtures.

Crosstalk cancelled and a panel evened out: in the pass, on the graphics card, beside float64 on the processor.

Times are of both eyes' codes of one pair of 1344 × 1000 pixels (1.3 million), from XYZ at hand (in memory, or uploaded
for the pass) to codes of 8 bits. On the processor that is the solution in NumPy, then a float32 picture, its upload and
the plain colour pass: what a presenter would do that cannot compensate. The error is the largest of any channel of any
pixel before rounding, in codes of 8 bits, against float64 throughout; at gamma 2.9 in the note.

A leak that takes light away is cancelled as it is, or clipped at 0 and taken for none: on the processor, 100,000
colours that both ways can show. The error is the largest difference between what is seen and what was asked, as the
codes of 8 bits that would give them.

Absolute times with the driver that EGL gives: a steady frame, a switch, the colour pass, and an upload.

It needs EGL and nothing else: no window, no X server. Ratios are in `colour_pass`; what a frame takes depends on the
card and its driver, which stand in the title and beside every time. Software OpenGL is measured likewise and called so.

Dithering to 8 bits, in the colour pass to 10 too: run time on one picture against the error of the mean light.

The error is the largest bias of luminance, relative, over greys from code 1.5 of 8 bits to full light: mean over one
period of the mask against what was asked. Times are for a 512 × 512 picture: of NumPy, and of the colour pass on the
EGL driver that this machine gives, from XYZ on the graphics card to codes there.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any
from unittest.mock import patch

import moderngl
import numpy as np
from curves import Row, program, row, seconds, sized, times_faster
from moderngl import Context, Framebuffer, Texture
from numpy.typing import NDArray
from promises import Promise, times_as_fast, worst

from analysis.records import SurfaceFacts
from devices.characterise.parametric import fit_parametric
from devices.characterise.patches import patches
from devices.characterise.table_fit import fit_plvc, fit_table
from devices.characterise.thesis import table_c1_codes
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.compensate import Correction
from devices.compensation.crosstalk_cancel import cancel_crosstalk, channel_crosstalk, seen_XYZ
from devices.compensation.dither import ENTRIES, dither_codes, dither_tables, dither_thresholds, tabled_dither_codes
from devices.compensation.eye_view import Rectangle
from devices.display.crosstalk import Crosstalk
from devices.display.curves import TableCurve, ToneCurve, curve_table, knot_tables
from devices.display.display_file import EYES, Eye, EyeModels, read_display
from devices.display.gain_map import GainMap
from devices.display.model import DisplayModel
from devices.display.plvc import MOST_STEPS, Plvc
from devices.display.residual import Residual
from documents.arrays import Floats
from runner.presenter.arithmetic import Arithmetic, Real3x3, Reals
from runner.presenter.arithmetic_choice import VARIABLE
from runner.presenter.colour_pass import ColourPass, channel_interaction, release_codes
from runner.presenter.compensated_pass import CORNER, CompensatedPass
from runner.presenter.depth import Bits, highest_code
from runner.presenter.dithering import Dithering
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.shaders import Part, Uniform, compile_program, set_uniform, shader_file
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import Buffer, Surface
from runner.scene import Picture, Scene
from stimuli.pictures.stereo_image import StereoImage
from tests.example_displays import liquid_crystal_XYZ, noisy

TITLE = "Colour pass: run time against error"
SIZE_PX = sized((1920, 1080), (192, 108))
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
GAMMA = 2.4
HARD_GAMMA = 2.9
TABLE_ENTRIES = sized((256, 1024, 4096), (1024,))

CLOSED_FORM = """
uniform float gamma;
float code_by_table(int channel, Real light) {
    return pow(max(float_of(light), 0.0), 1.0 / gamma);
}
"""
COPY = """
uniform sampler2D pixels;
out vec4 pixel;
void main() { pixel = texelFetch(pixels, ivec2(gl_FragCoord.xy), 0); }
"""
# The file's own function, with another root in place of the fourth.
ROOTS = {"uniform": (1, "light"), "square root": (2, "sqrt(light)"), "fourth root": (4, "sqrt(sqrt(light))")}


@dataclass(frozen=True, slots=True)
class Variant:
    """One way to do the pass. ``inverse`` is its GLSL; ``root`` and ``entries`` say what table it reads, if any."""

    series: str
    parameter: str
    inverse: Part
    root: int = 0
    entries: int = 0
    half: bool = False
    arithmetic: Arithmetic | None = Arithmetic.DOUBLES  # None is 32 bits


def variants() -> list[Variant]:
    """Return the closed form, tables of three sizes under three spacings, half floats, and other arithmetic."""
    name, fourth = shader_file("table_fourth_root.glsl")
    found = [
        Variant("closed form", "pow", ("closed_form.glsl", CLOSED_FORM)),
        Variant("closed form, 32-bit matrix", "pow", ("closed_form.glsl", CLOSED_FORM), arithmetic=None),
    ]
    for spacing, (root, expression) in ROOTS.items():
        inverse = name, fourth.replace("sqrt(sqrt(light))", expression)
        found += [Variant(f"{spacing}, float32", f"{n} entries", inverse, root, n) for n in TABLE_ENTRIES]
    found += [Variant("fourth root, half", f"{n} entries", (name, fourth), 4, n, half=True) for n in TABLE_ENTRIES]
    found.append(Variant("fourth root, 32-bit matrix", "1024 entries", (name, fourth), 4, 1024, arithmetic=None))
    for kind in (Arithmetic.TWO_FLOATS, Arithmetic.GUARDED):
        found.append(Variant(f"fourth root, {kind.value}", "1024 entries", (name, fourth), 4, 1024, arithmetic=kind))
    return found


def in_turn(work: dict[str, Callable[[], object]], rounds: int = 9) -> dict[str, float]:
    """Return each work's median time in seconds.

    All of them are timed once a round, so that none has a quieter machine, in a new random order, so that none always
    follows the same other, and each directly after a run of its own, so that none finds the caches as another left
    them.
    """
    rounds = sized(rounds, 1)
    times: dict[str, list[float]] = {name: [] for name in work}
    order = random.Random(0)
    for _ in range(rounds):
        for name, once in order.sample(list(work.items()), len(work)):
            once()
            start_s = perf_counter()
            once()
            times[name].append(perf_counter() - start_s)
    return {name: median(taken) for name, taken in times.items()}


def model(gamma: float) -> DisplayModel:
    """Return a display of the thesis's primaries with one gamma and no black."""
    curve = ToneCurve(gamma=gamma)
    return DisplayModel(np.zeros(3), PRIMARIES, (curve, curve, curve))


def test_picture(display: DisplayModel) -> NDArray[np.float32]:
    """XYZ of SIZE_PX: a third each of neutral and primary ramps from 1e-7 cd/m² to above white, and random codes."""
    width, height = SIZE_PX
    third = width * height // 3
    white = display.white_XYZ_cd_m2
    ramp = np.geomspace(1e-7, 1.5 * white[1], third)[:, np.newaxis]
    primary = PRIMARIES.T[np.arange(third) % 3]
    parts = [white / white[1] * ramp, primary / primary[:, 1:2] * ramp]
    parts.append(display.xyz(np.random.default_rng(0).random((third, 3))))
    return np.concatenate(parts).reshape(height, width, 3).astype(np.float32)


def _in_singles() -> Part:
    """Return the arithmetic of the colour passes in 32 bits."""
    name, text = shader_file(Arithmetic.DOUBLES.file)
    return name, text.replace("dmat3", "mat3").replace("dvec3", "vec3").replace("Real double", "Real float")


class Pass:
    """A variant compiled for a display, like runner.presenter.colour_pass.ColourPass."""

    def __init__(self, context: moderngl.Context, variant: Variant, display: DisplayModel) -> None:
        after = ("by_table.glsl", "encode.glsl", "mean_xyz.glsl", "colour_pass.frag")
        parts = [variant.inverse, *(shader_file(name) for name in after)]
        if variant.arithmetic is None:
            parts.insert(0, _in_singles())
        self._program = compile_program(context, shader_file("area.vert"), parts, variant.arithmetic)
        self._area = context.vertex_array(self._program, [])
        self._table: moderngl.Texture | None = None
        uniforms: dict[str, Uniform] = {
            "linear_from_XYZ": Real3x3(display.linear_from_XYZ),
            "black_light": Reals(np.zeros(3)),
            "lift": Reals(np.zeros(3)),
            "scale": Reals(np.ones(3)),
            "box": (1, 1),
            "picture_XYZ": 0,
        }
        if variant.entries:
            kind = np.float16 if variant.half else np.float32
            table = np.stack([curve_table(curve, variant.entries, variant.root) for curve in display.curves])
            self._table = context.texture(
                (variant.entries, 3), 1, table.astype(kind).tobytes(), alignment=1, dtype="f2" if variant.half else "f4"
            )
            uniforms["code_table"] = 1
        else:
            uniforms["gamma"] = display.curves[0].gamma
        for name, value in uniforms.items():
            set_uniform(self._program, name, value)

    def draw(self, picture: moderngl.Texture, target: moderngl.Framebuffer, *, levels: float) -> None:
        """Draw the picture's codes to ``target``."""
        set_uniform(self._program, "levels", levels)
        target.use()
        picture.use(0)
        if self._table is not None:
            self._table.use(1)
        self._area.render(moderngl.TRIANGLE_STRIP, vertices=4)


def error_codes(surface: Surface, variant: Variant, gamma: float) -> float:
    """Return the largest error of ``variant`` at ``gamma``, in 8-bit codes before rounding."""
    context = surface.context
    display = model(gamma)
    XYZ = test_picture(display)
    picture = context.texture(SIZE_PX, 3, XYZ, alignment=1, dtype="f4")
    codes = context.texture(SIZE_PX, 4, dtype="f4")
    target = context.framebuffer([codes])
    Pass(context, variant, display).draw(picture, target, levels=0.0)
    shown = np.frombuffer(codes.read(), np.float32).reshape(SIZE_PX[1], SIZE_PX[0], 4)[::-1, :, :3]
    error = float(np.abs(shown - display.code(XYZ)).max() * 255.0)
    surface.target(Buffer.BACK)  # what is released must not stay bound
    for held in (target, codes, picture):
        held.release()
    return error


def pass_rows(surface: Surface) -> list[dict[str, object]]:
    """Time every variant on the same picture."""
    context = surface.context
    display = model(GAMMA)
    picture = context.texture(SIZE_PX, 3, test_picture(display), alignment=1, dtype="f4")
    target = context.framebuffer([context.texture(SIZE_PX, 4)])
    found = variants()
    work: dict[str, Callable[[], object]] = {}
    for variant in found:
        compiled = Pass(context, variant, display)

        def once(compiled: Pass = compiled) -> None:
            compiled.draw(picture, target, levels=255.0)
            context.finish()

        work[f"{variant.series}, {variant.parameter}"] = once
    ours = ColourPass(context, display)

    def whole() -> None:
        surface.target(Buffer.BACK)
        release_codes(ours.run(picture))
        context.finish()

    work["as shipped"] = whole
    times = in_turn(work)
    rows: list[dict[str, object]] = []
    for variant in found:
        hard = error_codes(surface, variant, HARD_GAMMA)
        rows.append(
            row(
                variant.series,
                variant.parameter,
                times[f"{variant.series}, {variant.parameter}"],
                error_codes(surface, variant, GAMMA),
                error_gamma_2_9=hard,
                note=f"at gamma {HARD_GAMMA}: {hard:.2g}",
            )
        )
    shipped = next(row for row in rows if (row["series"], row["parameter"]) == ("fourth root, float32", "1024 entries"))
    note = "with its texture; once per picture and eye"
    return [*rows, {**shipped, "series": "as shipped", "seconds": times["as shipped"], "note": note}]


def frame_rows(surface: Surface) -> list[dict[str, object]]:
    """Time a steady frame beside plain copies of the same pixels, and a switch between prefetched pictures."""
    context = surface.context
    display = model(GAMMA)
    width, height = SIZE_PX
    XYZ = test_picture(display)
    pictures = {
        "a": StereoImage(XYZ[:, : width // 2], XYZ[:, width // 2 :]),
        "b": StereoImage(XYZ[:, width // 2 :], XYZ[:, : width // 2]),
    }
    copied = context.texture(SIZE_PX, 4, bytes(4 * width * height))
    source = context.framebuffer([copied])
    program = compile_program(context, shader_file("area.vert"), [("copy.frag", COPY)])
    area = context.vertex_array(program, [])

    def texel_copy() -> None:
        surface.target(Buffer.BACK).viewport = (0, 0, width, height)
        copied.use(0)
        area.render(moderngl.TRIANGLE_STRIP, vertices=4)
        surface.swap()

    def blit() -> None:
        context.copy_framebuffer(surface.target(Buffer.BACK), source)
        surface.swap()

    colour_pass = ColourPass(context, display)

    def codes(eye: Eye) -> moderngl.Framebuffer:
        view = np.ascontiguousarray(pictures["b"].eye(eye))
        return colour_pass.run(context.texture((width // 2, height), 3, view, alignment=1, dtype="f4"))

    halves = [codes(eye) for eye in EYES]

    def two_blits() -> None:
        """Copy the pixels of the scene that stays, from pictures of 8 bits of its own, with nothing around it."""
        target = surface.target(Buffer.BACK)
        for number, half in enumerate(halves):
            place = Rectangle(number * (width // 2), 0, width // 2, height)
            surface.calls.copy(half, target, place, place)
        surface.swap()

    rows: list[dict[str, object]] = []
    with Presenter(surface, find_mode("side-by-side"), EyeModels(display, display), pictures.__getitem__) as presenter:
        scenes = [Scene((Picture(name),)) for name in pictures]
        for scene in scenes:
            presenter.prefetch(scene)
        presenter.show(scenes[-1])
        times = in_turn(
            {
                "plain copy: glBlitFramebuffer": blit,
                "plain copy: the same two pictures": two_blits,
                "plain copy: texelFetch": texel_copy,
                "steady frame": presenter.redraw,
                "trial switch, prefetched": lambda: [presenter.show(scene) for scene in scenes],
            },
            rounds=101,
        )
    times["trial switch, prefetched"] /= 2  # there and back
    plain, blitted = times["plain copy: the same two pictures"], times["plain copy: glBlitFramebuffer"]
    for name, time_s in times.items():
        note = f"{time_s / plain:.2f} × a plain copy of the same pictures, {time_s / blitted:.2f} × one blit of it all"
        rows.append(row(name, f"{width} × {height}", time_s, note=note))
    return rows


def colour_pass() -> dict[str, object]:
    """Return the rows, measured on the EGL driver that this machine gives."""
    with open_surface("egl", SIZE_PX) as surface:
        renderer = surface.facts.renderer
        passes, frames = pass_rows(surface), frame_rows(surface)
    rows = passes + frames
    of_shipped = [row for row in rows if row["series"] == "as shipped"]
    ratio = times_as_fast(frames, "plain copy: the same two pictures", "steady frame")
    promises = [
        Promise("largest error at gamma 2.4, before rounding", worst(of_shipped), 0.001, "error", unit="codes"),
        Promise("at gamma 2.9", worst(of_shipped, "error_gamma_2_9"), 0.003, "error", unit="codes"),
        Promise("at gamma 2.4, in two floats", worst(rows, series="two-floats"), 0.001, "error", unit="codes"),
        Promise("a steady frame beside a plain copy of its pixels", ratio, 1.1, "ratio", unit="×"),
    ]
    return {"title": f"{TITLE} ({renderer})", "rows": rows, "promises": promises}


PLVC_PX = sized((960, 540), (96, 54))
SIZES = sized((17, 33, 65), (17,))
# Trilinear by hand: hardware filtering has 8 fraction bits. Axes are fourth roots of light, as in the one table.
LOOKUP = """
uniform sampler3D cube;
uniform vec3 full;
vec3 looked_up(Real3 light) {
    vec3 share = clamp(floats_of(light) / full, 0.0, 1.0);
    ivec3 last = textureSize(cube, 0) - 1;
    vec3 place = sqrt(sqrt(share)) * vec3(last);
    ivec3 low = clamp(ivec3(place), ivec3(0), last - 1);
    vec3 on = place - vec3(low);
    vec3 found = vec3(0.0);
    for (int corner = 0; corner < 8; corner++) {
        ivec3 step = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
        vec3 weight = mix(1.0 - on, on, vec3(step));
        found += weight.r * weight.g * weight.b * texelFetch(cube, low + step, 0).rgb;
    }
    return found;
}
"""
START = "    Real3 T = asked;\n"
CODES = "    return codes_of_linear(channels_of(0, asked));\n"


@dataclass(frozen=True, slots=True)
class PlvcWay:
    """One way: from a table of ``size``³ or the primaries, and how many of Newton's steps, None for codes at once.

    ``by_knots`` inverts the curves piece by piece, and not by the one table. ``residual`` is the knots of what PLVC
    leaves over, 0 where there is none.
    """

    series: str
    size: int
    steps: int | None
    by_knots: bool = True
    arithmetic: Arithmetic = Arithmetic.DOUBLES
    residual: int = 0

    @property
    def parameter(self) -> str:
        """What the row is called."""
        if self.residual:
            return f"{self.residual} knots of a residual"
        table = f"{self.size}³" if self.size else ""
        steps = "" if self.steps is None else f"{self.steps} steps"
        return ", ".join(part for part in (table, steps) if part)


NO_DRIFT = PlvcWay("knots, no drift", 0, None)
# What a residual of so many knots costs, as shipped.
RESIDUALS = sized((8, 48), (8,))


def plvc_ways() -> list[PlvcWay]:
    """Return tables of codes, tables to start from, and steps from the primaries."""
    found = [PlvcWay("table of codes", size, None, by_knots=False) for size in SIZES]
    found += [PlvcWay("Newton from a table", size, steps) for size in SIZES for steps in sized((1, 2), (2,))]
    found += [PlvcWay("Newton, curves by the one table", 0, 4, by_knots=False)]
    found += [PlvcWay("Newton, curves by knots", 0, steps) for steps in sized((1, 2, 3, 4, 5), (5,))]
    others = (Arithmetic.TWO_FLOATS, Arithmetic.GUARDED)
    found += [PlvcWay(f"Newton, curves by knots, {kind.value}", 0, 5, arithmetic=kind) for kind in others]
    return found + [PlvcWay("Newton, curves by knots", 0, MOST_STEPS, residual=knots) for knots in RESIDUALS]


def fitted() -> Plvc:
    """Return PLVC fitted to 120 readings of a simulated liquid crystal display."""
    codes = table_c1_codes()
    data = patches(codes, noisy(liquid_crystal_XYZ(codes), 0.002, 1))
    return fit_plvc(data, fit_table(data, fit_parametric(data, "gogo")[0].model))[0]


def with_residual(model: Plvc, knots: int) -> Plvc:
    """Return ``model`` with a residual of ``knots`` at random and of 0.5 % of white, which the pass has to undo."""
    rng = np.random.default_rng(knots)
    size = 0.005 / knots**0.5 * model.white_XYZ_cd_m2
    return replace(
        model, residual=Residual(rng.uniform(0, 0.88, (knots, 3)), 0.875, size * rng.uniform(-1, 1, (knots, 3)))
    )


def picture_of(model: Plvc) -> NDArray[np.float32]:
    """XYZ of SIZE_PX inside the gamut: random light, light random in its logarithm, and greys down to 1e-7 cd/m²."""
    count = PLVC_PX[0] * PLVC_PX[1]
    rng = np.random.default_rng(0)
    parts = [rng.uniform(0, 1, (count // 3, 3)), 10 ** rng.uniform(-9, 0, (count // 3, 3))]
    parts.append(np.geomspace(1e-9, 1.0, count - 2 * (count // 3))[:, np.newaxis] * np.ones(3))
    return model.xyz_of_linear(np.concatenate(parts)).reshape(PLVC_PX[1], PLVC_PX[0], 3).astype(np.float32)


class PlvcPass:
    """A way compiled for a display, like runner.presenter.colour_pass.ColourPass; None is the one-table pass."""

    def __init__(self, context: moderngl.Context, model: DisplayModel, way: PlvcWay | None) -> None:
        interaction = channel_interaction(model)
        by_knots = way is not None and way.by_knots
        inverse = "knots.glsl" if by_knots else "table_fourth_root.glsl"
        switch = "by_knots.glsl" if by_knots else "by_table.glsl"
        parts: list[Part] = [shader_file(name) for name in (inverse, switch, "encode.glsl")]
        self._textures: list[moderngl.Texture | moderngl.Texture3D] = []
        if by_knots:
            pieces = knot_tables([curve for curve in model.curves if isinstance(curve, TableCurve)])
            self._textures.append(context.texture((2 * pieces.shape[1], 3), 4, pieces.tobytes(), dtype="f4"))
        else:
            tables = np.stack([curve_table(curve) for curve in model.curves]).astype(np.float32)
            self._textures.append(context.texture((tables.shape[1], 3), 1, tables.tobytes(), dtype="f4"))
        values: dict[str, Uniform] = {
            "linear_from_XYZ": Real3x3(model.linear_from_XYZ),
            "black_light": Reals(model.linear_from_XYZ @ model.black_XYZ_cd_m2),
            "lift": Reals(np.zeros(3)),
            "scale": Reals(np.ones(3)),
            "levels": 0.0,
            "box": (1, 1),
            "picture_XYZ": 0,
            "knots" if by_knots else "code_table": 1,
            **interaction.uniforms,
        }
        if way is not None and isinstance(model, Plvc):
            name, text = shader_file(interaction.files[0])
            if way.size:
                full = model.light_of(np.ones(3))
                axis = np.linspace(0.0, 1.0, way.size) ** 4
                blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
                linear = np.clip(model.channels(np.stack([red, green, blue], axis=-1) * full), 0.0, 1.0)
                codes = np.stack([curve.code(linear[..., i]) for i, curve in enumerate(model.curves)], axis=-1)
                cube = (codes if way.steps is None else linear).astype(np.float32)
                self._textures.append(context.texture3d((way.size,) * 3, 3, cube.tobytes(), alignment=1, dtype="f4"))
                values |= {"cube": 2, "full": tuple(full.tolist())}
                parts.append(("lookup.glsl", LOOKUP))
                text = text.replace(START, "    Real3 T = real3(looked_up(asked));\n")
                if way.steps is None:
                    text = text.replace(CODES, "    return vec4(looked_up(asked), 1.0);\n")
                    values = {key: value for key, value in values.items() if not key.startswith("plvc")}
                    for unused in ("lift", "scale", "levels", "code_table"):
                        del values[unused]
            if way.steps is not None:
                values["plvc_steps"] = (way.steps, way.steps)
            for table, texels in interaction.tables.items():
                values[table] = 1 + len(self._textures)
                self._textures.append(context.texture(texels.shape[1::-1], 4, texels.tobytes(), dtype="f4"))
            parts += [(name, text), *(shader_file(file) for file in interaction.files[1:])]
        parts += [shader_file("mean_xyz.glsl"), shader_file("colour_pass.frag")]
        arithmetic = Arithmetic.DOUBLES if way is None else way.arithmetic
        self._program = compile_program(context, shader_file("area.vert"), parts, arithmetic)
        self._area = context.vertex_array(self._program, [])
        for name, value in values.items():
            set_uniform(self._program, name, value)

    def draw(self, picture: moderngl.Texture, target: moderngl.Framebuffer) -> None:
        """Draw the picture's codes to ``target``, as computed."""
        target.use()
        for unit, texture in enumerate([picture, *self._textures]):
            texture.use(unit)
        self._area.render(moderngl.TRIANGLE_STRIP, vertices=4)


def plvc_rows(surface: Surface, rounds: int = sized(5, 1)) -> list[dict[str, object]]:
    """Return each way's time and error."""
    context = surface.context
    model = fitted()
    additive = DisplayModel(model.black_XYZ_cd_m2, model.primaries_XYZ_cd_m2, model.curves)
    XYZ = picture_of(model)
    left_over = {knots: with_residual(model, knots) for knots in RESIDUALS}
    expected = {shown: shown.code(XYZ.astype(np.float64)) for shown in (model, additive, *left_over.values())}
    picture = context.texture(PLVC_PX, 3, XYZ.tobytes(), alignment=1, dtype="f4")
    codes = context.texture(PLVC_PX, 4, dtype="f4")
    target = context.framebuffer([codes])
    every: list[PlvcWay | None] = [None, NO_DRIFT, *plvc_ways()]
    errors, work = [], []
    for way in every:
        if way is not None and way.residual:
            display: DisplayModel = left_over[way.residual]
        else:
            display = additive if way in (None, NO_DRIFT) else model
        compiled = PlvcPass(context, display, way)
        compiled.draw(picture, target)
        shown = np.frombuffer(codes.read(), np.float32).reshape(PLVC_PX[1], PLVC_PX[0], 4)[::-1, :, :3]
        errors.append(float(np.abs(shown - expected[display]).max() * 255.0))

        def once(compiled: PlvcPass = compiled) -> None:
            compiled.draw(picture, target)
            context.finish()

        work.append(once)
    times = [median(taken) for taken in zip(*(_round(work) for _ in range(rounds)), strict=True)]
    surface.target(Buffer.BACK)
    return [
        row(
            "one table, no drift" if way is None else way.series,
            "1024 entries" if way is None else way.parameter or "curves as fitted",
            time_s,
            error,
            note=f"{time_s / times[0]:.1f} × the one-table pass" + (_shipped(model, way)),
        )
        for way, time_s, error in zip(every, times, errors, strict=True)
    ]


def _shipped(model: Plvc, way: PlvcWay | None) -> str:
    steps = (model.steps, MOST_STEPS)
    return "; as shipped" if way is not None and way.by_knots and not way.size and way.steps in steps else ""


def _round(work: list[Callable[[], None]]) -> list[float]:
    times = []
    for once in work:
        start_s = perf_counter()
        once()
        times.append(perf_counter() - start_s)
    return times


def plvc_pass() -> dict[str, object]:
    """Return the rows, measured on the EGL driver that this machine gives."""
    with open_surface("egl", PLVC_PX) as surface:
        rows = plvc_rows(surface)
        title = f"PLVC in the pass ({surface.facts.renderer})"
    shipped = [float(str(row["error"])) for row in rows if "as shipped" in str(row["note"])]
    promise = Promise("the pass as shipped, against float64", max(shipped), 1e-3, "error", unit="of an 8-bit code")
    return {"title": title, "rows": rows, "promises": [promise]}


View = NDArray[np.float32]
Pair = dict[Eye, Floats]
Way = tuple[str, str]  # series and parameter

CROSSTALK_TITLE = "Crosstalk and an uneven panel, a pair of 1344 × 1000 pixels"
PLAIN: Way = "plain colour pass", "nothing compensated"
IN_PASS, ON_PROCESSOR = "in the pass", "float64 on the processor"
IN_TWO_FLOATS = "in the pass, two floats"
PAIR_PX = sized((1344, 1000), (96, 64))
LEAKS = Crosstalk(np.diag([0.05, 0.04, 0.06]), np.diag([0.03, 0.05, 0.02]))
NEGATIVE = Crosstalk(np.diag([-0.03, -0.02, -0.04]), np.diag([-0.02, 0.01, -0.03]))
CLIPPED = Crosstalk(np.maximum(NEGATIVE.left, 0.0), np.maximum(NEGATIVE.right, 0.0))
# Figure 3.7 of the thesis.
READINGS = np.array([[0.0697, 0.1047, 0.0955], [0.1088, 0.1587, 0.1434], [0.1340, 0.1774, 0.1608]])
PANEL = GainMap(READINGS, PAIR_PX, "cells", "minimum")
CORRECTIONS = {
    "gain map": Correction(None, PANEL),
    "crosstalk": Correction(LEAKS),
    "crosstalk and gain map": Correction(LEAKS, PANEL),
}
CORRECTIONS = sized(CORRECTIONS, {name: CORRECTIONS[name] for name in ("gain map", "crosstalk and gain map")})


def leaking_display(gamma: float) -> EyeModels:
    """Return a display of ``gamma``, its right eye a tenth dimmer."""
    curve = ToneCurve(gamma=gamma)
    black = np.array([0.02, 0.02, 0.03])
    left = DisplayModel(black, PRIMARIES, (curve, curve, curve))
    return EyeModels(left, DisplayModel(black, 0.9 * PRIMARIES, (curve, curve, curve)))


def pair(models: EyeModels) -> dict[Eye, View]:
    """Return two views: colours of every light from 1e-7 of full to above white, and saturated ones, in any order."""
    rng = np.random.default_rng(2)
    width, height = PAIR_PX
    views: dict[Eye, View] = {}
    for eye in EYES:
        light = 10.0 ** rng.uniform(-7.0, 0.1, (height, width, 3))
        light[rng.random((height, width, 3)) < 0.2] = 0.0
        model = models.eye(eye)
        views[eye] = (model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T).astype(np.float32)
    return views


def solved(models: EyeModels, correction: Correction, views: dict[Eye, View]) -> Pair:
    """Return the XYZ to ask of each eye's display model, as `cancel_crosstalk` has it but without its report."""
    models = models.normalised
    sent: Pair = {eye: view.astype(np.float64) for eye, view in views.items()}
    if correction.crosstalk is not None:
        mix = channel_crosstalk(models, correction.crosstalk)
        left, right = (np.clip(models.eye(eye).linear(sent[eye]), 0.0, 1.0) for eye in EYES)
        first = [np.clip(light, 0.0, 1.0) for light in mix.solve(left, right)]
        lights: Pair = {"left": left - first[1] @ mix.left.T, "right": right - first[0] @ mix.right.T}
        for eye, light in lights.items():
            model = models.eye(eye)
            sent[eye] = model.black_XYZ_cd_m2 + np.clip(light, 0.0, 1.0) @ model.primaries_XYZ_cd_m2.T
    if correction.gain_map is not None:
        width, height = PAIR_PX
        gain = correction.gain_map.over(np.arange(width) + 0.5, np.arange(height) + 0.5)
        sent = {eye: correction.gain_map.corrected(xyz, gain) for eye, xyz in sent.items()}
    return sent


def uploaded(surface: Surface, view: View) -> Texture:
    """Return a texture of ``view``."""
    return surface.context.texture(PAIR_PX, 3, np.ascontiguousarray(view), alignment=1, dtype="f4")


def drawn_error_codes(drawn: Framebuffer, wanted: Floats) -> float:
    """Return how far codes as computed are from ``wanted`` (0..1) at most, in codes of 8 bits; frees them."""
    width, height = PAIR_PX
    shown = np.frombuffer(drawn.read(components=3, dtype="f4"), np.float32).reshape(height, width, 3)[::-1]
    release_codes(drawn)
    return 255.0 * float(np.abs(shown - wanted).max())


def compensated(surface: Surface, word: str, models: EyeModels, correction: Correction, eye: Eye) -> CompensatedPass:
    """Return the pass of ``eye`` in the arithmetic ``word``."""
    with patch.dict(os.environ, {VARIABLE: word}):
        return CompensatedPass(surface.context, models, correction, eye)


def crosstalk_errors(surface: Surface, gamma: float) -> dict[Way, float]:
    """Return the largest error of each way and each correction."""
    models = leaking_display(gamma)
    views = pair(models)
    context = surface.context
    found: dict[Way, float] = {}
    textures = {eye: uploaded(surface, views[eye]) for eye in EYES}
    for name, correction in CORRECTIONS.items():
        sent = solved(models, correction, views)
        for eye, other in (EYES, EYES[::-1]):
            wanted = models.eye(eye).code(sent[eye])
            plain = ColourPass(context, models.eye(eye))
            picture = uploaded(surface, sent[eye].astype(np.float32))
            own, floats = (compensated(surface, word, models, correction, eye) for word in ("doubles", "two-floats"))
            drawn = {
                ON_PROCESSOR: plain.run(picture, dtype="f4"),
                IN_PASS: own.run(textures[eye], textures[other], CORNER, dtype="f4"),
                IN_TWO_FLOATS: floats.run(textures[eye], textures[other], CORNER, dtype="f4"),
            }
            for way, codes in drawn.items():
                found[way, name] = max(found.get((way, name), 0.0), drawn_error_codes(codes, wanted))
            for held in (plain, picture, own, floats):
                held.release()
    for texture in textures.values():
        texture.release()
    return found


def crosstalk_work(surface: Surface, models: EyeModels) -> dict[Way, Callable[[], object]]:
    """Return what to time."""
    context = surface.context
    views = pair(models)
    textures = {eye: uploaded(surface, views[eye]) for eye in EYES}
    plain = {eye: ColourPass(context, models.eye(eye)) for eye in EYES}

    def on_processor(correction: Correction) -> None:
        for eye, xyz in solved(models, correction, views).items():
            picture = uploaded(surface, xyz.astype(np.float32))
            release_codes(plain[eye].run(picture))
            picture.release()
        context.finish()

    def in_pass(passes: dict[Eye, CompensatedPass]) -> None:
        for eye, other in (EYES, EYES[::-1]):
            release_codes(passes[eye].run(textures[eye], textures[other], CORNER))
        context.finish()

    def uncompensated() -> None:
        for eye in EYES:
            release_codes(plain[eye].run(textures[eye]))
        context.finish()

    found: dict[Way, Callable[[], object]] = {PLAIN: uncompensated}
    for name, correction in CORRECTIONS.items():
        for way, word in ((IN_PASS, "doubles"), (IN_TWO_FLOATS, "two-floats")):
            passes = {eye: compensated(surface, word, models, correction, eye) for eye in EYES}
            found[way, name] = partial(in_pass, passes)
        found[ON_PROCESSOR, name] = partial(on_processor, correction)
    found["report of what is left", "crosstalk"] = partial(
        cancel_crosstalk, models, LEAKS, views["left"], views["right"]
    )
    return found


def negative_leaks() -> list[Row]:
    """Return what is seen of a display with leaks below 0 where they are cancelled, and where they count as none."""
    models = leaking_display(GAMMA)
    rng = np.random.default_rng(3)
    asked = {eye: models.eye(eye).xyz(rng.uniform(0.3, 0.9, (sized(100_000, 1000), 3))) for eye in EYES}
    white = models.left.white_XYZ_cd_m2
    rows: list[Row] = []
    for series, leaks in (("leak below 0, cancelled", NEGATIVE), ("leak below 0, taken for none", CLIPPED)):
        crosstalk_work = partial(cancel_crosstalk, models, leaks, asked["left"], asked["right"])
        sent = crosstalk_work()
        codes = [
            models.eye(eye).code(models.eye(eye).xyz_of_linear(light))
            for eye, light in (("left", sent.left_linear), ("right", sent.right_linear))
        ]
        seen = seen_XYZ(models, NEGATIVE, *codes)[0]
        off = 255.0 * np.abs(models.left.code(seen) - models.left.code(asked["left"])).max()
        delta_e = delta_e_2000(xyz_to_lab(seen, white), xyz_to_lab(asked["left"], white))
        rows.append(
            row(
                series,
                "leaks of -4 to 1 % of each channel",
                seconds(crosstalk_work, repeats=3),
                float(off),
                note=f"ΔE00 {delta_e.mean():.2g} on average, {delta_e.max():.2g} at most",
            )
        )
    return rows


def crosstalk() -> dict[str, object]:
    """Return the rows, measured on the EGL driver that this machine gives."""
    with open_surface("egl", (640, 480)) as surface:
        soft, hard = crosstalk_errors(surface, GAMMA), crosstalk_errors(surface, HARD_GAMMA)
        ways = crosstalk_work(surface, leaking_display(GAMMA))
        timed = in_turn({", ".join(way): once for way, once in ways.items()}, rounds=3)
        renderer = surface.facts.renderer
    times = {way: timed[", ".join(way)] for way in ways}
    rows: list[Row] = []
    for (series, parameter), time_s in times.items():
        error, hard_error = soft.get((series, parameter)), hard.get((series, parameter))
        note = f"{time_s / times[PLAIN]:.2f} × the plain colour pass"
        if series == ON_PROCESSOR:
            note = f"{time_s / times[IN_PASS, parameter]:.2f} × the pass that does the same"
        if hard_error is not None:
            note += f"; at gamma {HARD_GAMMA}: {hard_error:.2g}"
        if error is None and (series, parameter) != PLAIN:
            note = "percentages and ΔE00 for the session's record, on the processor, once per picture"
        rows.append(row(series, parameter, time_s, error, error_gamma_2_9=hard_error, note=note))
    passes = [row for row in rows if row["series"] in (IN_PASS, IN_TWO_FLOATS)]
    promises = [
        Promise("largest error in the pass at gamma 2.4, before rounding", worst(passes), 0.001, "error", unit="codes"),
        Promise("at gamma 2.9", worst(passes, "error_gamma_2_9"), 0.003, "error", unit="codes"),
    ]
    return {"title": f"{CROSSTALK_TITLE} ({renderer})", "rows": rows + negative_leaks(), "promises": promises}


FRAME_120_HZ_MS = 1000.0 / 120.0
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")


def is_software(facts: SurfaceFacts) -> bool:
    """Return whether a processor draws, and no graphics card."""
    return any(name in facts.renderer.lower() for name in SOFTWARE)


def times_ms(surface: Surface) -> dict[str, float]:
    """Return what each takes in milliseconds, until the driver says that it is done."""
    context = surface.context
    display = model(GAMMA)
    width = SIZE_PX[0]
    XYZ = test_picture(display)
    halves = [np.ascontiguousarray(XYZ[:, : width // 2]), np.ascontiguousarray(XYZ[:, width // 2 :])]
    pictures = {"a": StereoImage(*halves), "b": StereoImage(*reversed(halves))}
    uploaded = context.texture(SIZE_PX, 3, XYZ, alignment=1, dtype="f4")
    colour_pass = ColourPass(context, display)

    def upload() -> None:
        texture = context.texture(SIZE_PX, 3, XYZ, alignment=1, dtype="f4")
        context.finish()
        texture.release()

    def whole_pass() -> None:
        surface.target(Buffer.BACK)
        release_codes(colour_pass.run(uploaded))
        context.finish()

    scenes = [Scene((Picture(name),)) for name in pictures]
    with Presenter(surface, find_mode("side-by-side"), EyeModels(display, display), pictures.__getitem__) as presenter:
        for scene in scenes:
            presenter.prefetch(scene)

        def steady() -> None:
            presenter.redraw()
            context.finish()

        def there_and_back() -> None:
            for scene in scenes:
                presenter.show(scene)
                context.finish()

        presenter.show(scenes[-1])
        work = {
            "steady frame": steady,
            "switch, pictures prefetched": there_and_back,
            "colour pass": whole_pass,
            "upload": upload,
        }
        times = {name: 1000.0 * time_s for name, time_s in in_turn(work, rounds=31).items()}
    times["switch, pictures prefetched"] /= len(scenes)
    return times


def graphics_card() -> dict[str, Any]:
    """Measure on the driver that this machine gives; a frame and a switch within one frame of 120 Hz are the goal."""
    with open_surface("egl", SIZE_PX) as surface:
        facts = surface.facts
        times = times_ms(surface)
    driver = f"{facts.renderer}, {facts.gl_version}"
    kind = "software OpenGL" if is_software(facts) else "a graphics card"
    size = f"{SIZE_PX[0]} × {SIZE_PX[1]} pixels"
    rows = [row(name, size, time_ms / 1000.0, note=f"{kind}: {driver}") for name, time_ms in times.items()]
    promises = []
    for name, time_ms in times.items():
        goal_ms = FRAME_120_HZ_MS if name.startswith(("steady", "switch")) else None
        figure, why = (None, f"no graphics card: {facts.renderer}") if is_software(facts) else (time_ms, "")
        promises.append(Promise(name, figure, goal_ms, "seconds", unit="ms", missing=why))
    return {"title": f"Absolute times with {kind}: {driver}", "rows": rows, "promises": promises}


Dither = Callable[[Floats, Floats], NDArray[np.int64]]

ASUS = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
FULL = 243.0  # beyond it green has all its light
DITHERED_PX = sized(512, 64)


def dither_ways(model: DisplayModel) -> dict[tuple[str, str], Dither]:
    """Return ways to dither XYZ (..., 3) by thresholds (..., 3), by series and parameter."""
    found: dict[tuple[str, str], Dither] = {
        ("no dithering", "rounded"): lambda xyz, u: np.rint(model.code(xyz) * 255).astype(np.int64),
        ("dithered code", "float64"): lambda xyz, u: np.floor(model.code(xyz) * 255 + 1 - u).astype(np.int64),
        ("dithered light", "closed form, float64"): lambda xyz, u: dither_codes(model, xyz, u),
    }
    for entries in (8, 32, 256, 1024):
        tables = dither_tables(model, entries=entries)
        found["dithered light, tables", f"{entries} entries, float32"] = lambda xyz, u, tables=tables: (
            tabled_dither_codes(model, xyz, u, tables)
        )
    return found


def dither_errors(model: DisplayModel, dither: Dither, levels: int = 255) -> tuple[float, float]:
    """Return the largest relative bias of luminance and the largest ΔE00 of mean XYZ, of codes 0..levels.

    The greys asked for are the same, whatever the levels.
    """
    codes = np.concatenate([np.arange(1.5, 16, sized(0.125, 3.5)), np.geomspace(16, FULL, sized(150, 4))])
    asked = model.xyz(np.repeat(codes[:, None], 3, axis=1) / 255)
    period = dither_thresholds(64, 64)
    shown = np.array([model.xyz(dither(np.broadcast_to(xyz, period.shape), period) / levels) for xyz in asked])
    mean = shown.reshape(len(asked), -1, 3).mean(axis=1)
    white = model.white_XYZ_cd_m2
    difference = delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(mean, white))
    return float(np.abs(mean[:, 1] / asked[:, 1] - 1).max()), float(difference.max())


def dither_texture(context: Context, xyz: Floats) -> Texture:
    """Return a texture of XYZ (height, width, 3)."""
    return context.texture(xyz.shape[1::-1], 3, xyz.astype(np.float32).tobytes(), alignment=1, dtype="f4")


def dithered_codes(context: Context, colour_pass: ColourPass, levels: int, xyz: Floats, _: Floats) -> NDArray[np.int64]:
    """Return what the colour pass, which has thresholds of its own, makes of XYZ (height, width, 3): 0..levels."""
    picture = dither_texture(context, xyz)
    codes = colour_pass.run(picture)
    shown = np.frombuffer(codes.read(components=3, dtype="f4"), np.float32).reshape(xyz.shape)[::-1]
    release_codes(codes)
    picture.release()
    return np.rint(shown * levels).astype(np.int64)


def dithered_rows(surface: Surface, model: DisplayModel, picture: Floats) -> list[Row]:
    """Time the colour pass with and without dithering, in turn, so that other work slows both alike."""
    context = surface.context
    uploaded = dither_texture(context, picture)
    bits: tuple[Bits, ...] = (8, 10)
    passes = {
        (name, depth): ColourPass(context, model, dithering=dithering, bits=depth)
        for depth in bits
        for name, dithering in (("rounded", None), ("dithered", Dithering()))
    }

    def once(colour_pass: ColourPass) -> None:
        release_codes(colour_pass.run(uploaded))
        context.finish()

    rows: list[Row] = []
    for (name, depth), colour_pass in passes.items():
        levels = highest_code(depth)
        bias, difference = dither_errors(model, partial(dithered_codes, context, colour_pass, levels), levels)
        note = f"ΔE00 of the mean at most {difference:.2g}; {surface.facts.renderer}"
        if (name, depth) != ("rounded", 8):
            slower = times_faster(lambda: once(passes["rounded", 8]), lambda made=colour_pass: once(made), rounds=25)
            note += f"; {slower:.2f} × the pass rounded to 8 bits"
        taken = seconds(lambda colour_pass=colour_pass: once(colour_pass))
        rows.append(row("colour pass", f"{name}, {depth} bits", taken, bias, note=note))
    return rows


def dithering() -> dict[str, object]:
    """Time every way on the same picture, and measure its errors on the thesis's display."""
    model = read_display(ASUS).models("side-by-side").left
    light = np.random.default_rng(0).uniform(0, 0.95, (DITHERED_PX, DITHERED_PX, 3)) ** 2
    picture = light @ model.primaries_XYZ_cd_m2.T
    thresholds = dither_thresholds(DITHERED_PX, DITHERED_PX)
    rows: list[Row] = []
    for (series, parameter), dither in dither_ways(model).items():
        bias, difference = dither_errors(model, dither)
        taken = seconds(lambda dither=dither: dither(picture, thresholds), repeats=3)
        note = f"ΔE00 of the mean at most {difference:.2g}"
        rows.append(row(series, parameter, taken, bias, note=note))
    with open_surface("egl", (DITHERED_PX, DITHERED_PX)) as surface:
        rows += dithered_rows(surface, model, picture)
    means = [
        worst(rows, series=series, parameter=way)
        for series, way in (
            ("dithered light", "closed form"),
            ("dithered light, tables", f"{ENTRIES} entries"),
            ("colour pass", "dithered"),
        )
    ]
    promise = Promise("luminance of the mean over the mask, relative", max(means), 1e-3, "error")
    return {"title": f"Dithering {DITHERED_PX} × {DITHERED_PX} pixels to 8 bits", "rows": rows, "promises": [promise]}


if __name__ == "__main__":
    program("passes", colour_pass, plvc_pass, crosstalk, graphics_card, dithering)
