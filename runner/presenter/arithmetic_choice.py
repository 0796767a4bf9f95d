"""Which numbers the colour passes compute in on a driver: doubles where it has them, unless two floats are faster.

`glsl/arithmetic_two_float.glsl` relies on sums that are computed as they are written. What a driver's compiler makes of
that is tested at the start, against NumPy, and a driver whose two floats have not the accuracy is refused.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import fsum
from time import perf_counter

import moderngl
import numpy as np
from numpy.typing import NDArray

from documents import Finding
from runner.presenter.arithmetic import Arithmetic, Real3x3, Reals
from runner.presenter.errors import GraphicsError
from runner.presenter.shaders import Uniform, compile_program, set_uniform, shader_file

VARIABLE = "CYCLOPEAN_ARITHMETIC"
# Of two floats: the largest error of an operation, relative to its result; 2^-44 is a fourth root wrong by 1e-5 codes.
TOLERANCE = 2.0**-44
# Doubles are kept unless two floats take less than this share of their time.
FASTER = 0.6
# Drivers that compute on the processor, where doubles are half as fast as floats, and two floats far slower.
_ON_THE_PROCESSOR = ("llvmpipe", "softpipe", "swiftshader", "swr")
_TEST_NUMBERS = 256
_TIMED_SIZE_PX = (1024, 512)


@dataclass(frozen=True, slots=True)
class ChosenArithmetic:
    """What the colour passes of a context compute in, and why."""

    kind: Arithmetic
    reason: str

    def __str__(self) -> str:
        return f"{self.kind.value}: {self.reason}"


def arithmetic_of(context: moderngl.Context) -> ChosenArithmetic:
    """Return what colours are computed in on ``context``, which is current; chosen once for each context.

    The environment variable ``CYCLOPEAN_ARITHMETIC`` forces ``doubles``, ``two-floats`` or ``two-floats-guarded``.

    Raises
    ------
    GraphicsError
        If the driver has not what is forced, or its two floats have not the accuracy that they should have.
    """
    asked = os.environ.get(VARIABLE, "")
    kept: dict[str, ChosenArithmetic] = context.extra if isinstance(context.extra, dict) else {}
    context.extra = kept
    if asked not in kept:
        kept[asked] = _forced(context, asked) if asked else _chosen(context)
    return kept[asked]


def arithmetic_in_words(context: moderngl.Context) -> str:
    """Return what colours are computed in on ``context``, and why, or why they cannot be: for records."""
    try:
        return str(arithmetic_of(context))
    except GraphicsError as error:
        return f"nothing: {error}"


def _forced(context: moderngl.Context, asked: str) -> ChosenArithmetic:
    words = [kind.value for kind in Arithmetic]
    if asked not in words:
        raise GraphicsError(
            Finding(f"{VARIABLE} is '{asked}'", remedy=f"set it to one of {', '.join(words)}, or to nothing")
        )
    kind = Arithmetic(asked)
    reason = f"set by {VARIABLE}"
    if kind is Arithmetic.DOUBLES:
        if not kind.is_known_to(context):
            raise GraphicsError(
                Finding(
                    f"{VARIABLE} is 'doubles', and the driver {_renderer(context)} has none ({kind.extension})",
                    remedy=f"set {VARIABLE} to two-floats, or to nothing",
                )
            )
        return ChosenArithmetic(kind, reason)
    kinds = [kind] if kind is Arithmetic.GUARDED else _TWO_FLOATS
    return ChosenArithmetic(_accurate(context, kinds), reason)


def _chosen(context: moderngl.Context) -> ChosenArithmetic:
    if not Arithmetic.DOUBLES.is_known_to(context):
        return ChosenArithmetic(_accurate(context, _TWO_FLOATS), "the driver has no 64-bit floats")
    if any(name in _renderer(context).lower() for name in _ON_THE_PROCESSOR):
        return ChosenArithmetic(Arithmetic.DOUBLES, "computed on the processor, which has fast 64-bit floats")
    if _fault(context, Arithmetic.DOUBLES):
        return ChosenArithmetic(_accurate(context, _TWO_FLOATS), "the driver's 64-bit floats are not exact enough")
    try:
        two_floats = _accurate(context, _TWO_FLOATS)
    except GraphicsError:
        return ChosenArithmetic(Arithmetic.DOUBLES, "the driver's two floats are not exact enough")
    share = _time_s(context, two_floats) / _time_s(context, Arithmetic.DOUBLES)
    compared = f"two floats took {share:.2f} × the time of 64-bit floats"
    return ChosenArithmetic(two_floats if share < FASTER else Arithmetic.DOUBLES, compared)


_TWO_FLOATS = (Arithmetic.TWO_FLOATS, Arithmetic.GUARDED)


def _renderer(context: moderngl.Context) -> str:
    return str(context.info["GL_RENDERER"])


def _accurate(context: moderngl.Context, kinds: Sequence[Arithmetic]) -> Arithmetic:
    """Return the first of ``kinds`` that the driver computes as it should."""
    faults = []
    for kind in kinds:
        if kind.is_known_to(context):
            fault = _fault(context, kind)
            if not fault:
                return kind
            faults.append(f"{kind.value}: {fault}")
    raise GraphicsError(
        Finding(
            f"the driver {_renderer(context)} does not compute colours exactly enough ({'; '.join(faults)})",
            remedy="update the driver, use another graphics card, or software OpenGL (LIBGL_ALWAYS_SOFTWARE=1)",
        )
    )


def _fault(context: moderngl.Context, kind: Arithmetic) -> str:
    """Return what is wrong with what the driver computes, nothing if all is well."""
    try:
        errors = arithmetic_errors(context, kind)
    except GraphicsError as error:
        return str(error)
    name = max(errors, key=lambda operation: errors[operation])
    return "" if errors[name] <= TOLERANCE else f"{name} errs by {errors[name]:.1g}, and {TOLERANCE:.1g} is allowed"


def arithmetic_errors(context: moderngl.Context, kind: Arithmetic) -> dict[str, float]:
    """Return the largest error of each operation on known numbers, relative to its result, by name.

    A sum that nearly cancels is as exact as its terms have bits. Of a matrix, whose third row cancels all but 1e-12 of
    its terms, two floats must have 60 bits of the terms; doubles have 53.
    """
    rng = np.random.default_rng(48)
    a, b = (_numbers(rng) for _ in range(2))
    b[: _TEST_NUMBERS // 4] = -a[: _TEST_NUMBERS // 4] * (1.0 + rng.normal(0.0, 1e-9, (_TEST_NUMBERS // 4, 3)))
    matrix = rng.normal(0.0, 1.0, (3, 3))
    matrix[2, 2] = -(matrix[2, 0] + matrix[2, 1]) + 1e-12
    along = np.broadcast_to(a[:, :1].astype(np.float32).astype(np.float64), a.shape)
    a_parts, b_parts = _in_two(a), _in_two(b)
    a, b = (parts.astype(np.float64).sum(axis=0) for parts in (a_parts, b_parts))
    positive = np.abs(a)
    exact = {
        "sum": a + b,
        "difference": a - b,
        "product": a * b,
        "quotient": a / b[:, :1],
        "root": np.sqrt(positive),
        "product with floats": a * b_parts[0].astype(np.float64),
        "matrix": _exact_product(matrix, along),
    }
    inputs = np.stack([*a_parts, *b_parts]).astype(np.float32)
    found = _computed(context, kind, inputs, matrix, len(exact))
    errors = {}
    for (name, wanted), (high, low) in zip(exact.items(), found, strict=True):
        off = np.abs((high.astype(np.float64) - wanted) + low)
        cancelled = 1.0 if kind is Arithmetic.DOUBLES else 2.0**-16
        terms = {"sum": 2.0**-3 * positive, "difference": 2.0**-3 * positive, "matrix": cancelled * np.abs(along)}
        share = off / np.maximum(np.abs(wanted), terms.get(name, 0.0))
        errors[name] = float(np.max(share)) if np.all(np.isfinite(share)) else float("inf")
    return errors


def _numbers(rng: np.random.Generator) -> NDArray[np.float64]:
    return np.asarray(rng.choice([-1.0, 1.0], (_TEST_NUMBERS, 3)) * 10.0 ** rng.uniform(-6, 4, (_TEST_NUMBERS, 3)))


def _in_two(numbers: NDArray[np.float64]) -> NDArray[np.float32]:
    high = numbers.astype(np.float32)
    return np.stack([high, (numbers - high).astype(np.float32)])


def _exact_product(matrix: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the product with vectors of floats, rounded once: 64-bit floats have no more bits than what is tested."""
    upper = np.round(matrix * 2.0**26) / 2.0**26
    terms = np.concatenate([half * vectors[:, np.newaxis] for half in (upper, matrix - upper)], axis=-1)  # exact
    return np.apply_along_axis(fsum, -1, terms)


def _computed(
    context: moderngl.Context, kind: Arithmetic, inputs: NDArray[np.float32], matrix: NDArray[np.float64], count: int
) -> NDArray[np.float32]:
    """Return what the driver computes, shape (operations, 2, numbers, 3)."""
    before = context.fbo
    program = compile_program(context, shader_file("area.vert"), [shader_file("arithmetic_test.frag")], kind)
    area = context.vertex_array(program, [])
    numbers = context.texture((inputs.shape[1], len(inputs)), 3, inputs.tobytes(), alignment=1, dtype="f4")
    numbers.filter = (moderngl.NEAREST, moderngl.NEAREST)
    codes = context.texture((inputs.shape[1], 2 * count), 4, dtype="f4")
    target = context.framebuffer([codes])
    try:
        set_uniform(program, "matrix", Real3x3(matrix))
        target.use()
        context.disable(moderngl.BLEND)
        numbers.use(0)
        area.render(moderngl.TRIANGLE_STRIP, vertices=4)
        found = np.frombuffer(target.read(components=3, dtype="f4", alignment=1), np.float32)
        return found.reshape(count, 2, inputs.shape[1], 3)
    finally:
        before.use()
        for held in (target, codes, numbers, area, program):
            held.release()


def _time_s(context: moderngl.Context, kind: Arithmetic) -> float:
    """Return how long the plain colour pass takes over a small picture: the least of three times."""
    before = context.fbo
    files = ("table_fourth_root.glsl", "by_table.glsl", "encode.glsl", "mean_xyz.glsl", "colour_pass.frag")
    program = compile_program(context, shader_file("area.vert"), [shader_file(name) for name in files], kind)
    area = context.vertex_array(program, [])
    width, height = _TIMED_SIZE_PX
    XYZ = np.random.default_rng(0).random((height, width, 3)).astype(np.float32)
    picture = context.texture(_TIMED_SIZE_PX, 3, XYZ.tobytes(), alignment=1, dtype="f4")
    table = context.texture((1024, 3), 1, np.linspace(0, 1, 3072).astype(np.float32).tobytes(), dtype="f4")
    codes = context.texture(_TIMED_SIZE_PX, 4)
    target = context.framebuffer([codes])
    uniforms: dict[str, Uniform] = {
        "linear_from_XYZ": Real3x3(np.array([[3.2, -1.5, -0.5], [-1.0, 1.9, 0.1], [0.05, -0.2, 1.05]])),
        "black_light": Reals(np.full(3, 0.001)),
        "lift": Reals(np.full(3, 0.001)),
        "scale": Reals(np.full(3, 1.001)),
        "levels": 255.0,
        "box": (1, 1),
        "picture_XYZ": 0,
        "code_table": 1,
    }
    try:
        for name, value in uniforms.items():
            set_uniform(program, name, value)
        target.use()
        context.disable(moderngl.BLEND)
        picture.use(0)
        table.use(1)
        times = []
        for _ in range(4):
            context.finish()
            start_s = perf_counter()
            for _ in range(4):
                area.render(moderngl.TRIANGLE_STRIP, vertices=4)
            context.finish()
            times.append(perf_counter() - start_s)
        return min(times[1:])
    finally:
        before.use()
        for held in (target, codes, picture, table, area, program):
            held.release()
