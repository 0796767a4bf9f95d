"""What colours are computed in: doubles or two floats, by one source, to the same codes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import Correction, least_squares
from devices.display import Crosstalk, DisplayModel, EyeModels, GainMap, TableCurve, ToneCurve
from documents.arrays import Floats
from runner.presenter import MODES, ColourPass, GraphicsError, PresentationError, arithmetic_choice, find_mode
from runner.presenter.arithmetic import Arithmetic, Real3x3, Reals, as_floats
from runner.presenter.arithmetic_choice import TOLERANCE, VARIABLE, arithmetic_errors, arithmetic_of
from runner.presenter.code_pass import release_codes
from runner.presenter.colour_pass import MixedPass
from runner.presenter.compensated_pass import CompensatedPass
from runner.presenter.shaders import _named, compile_program, set_uniform, shader_file
from runner.presenter.surfaces.egl import EglSurface
from tests.choice import nightly
from tests.runner.presenter.every_mode import draw

# Of an 8-bit code. Where all of a channel's light is what doubles round by, 1e-17 of full, gamma 2.9 makes 0.001 of it,
# and doubles are what is off.
EQUAL_CODES = 1e-3
EQUAL_AT_NO_LIGHT_CODES = 2e-3
Codes = Callable[[DisplayModel], NDArray[np.float32]]


@pytest.mark.parametrize("kind", list(Arithmetic))
def test_every_operation_is_as_exact_as_it_should_be(egl: EglSurface, kind: Arithmetic) -> None:
    errors = arithmetic_errors(egl.context, kind)
    assert set(errors) == {"sum", "difference", "product", "quotient", "root", "product with floats", "matrix"}
    assert max(errors.values()) <= TOLERANCE


def _without(monkeypatch: pytest.MonkeyPatch, old: str, new: str) -> None:
    """Have a driver's compiler turn ``old`` into ``new``, as one does that takes sums for exact."""

    def read(name: str) -> tuple[str, str]:
        name, text = shader_file(name)
        return name, text.replace(old, new)

    monkeypatch.setattr("runner.presenter.shaders.shader_file", read)


# (a + b) - a is b, and what a product was rounded by is nothing.
@pytest.mark.parametrize("old", ["KEPT(sum - a)", "KEPT(a - of_a) + KEPT(b - of_b)", "a_high * b_high - product"])
def test_a_driver_that_takes_sums_apart_is_refused(monkeypatch: pytest.MonkeyPatch, egl: EglSurface, old: str) -> None:
    new = {"KEPT(sum - a)": "b"}.get(old, "0.0 * a")
    _without(monkeypatch, old, new)
    monkeypatch.setenv(VARIABLE, "two-floats")
    with pytest.raises(GraphicsError, match=r"\(two-floats: \w+ errs by .*guard"):
        arithmetic_of(egl.context)


def test_a_driver_that_only_the_guard_keeps_from_it_has_the_guard(
    monkeypatch: pytest.MonkeyPatch, egl: EglSurface
) -> None:
    _without(monkeypatch, "#define KEPT(x) (x)", "#define KEPT(x) (x * 1.000001)")
    monkeypatch.setenv(VARIABLE, "two-floats")
    assert arithmetic_of(egl.context).kind is Arithmetic.GUARDED


def test_two_floats_are_chosen_where_there_are_no_doubles(monkeypatch: pytest.MonkeyPatch, egl: EglSurface) -> None:
    assert arithmetic_of(egl.context).kind is Arithmetic.DOUBLES
    egl.context.extra = None
    known = Arithmetic.is_known_to
    monkeypatch.setattr(
        Arithmetic, "is_known_to", lambda kind, context: kind is not Arithmetic.DOUBLES and known(kind, context)
    )
    chosen = arithmetic_of(egl.context)
    assert chosen.kind is Arithmetic.TWO_FLOATS
    assert "has no 64-bit" in chosen.reason
    assert arithmetic_of(egl.context) is chosen
    assert egl.facts.arithmetic == str(chosen)
    monkeypatch.setenv(VARIABLE, "doubles")
    with pytest.raises(GraphicsError, match=r"GL_ARB_gpu_shader_fp64.*CYCLOPEAN_ARITHMETIC"):
        arithmetic_of(egl.context)


@pytest.mark.parametrize(("two_floats_s", "kind"), [(0.5, Arithmetic.TWO_FLOATS), (0.7, Arithmetic.DOUBLES)])
def test_the_faster_one_is_chosen_where_it_is_much_faster(
    monkeypatch: pytest.MonkeyPatch, egl: EglSurface, two_floats_s: float, kind: Arithmetic
) -> None:
    monkeypatch.setattr(arithmetic_choice, "_ON_THE_PROCESSOR", ())
    times = {Arithmetic.TWO_FLOATS: two_floats_s, Arithmetic.DOUBLES: 1.0}
    monkeypatch.setattr(arithmetic_choice, "_time_s", lambda _context, timed: times[timed])
    assert arithmetic_of(egl.context).kind is kind
    assert f"{two_floats_s:.2f} × the time" in arithmetic_of(egl.context).reason


def test_doubles_that_are_none_are_not_taken(monkeypatch: pytest.MonkeyPatch, egl: EglSurface) -> None:
    monkeypatch.setattr(arithmetic_choice, "_ON_THE_PROCESSOR", ())
    _without(monkeypatch, "#define Real3 dvec3", "#define Real3 vec3")
    chosen = arithmetic_of(egl.context)
    assert chosen.kind is Arithmetic.TWO_FLOATS
    assert "not exact enough" in chosen.reason


def test_a_driver_that_does_not_compile_precise_has_the_guard(monkeypatch: pytest.MonkeyPatch, egl: EglSurface) -> None:
    _without(monkeypatch, "#define EXACT precise", "#define EXACT precis")
    monkeypatch.setenv(VARIABLE, "two-floats")
    assert arithmetic_of(egl.context).kind is Arithmetic.GUARDED


@pytest.mark.parametrize("kind", [Arithmetic.DOUBLES, *nightly(Arithmetic.TWO_FLOATS, Arithmetic.GUARDED)])
def test_a_pass_can_be_timed(egl: EglSurface, kind: Arithmetic) -> None:
    before = egl.context.fbo
    assert arithmetic_choice._time_s(egl.context, kind) > 0.0
    assert egl.context.fbo is before


def test_a_slip_in_the_variable_is_named(monkeypatch: pytest.MonkeyPatch, egl: EglSurface) -> None:
    monkeypatch.setenv(VARIABLE, "double")
    with pytest.raises(GraphicsError, match=r"is 'double' \(.*doubles, two-floats, two-floats-guarded"):
        arithmetic_of(egl.context)
    # Patches are measured, and screens checked, without colours: a surface says so and goes on.
    assert egl.facts.arithmetic.startswith("nothing: CYCLOPEAN_ARITHMETIC is 'double'")


def test_a_sum_of_reals_as_if_they_were_floats_does_not_compile(egl: EglSurface) -> None:
    bad = ("bad.frag", "out vec4 c;\nvoid main() { c = vec4(float_of(real(1.0) + real(2.0))); }")
    with pytest.raises(GraphicsError, match=r"bad\.frag:2"):
        compile_program(egl.context, shader_file("area.vert"), [bad], Arithmetic.TWO_FLOATS)


def test_numbers_of_uniforms_are_held_to_their_bits() -> None:
    rng = np.random.default_rng(1)
    for value, bits in (
        (Reals(np.array(np.pi)), 48),
        (Reals(rng.normal(size=3)), 48),
        (Reals(rng.normal(size=(4, 3))), 48),
        (Real3x3(rng.normal(size=(3, 3))), 53),
    ):
        parts = dict(as_floats("name", value))
        sums: dict[str, Floats] = {}
        for name, floats in parts.items():
            member = name.rpartition(".")[0]
            sums[member] = sums.get(member, np.zeros(1)) + np.asarray(floats)
        wanted = value.values.T if isinstance(value, Real3x3) else value.values
        np.testing.assert_allclose(np.ravel(list(sums.values())), wanted.ravel(), rtol=2.0**-bits)


def test_a_uniform_that_the_program_has_not_is_named(egl: EglSurface) -> None:
    plain = ("plain.frag", "out vec4 c;\nvoid main() { c = vec4(1.0); }")
    program = compile_program(egl.context, shader_file("area.vert"), [plain], Arithmetic.TWO_FLOATS)
    with pytest.raises(KeyError, match="black"):
        set_uniform(program, "black", Reals(np.zeros(3)))


def _table(gamma: float) -> TableCurve:
    x = np.linspace(0.0, 1.0, 17)
    return TableCurve(tuple(x), tuple(x**gamma))


def _displays(model: Callable[..., DisplayModel]) -> dict[str, DisplayModel]:
    own = model(2.2, 0.1)
    black, primaries = own.black_XYZ_cd_m2, own.primaries_XYZ_cd_m2
    tabled = (_table(1.8), _table(2.4), _table(2.9))
    return {
        "steep, no black": model(2.8),
        "lifted": model(2.4, 0.25, 2.0**-8),
        "with an offset": model(2.2, 0.1, 0.001, 0.1),
        "tables": DisplayModel(black, primaries, tabled),
        "tables and formulas": DisplayModel(black, primaries, (tabled[0], ToneCurve(gamma=2.9), tabled[2])),
    }


@pytest.fixture
def drawn_in(egl: EglSurface, monkeypatch: pytest.MonkeyPatch) -> Callable[..., NDArray[np.float64]]:
    """What a pass of (arithmetic, class, arguments, pictures) draws, in 8-bit codes, unrounded."""

    def draw(kind: Arithmetic, make: Callable[..., object], arguments: tuple[object, ...], *pictures: Floats) -> Floats:
        monkeypatch.setenv(VARIABLE, kind.value)
        made = make(egl.context, *arguments)
        uploaded = [
            egl.context.texture(XYZ.shape[1::-1], 3, XYZ.astype(np.float32).tobytes(), alignment=1, dtype="f4")
            for XYZ in pictures
        ]
        codes = made.run(*uploaded, dtype="f4")  # type: ignore[attr-defined]  # every pass has it
        found = np.frombuffer(codes.read(components=3, dtype="f4", alignment=1), np.float32) * 255.0
        release_codes(codes)
        for held in (*uploaded, made):
            held.release()  # type: ignore[attr-defined]  # every pass has it
        return np.asarray(found, dtype=np.float64)

    return draw


@pytest.mark.parametrize("kind", [Arithmetic.TWO_FLOATS, *nightly(Arithmetic.GUARDED)])
@pytest.mark.parametrize(
    "name", ["steep, no black", "tables and formulas", *nightly("lifted", "with an offset", "tables")]
)
def test_codes_in_two_floats_are_those_in_doubles(
    drawn_in: Callable[..., Floats],
    model: Callable[..., DisplayModel],
    colour_ramps: Codes,
    name: str,
    kind: Arithmetic,
) -> None:
    display = _displays(model)[name]
    XYZ = colour_ramps(display)
    codes, doubles = (drawn_in(each, ColourPass, (display,), XYZ) for each in (kind, Arithmetic.DOUBLES))
    off = np.abs(codes - doubles).reshape(XYZ.shape)[::-1]
    no_light = np.abs(display.linear(XYZ)) < 1e-14
    assert off[~no_light].max() < EQUAL_CODES
    assert off.max() < EQUAL_AT_NO_LIGHT_CODES
    assert doubles.max() > 250.0


def test_compensated_and_mixed_codes_in_two_floats_are_those_in_doubles(
    drawn_in: Callable[..., Floats], model: Callable[..., DisplayModel], colour_ramps: Codes
) -> None:
    left, right = model(2.4, 0.1), model(2.2, 0.08)
    models = EyeModels(left, right)
    views = colour_ramps(left), colour_ramps(right)[:, ::-1]
    gain_map = GainMap(np.array([[90.0, 95.0], [100.0, 97.0], [99.0, 92.0]]), (320, 480), "corners", "minimum")
    leaks = Crosstalk(0.03 * np.eye(3), 0.02 * np.eye(3))
    mixture = least_squares(models, (0.2, 0.01, 0.0), (0.0, 0.4, 0.3))
    for make, arguments in (
        (CompensatedPass, (models, Correction(leaks, gain_map), "left")),
        (CompensatedPass, (models, Correction(leaks), "right")),
        (CompensatedPass, (models, Correction(None, gain_map), "left")),
        (MixedPass, (mixture,)),
    ):
        codes, doubles = (
            drawn_in(kind, make, arguments, *views) for kind in (Arithmetic.TWO_FLOATS, Arithmetic.DOUBLES)
        )
        assert np.abs(codes - doubles).max() < EQUAL_CODES


def test_infinite_light_is_full_drive(drawn_in: Callable[..., Floats], model: Callable[..., DisplayModel]) -> None:
    display = model(2.2)
    XYZ = np.full((2, 2, 3), 1.0) * display.white_XYZ_cd_m2 * np.array([1e30, 3e36, 1e4, 0.0]).reshape(2, 2, 1)
    for kind in Arithmetic:
        found = drawn_in(kind, ColourPass, (display,), XYZ.astype(np.float32)).reshape(2, 2, 3)
        assert found[1].min() == 255.0
        assert found[0, 0].max() == 255.0
        assert found[0, 1].max() == 0.0


# A driver of OpenGL 3.3 without doubles and without `precise` shows the same codes, in every mode.


SCRIPT = Path(__file__).with_name("every_mode.py")
# What Mesa's drivers are to leave out.
OPENGL_3_3 = {
    "MESA_EXTENSION_OVERRIDE": "-GL_ARB_gpu_shader_fp64 -GL_ARB_gpu_shader5",
    "MESA_GL_VERSION_OVERRIDE": "3.3",
    "MESA_GLSL_VERSION_OVERRIDE": "330",
}


def _draw_elsewhere(file: Path, environment: dict[str, str], words: Sequence[str]) -> str:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(file), *words],
        env={**os.environ, **environment, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.nightly
@pytest.mark.parametrize("words", [(), pytest.param(("everything",), marks=pytest.mark.stress)])
def test_every_mode_needs_opengl_3_3_and_no_doubles(tmp_path: Path, words: Sequence[str]) -> None:
    try:
        EglSurface((16, 16)).close()
    except PresentationError as error:
        pytest.skip(str(error))
    doubles, arithmetic = draw(bool(words))
    if not arithmetic.startswith("doubles"):
        pytest.skip(f"this driver computes in {arithmetic}")
    drawn = {key.split()[0] for key in doubles}
    assert drawn == {name for name in MODES if not find_mode(name).needs_stereo}
    told = _draw_elsewhere(tmp_path / "codes.npz", OPENGL_3_3, words)
    if not told.startswith("two-floats"):
        pytest.skip(f"this driver is not Mesa's: OpenGL could not be taken from it; it computed in {told}")
    assert told == "two-floats-guarded: the driver has no 64-bit floats"
    with np.load(tmp_path / "codes.npz") as found:
        assert set(found) == set(doubles)
        for name, codes in doubles.items():
            off = np.abs(found[name].astype(int) - codes)
            assert codes.max() > 200, name
            # Where the light lies between two codes but for a thousandth, either is right.
            assert off.max() <= 1, name
            assert np.mean(off > 0) < 2e-3, name


# A shader that does not compile is named by file and line.


GOOD = ("good.glsl", "float two() {\n    return 2.0;\n}")
BAD = ("bad.frag", "out vec4 pixel;\n\nvoid main() {\n    pixel = vec4(nonsense);\n}")


def test_the_file_and_line_of_a_fault_are_named(egl: EglSurface) -> None:
    with pytest.raises(GraphicsError, match=r"(?s)refuses a shader:.*bad\.frag:4.*nonsense"):
        compile_program(egl.context, shader_file("area.vert"), [GOOD, BAD])


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
