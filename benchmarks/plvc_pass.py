"""The colour pass for channels that act on each other: run time against error for each way to undo them.

    python benchmarks/plvc_pass.py

The display is PLVC fitted to a simulated liquid crystal one. Errors are the largest over the picture, in 8-bit codes
before rounding, against the float64 model; times are those of one pass over 960 × 540 pixels, until the driver says
that it is done. Beside it, the one-table pass of the same display without drift and mixtures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import median
from time import perf_counter

import moderngl
import numpy as np
from curves import program, row, sized
from numpy.typing import NDArray
from promises import Promise

from devices.characterise.parametric import fit_parametric
from devices.characterise.patches import patches
from devices.characterise.table_fit import fit_plvc, fit_table
from devices.characterise.thesis import table_c1_codes
from devices.display.curves import TableCurve, curve_table, knot_tables
from devices.display.model import DisplayModel
from devices.display.plvc import MOST_STEPS, Plvc
from devices.display.residual import Residual
from runner.presenter.arithmetic import Arithmetic, Real3x3, Reals
from runner.presenter.colour_pass import channel_interaction
from runner.presenter.shaders import Part, Uniform, compile_program, set_uniform, shader_file
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import Buffer, Surface
from tests.example_displays import liquid_crystal_XYZ, noisy

SIZE_PX = sized((960, 540), (96, 54))
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
class Way:
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


NO_DRIFT = Way("knots, no drift", 0, None)
# What a residual of so many knots costs, as shipped.
RESIDUALS = sized((8, 48), (8,))


def ways() -> list[Way]:
    """Return tables of codes, tables to start from, and steps from the primaries."""
    found = [Way("table of codes", size, None, by_knots=False) for size in SIZES]
    found += [Way("Newton from a table", size, steps) for size in SIZES for steps in sized((1, 2), (2,))]
    found += [Way("Newton, curves by the one table", 0, 4, by_knots=False)]
    found += [Way("Newton, curves by knots", 0, steps) for steps in sized((1, 2, 3, 4, 5), (5,))]
    others = (Arithmetic.TWO_FLOATS, Arithmetic.GUARDED)
    found += [Way(f"Newton, curves by knots, {kind.value}", 0, 5, arithmetic=kind) for kind in others]
    return found + [Way("Newton, curves by knots", 0, MOST_STEPS, residual=knots) for knots in RESIDUALS]


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
    count = SIZE_PX[0] * SIZE_PX[1]
    rng = np.random.default_rng(0)
    parts = [rng.uniform(0, 1, (count // 3, 3)), 10 ** rng.uniform(-9, 0, (count // 3, 3))]
    parts.append(np.geomspace(1e-9, 1.0, count - 2 * (count // 3))[:, np.newaxis] * np.ones(3))
    return model.xyz_of_linear(np.concatenate(parts)).reshape(SIZE_PX[1], SIZE_PX[0], 3).astype(np.float32)


class Pass:
    """A way compiled for a display, like runner.presenter.colour_pass.ColourPass; None is the one-table pass."""

    def __init__(self, context: moderngl.Context, model: DisplayModel, way: Way | None) -> None:
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


def measured(surface: Surface, rounds: int = sized(5, 1)) -> list[dict[str, object]]:
    """Return each way's time and error."""
    context = surface.context
    model = fitted()
    additive = DisplayModel(model.black_XYZ_cd_m2, model.primaries_XYZ_cd_m2, model.curves)
    XYZ = picture_of(model)
    left_over = {knots: with_residual(model, knots) for knots in RESIDUALS}
    expected = {shown: shown.code(XYZ.astype(np.float64)) for shown in (model, additive, *left_over.values())}
    picture = context.texture(SIZE_PX, 3, XYZ.tobytes(), alignment=1, dtype="f4")
    codes = context.texture(SIZE_PX, 4, dtype="f4")
    target = context.framebuffer([codes])
    every: list[Way | None] = [None, NO_DRIFT, *ways()]
    errors, work = [], []
    for way in every:
        if way is not None and way.residual:
            display: DisplayModel = left_over[way.residual]
        else:
            display = additive if way in (None, NO_DRIFT) else model
        compiled = Pass(context, display, way)
        compiled.draw(picture, target)
        shown = np.frombuffer(codes.read(), np.float32).reshape(SIZE_PX[1], SIZE_PX[0], 4)[::-1, :, :3]
        errors.append(float(np.abs(shown - expected[display]).max() * 255.0))

        def once(compiled: Pass = compiled) -> None:
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


def _shipped(model: Plvc, way: Way | None) -> str:
    steps = (model.steps, MOST_STEPS)
    return "; as shipped" if way is not None and way.by_knots and not way.size and way.steps in steps else ""


def _round(work: list[Callable[[], None]]) -> list[float]:
    times = []
    for once in work:
        start_s = perf_counter()
        once()
        times.append(perf_counter() - start_s)
    return times


def run() -> dict[str, object]:
    """Return the rows, measured on the EGL driver that this machine gives."""
    with open_surface("egl", SIZE_PX) as surface:
        rows = measured(surface)
        title = f"PLVC in the pass ({surface.facts.renderer})"
    shipped = [float(str(row["error"])) for row in rows if "as shipped" in str(row["note"])]
    promise = Promise("the pass as shipped, against float64", max(shipped), 1e-3, "error", unit="of an 8-bit code")
    return {"title": title, "rows": rows, "promises": [promise]}


if __name__ == "__main__":
    program("plvc_pass", run)
