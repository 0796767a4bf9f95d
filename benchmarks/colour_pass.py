"""The colour pass: run time against error for each way to invert a tone curve, and what a frame costs after it.

    python benchmarks/colour_pass.py

Errors are the largest over the picture, in 8-bit codes before rounding, against the float64 model; times are those of
one pass over 1920 × 1080 pixels, or of one frame, until the driver says that it is done.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from time import perf_counter

import moderngl
import numpy as np
from curves import program, row, sized
from numpy.typing import NDArray
from promises import Promise, worst

from devices.compensation.eye_view import Rectangle
from devices.display.curves import ToneCurve, curve_table
from devices.display.display_file import EYES, Eye, EyeModels
from devices.display.model import DisplayModel
from runner.presenter.arithmetic import Arithmetic, Real3x3, Reals
from runner.presenter.colour_pass import ColourPass, release_codes
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.shaders import Part, Uniform, compile_program, set_uniform, shader_file
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import Buffer, Surface
from runner.scene import Picture, Scene
from stimuli.pictures.stereo_image import StereoImage

TITLE = "Colour pass: run time against error"
SIZE_PX = sized((1920, 1080), (192, 108))
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
GAMMA = 2.4
HARD_GAMMA = 2.9
ENTRIES = sized((256, 1024, 4096), (1024,))

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
        found += [Variant(f"{spacing}, float32", f"{n} entries", inverse, root, n) for n in ENTRIES]
    found += [Variant("fourth root, half", f"{n} entries", (name, fourth), 4, n, half=True) for n in ENTRIES]
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


def run() -> dict[str, object]:
    """Return the rows, measured on the EGL driver that this machine gives."""
    with open_surface("egl", SIZE_PX) as surface:
        renderer = surface.facts.renderer
        rows = pass_rows(surface) + frame_rows(surface)
    of_shipped = [row for row in rows if row["series"] == "as shipped"]
    copies = {str(row["series"]): row["seconds"] for row in rows}
    ratio = copies["steady frame"] / copies["plain copy: the same two pictures"]  # type: ignore[operator]  # numbers
    promises = [
        Promise("largest error at gamma 2.4, before rounding", worst(of_shipped), 0.001, "error", unit="codes"),
        Promise("at gamma 2.9", worst(of_shipped, "error_gamma_2_9"), 0.003, "error", unit="codes"),
        Promise("at gamma 2.4, in two floats", worst(rows, series="two-floats"), 0.001, "error", unit="codes"),
        Promise("a steady frame beside a plain copy of its pixels", ratio, 1.1, "ratio", unit="×"),
    ]
    return {"title": f"{TITLE} ({renderer})", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("colour_pass", run)
