"""The numbers that the colour passes compute in: 64-bit floats of the driver, or each the sum of two 32-bit ones.

A pass is written once, in the types and functions of ``glsl/arithmetic_double.glsl``. `Arithmetic` says which file
gives them, `Real`, `Real3` and `Real3x3` are what its uniforms are set from.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import moderngl
import numpy as np

from documents.arrays import Floats

_OF_GL_4 = 400


class Arithmetic(Enum):
    """How colours are computed. The values are the words of the environment variable ``CYCLOPEAN_ARITHMETIC``.

    ``GUARDED`` is two floats where GLSL has no `precise`: below OpenGL 4.0 without GL_ARB_gpu_shader5.
    """

    DOUBLES = "doubles"
    TWO_FLOATS = "two-floats"
    GUARDED = "two-floats-guarded"

    @property
    def file(self) -> str:
        """The GLSL file of its types and functions."""
        return "arithmetic_double.glsl" if self is Arithmetic.DOUBLES else "arithmetic_two_float.glsl"

    @property
    def extension(self) -> str | None:
        """The extension that it needs below OpenGL 4.0."""
        names = {Arithmetic.DOUBLES: "GL_ARB_gpu_shader_fp64", Arithmetic.TWO_FLOATS: "GL_ARB_gpu_shader5"}
        return names.get(self)

    def is_known_to(self, context: moderngl.Context) -> bool:
        """Return whether the driver has the GLSL that it needs."""
        return self.extension is None or context.version_code >= _OF_GL_4 or self.extension in context.extensions

    def header(self, context: moderngl.Context) -> str:
        """Return the first lines of a fragment shader."""
        if self.extension is None:
            return "#version 330 core\n#define GUARDED\n"
        if context.version_code >= _OF_GL_4:
            return "#version 400 core\n"
        return f"#version 330 core\n#extension {self.extension} : require\n"


@dataclass(frozen=True, slots=True)
class Reals:
    """Numbers of 64 bits for a uniform ``Real``, a ``Real3``, shape (3,), or an array of n of these, shape (n, 3)."""

    values: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", np.asarray(self.values, dtype=np.float64))


class Real3x3(Reals):
    """A matrix, shape (3, 3), rows first, for ``uniform Real3x3``."""


def as_doubles(value: Reals) -> float | tuple[float, ...] | tuple[tuple[float, ...], ...]:
    """Return what a uniform of 64-bit floats is set to, columns first."""
    if value.values.ndim == 0:
        return float(value.values)
    if isinstance(value, Real3x3):
        return tuple(value.values.T.ravel().tolist())
    if value.values.ndim == 1:
        return tuple(value.values.tolist())
    return tuple(tuple(row) for row in value.values.tolist())


def as_floats(name: str, value: Reals) -> Iterator[tuple[str, float | tuple[float, ...]]]:
    """Give the uniforms of floats that ``name`` is made of, by name, and what they are set to."""
    parts = ("high", "middle", "low") if isinstance(value, Real3x3) else ("high", "low")
    rest = value.values
    for part in parts:
        floats = rest.astype(np.float32)
        rest = rest - floats
        if floats.ndim == 0:
            yield f"{name}.{part}", float(floats)
        elif floats.ndim == 2 and not isinstance(value, Real3x3):
            for number, row in enumerate(floats.tolist()):
                yield f"{name}[{number}].{part}", tuple(row)
        else:
            yield f"{name}.{part}", tuple(floats.T.ravel().tolist())
