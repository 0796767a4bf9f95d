"""GLSL files, joined into programs; the driver's messages about faults name the file and line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files

import moderngl

from runner.presenter.errors import GraphicsError

Part = tuple[str, str]  # the file's name and its text
Uniform = (
    int | float | tuple[int, ...] | tuple[float, ...] | tuple[tuple[int, int], ...] | tuple[tuple[float, ...], ...]
)

_HEADERS = {False: "#version 330 core\n", True: "#version 330 core\n#extension GL_ARB_gpu_shader_fp64 : require\n"}
# Mesa writes 0:14(5), Nvidia 0(14), others 0:14, and Mesa forgets the number of the part that #line can give: so
# each part has a range of line numbers of its own.
_LINES_PER_PART = 100_000
_PLACE = re.compile(r"\b0(?::(\d+)(?:\(\d+\))?|\((\d+)\))(?=\s*:)")


def shader_file(name: str) -> Part:
    """Return the file ``name`` of ``runner/presenter/glsl``."""
    return name, (files("runner.presenter") / "glsl" / name).read_text(encoding="utf-8")


def compile_program(
    context: moderngl.Context, vertex: Part, fragment: Sequence[Part], *, doubles: bool = False
) -> moderngl.Program:
    """Compile a program of one vertex file and several fragment files joined in order.

    ``doubles`` asks for 64-bit arithmetic (GL_ARB_gpu_shader_fp64, part of OpenGL 4.0).

    Raises
    ------
    GraphicsError
        With the driver's log, its places named by file and line, if the driver refuses the program.
    """
    if doubles and context.version_code < 400 and "GL_ARB_gpu_shader_fp64" not in context.extensions:
        raise GraphicsError(
            f"the driver {context.info['GL_RENDERER']} cannot compute with 64 bits in a shader "
            "(GL_ARB_gpu_shader_fp64), and 32 bits do not hold the colours' accuracy; update it or use another"
        )
    header = _HEADERS[doubles]
    try:
        return context.program(_join(_HEADERS[False], [vertex]), fragment_shader=_join(header, fragment))
    except moderngl.Error as error:
        stage = [vertex] if "vertex_shader" in str(error) else list(fragment)
        raise GraphicsError(_named(str(error), [name for name, _ in stage])) from None


def set_uniform(program: moderngl.Program, name: str, value: Uniform) -> None:
    """Set the uniform ``name``; KeyError if the program has none that it uses.

    Of an array, drivers keep what the program uses; what it is given beyond that is left out.
    """
    member = program[name]
    if isinstance(value, tuple) and isinstance(value[0], tuple):
        value = value[: member.array_length]  # type: ignore[union-attr]  # an attribute has none
    member.value = value  # type: ignore[union-attr]  # a member may be an attribute, which has no value


def _join(header: str, parts: Sequence[Part]) -> str:
    texts = (f"#line {number * _LINES_PER_PART + 1}\n{text}\n" for number, (_, text) in enumerate(parts))
    return header + "".join(texts)


def _named(log: str, names: Sequence[str]) -> str:
    def place(match: re.Match[str]) -> str:
        number, line = divmod(int(match[1] or match[2]), _LINES_PER_PART)
        return f"{names[number]}:{line}" if number < len(names) else match[0]

    return "the driver refuses a shader:\n" + _PLACE.sub(place, log.strip())
