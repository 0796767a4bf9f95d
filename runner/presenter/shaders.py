"""GLSL files, joined into programs; the driver's messages about faults name the file and line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files

import moderngl

from runner.presenter.arithmetic import Arithmetic, Reals, as_doubles, as_floats
from runner.presenter.errors import GraphicsError

Part = tuple[str, str]  # the file's name and its text
Uniform = int | float | tuple[int, ...] | tuple[float, ...] | tuple[tuple[int, int], ...] | Reals

_HEADER = "#version 330 core\n"
# Mesa writes 0:14(5), Nvidia 0(14), others 0:14, and Mesa forgets the number of the part that #line can give: so
# each part has a range of line numbers of its own.
_LINES_PER_PART = 100_000
_PLACE = re.compile(r"\b0(?::(\d+)(?:\(\d+\))?|\((\d+)\))(?=\s*:)")


def shader_file(name: str) -> Part:
    """Return the file ``name`` of ``runner/presenter/glsl``."""
    return name, (files("runner.presenter") / "glsl" / name).read_text(encoding="utf-8")


def compile_program(
    context: moderngl.Context, vertex: Part, fragment: Sequence[Part], arithmetic: Arithmetic | None = None
) -> moderngl.Program:
    """Compile a program of one vertex file and several fragment files joined in order.

    With ``arithmetic``, the file of its types and functions comes before ``fragment``.

    Raises
    ------
    GraphicsError
        With the driver's log, its places named by file and line, if the driver refuses the program.
    """
    header, fragment = _HEADER, list(fragment)
    if arithmetic is not None:
        header, fragment = arithmetic.header(context), [shader_file(arithmetic.file), *fragment]
    try:
        return context.program(_join(_HEADER, [vertex]), fragment_shader=_join(header, fragment))
    except moderngl.Error as error:
        stage = [vertex] if "vertex_shader" in str(error) else fragment
        raise GraphicsError(_named(str(error), [name for name, _ in stage])) from None


def set_uniform(program: moderngl.Program, name: str, value: Uniform) -> None:
    """Set the uniform ``name``; KeyError if the program has none that it uses.

    Of an array, drivers keep what the program uses; what it is given beyond that is left out.
    """
    if isinstance(value, Reals):
        _set_reals(program, name, value)
        return
    member = program[name]
    if isinstance(value, tuple) and isinstance(value[0], tuple):
        value = value[: member.array_length]  # type: ignore[union-attr]  # an attribute has none
    member.value = value  # type: ignore[union-attr]  # a member may be an attribute, which has no value


def _set_reals(program: moderngl.Program, name: str, value: Reals) -> None:
    """Set a uniform as the program's arithmetic has it: one of doubles, or several of floats."""
    if name in program:
        doubles = as_doubles(value)
        if isinstance(doubles, tuple) and isinstance(doubles[0], tuple):
            # A member may be an attribute, which has neither length nor value; these are uniforms.
            doubles = doubles[: program[name].array_length]  # type: ignore[union-attr]
        program[name].value = doubles  # type: ignore[union-attr]
        return
    used = [(part, floats) for part, floats in as_floats(name, value) if part in program]
    if not used:
        raise KeyError(name)
    for part, floats in used:
        # A uniform, as above.
        program[part].value = floats  # type: ignore[union-attr]


def _join(header: str, parts: Sequence[Part]) -> str:
    texts = (f"#line {number * _LINES_PER_PART + 1}\n{text}\n" for number, (_, text) in enumerate(parts))
    return header + "".join(texts)


def _named(log: str, names: Sequence[str]) -> str:
    def place(match: re.Match[str]) -> str:
        number, line = divmod(int(match[1] or match[2]), _LINES_PER_PART)
        return f"{names[number]}:{line}" if number < len(names) else match[0]

    return "the driver refuses a shader:\n" + _PLACE.sub(place, log.strip())
