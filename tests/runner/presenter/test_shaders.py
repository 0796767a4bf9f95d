"""A shader that does not compile is named by file and line."""

from __future__ import annotations

import pytest

from runner.presenter import GraphicsError
from runner.presenter.shaders import _named, compile_program, shader_file
from runner.presenter.surfaces.egl import EglSurface

GOOD = ("good.glsl", "float two() {\n    return 2.0;\n}")
BAD = ("bad.frag", "out vec4 pixel;\n\nvoid main() {\n    pixel = vec4(nonsense);\n}")


def test_the_file_and_line_of_a_fault_are_named(egl: EglSurface) -> None:
    with pytest.raises(GraphicsError, match=r"(?s)refuses a shader:.*bad\.frag:4.*nonsense"):
        compile_program(egl.context, shader_file("area.vert"), [GOOD, BAD])


def test_a_fault_in_the_vertex_file_is_named_too(egl: EglSurface) -> None:
    bad = ("bad.vert", "void main() {\n    gl_Position = vec3(0.0);\n}")
    with pytest.raises(GraphicsError, match=r"bad\.vert:2"):
        compile_program(egl.context, bad, [("plain.frag", "out vec4 pixel;\nvoid main() { pixel = vec4(1.0); }")])


@pytest.mark.parametrize(
    ("log", "named"),
    [
        ("0:100004(17): error: `nonsense' undeclared", "bad.frag:4: error"),
        ("0(100004) : error C1503: undefined variable", "bad.frag:4 : error"),
        ("ERROR: 0:100004: 'nonsense' : undeclared", "ERROR: bad.frag:4: 'nonsense'"),
    ],
)
def test_the_logs_of_every_driver_are_understood(log: str, named: str) -> None:
    assert named in _named(log, ["good.glsl", "bad.frag"])
