"""The display model and its file, PLVC, and the residual."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import fsolve

from devices.compensation.clipping import clip_cost
from devices.display import (
    NODES,
    DisplayModel,
    Plvc,
    Residual,
    TableCurve,
    ToneCurve,
    kernels_at_black,
    read_display,
    read_rig,
)
from devices.display.model_spec import ModelSpec
from devices.display.plvc import CROSS, PAIRS, _solved
from devices.display.residual import kernels, kernels_and_slopes, place_of
from devices.errors import DeviceError
from documents import InputError
from documents.arrays import Floats

# The display model and its file.

ROOT = Path(__file__).parents[3]
ASUS = ROOT / "configs/displays/asus_vg248qe.yaml"


def test_the_shipped_display_is_the_thesis_s() -> None:
    model = read_display(ASUS).models("side-by-side").left
    assert np.array_equal(model.primaries_XYZ_cd_m2, [[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
    white = model.white_XYZ_cd_m2
    assert white[1] == pytest.approx(26.47)
    assert np.round(white[:2] / white.sum(), 4) == pytest.approx([0.3117, 0.3151])
    # Expression 3.13, the printed inverse, to its digits.
    printed = [[0.12645, -0.06383, -0.01980], [-0.03808, 0.07320, 0.00189], [-0.00021, -0.00291, 0.03453]]
    assert np.abs(model.linear_from_XYZ - printed).max() < 5e-5


def test_clipping_counts_pixels_and_channels() -> None:
    model = read_display(ASUS).models("quad-buffered").left
    linear = np.array([[0.5, 0.5, 0.5], [1.2, 0.5, 0.5], [0.5, -0.1, 0.5], [1.5, 1.5, -0.5], [0.0, 1.0, 0.0]])
    found = model.clipping(linear @ model.primaries_XYZ_cd_m2.T)
    # Red gives 0.001 at code 0, for its offset: the green of linear light (0, 1, 0) has not enough of none.
    assert (found.pixels, found.red, found.green, found.blue) == (5, 3, 2, 1)
    assert (found.any_channel, found.above_full) == (4, 2)
    assert found.percent(found.any_channel) == pytest.approx(80.0)


# A CRT's file: curves with an offset of 0.25 and a black of 0, so that code 0 is far from dark.
CRT = DisplayModel(
    np.zeros(3),
    np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]),
    (ToneCurve(0.75, 0.25, 2.1), ToneCurve(0.75, 0.25, 2.1), ToneCurve(0.75, 0.25, 2.1)),
)


def test_light_below_that_of_code_0_counts() -> None:
    black = CRT.xyz([0.0, 0.0, 0.0])
    assert black[1] > 5.0
    grey = 0.5 / black[1] * black
    found = CRT.clipping(np.stack([grey, 0.999 * black, 1.001 * black]))
    assert (found.any_channel, found.red, found.above_full) == (2, 2, 0)
    assert CRT.code(grey) == pytest.approx(0.0, abs=1e-12)
    assert CRT.shown_black_XYZ_cd_m2 == pytest.approx(black)


_curves = st.builds(ToneCurve, st.floats(0.6, 1.1), st.floats(-0.1, 0.3), st.floats(1.2, 2.8), st.floats(-0.02, 0.05))


@given(st.tuples(_curves, _curves, _curves), st.lists(st.sampled_from([0.0, 1.0, 0.3]), min_size=3, max_size=3))
@example(
    (
        ToneCurve(1.03125, 0.265625, 1.59375, 0.0019028489442997239),
        ToneCurve(1.0918943176931264, 0.25, 1.5, 0.0019028489442997239),
        ToneCurve(1.0, 0.125, 1.201171875, 0.0),
    ),
    [1.0, 1.0, 1.0],
)
def test_a_colour_at_a_limit_is_inside_however_it_was_stored(
    curves: tuple[ToneCurve, ToneCurve, ToneCurve], code: list[float]
) -> None:
    """X, Y and Z are each rounded up or down to single precision: less than one unit in the last place."""
    model = DisplayModel(np.array([0.05, 0.06, 0.08]), CRT.primaries_XYZ_cd_m2, curves)
    asked = model.xyz(code)
    nearest = asked.astype(np.float32)
    below = np.where(nearest <= asked, nearest, np.nextafter(nearest, np.float32(-np.inf)))
    up = np.random.default_rng(0).random((50, 3)) < 0.5
    stored = np.where(up, np.nextafter(below, np.float32(np.inf)), below).astype(np.float64)
    assert model.clipping(np.stack([asked, asked.astype(np.float32)])).any_channel == 0
    assert model.clipping(stored).any_channel == 0
    off = model.primaries_XYZ_cd_m2[:, 0] * 1e-4
    assert model.clipping(model.xyz([0.0, 0.3, 0.3]) - off).red == 1
    assert model.clipping(model.xyz([1.0, 0.3, 0.3]) + off).above_full == 1


@given(st.tuples(_curves, _curves, _curves), st.integers(0, 2**32 - 1))
@example((ToneCurve(), ToneCurve(), ToneCurve(1.0, 5e-7, 2.75, 0.03125)), 0)
@example((ToneCurve(0.7424347523464738, 0.020182255892930014, 2.1, 0.008),) * 3, 1)  # off by 1.2e-6 of the light
def test_a_normalised_model_is_the_same_display(curves: tuple[ToneCurve, ToneCurve, ToneCurve], seed: int) -> None:
    """A code near zero of a curve without offset hardly changes the light: there the light says what the code is."""
    model = DisplayModel(np.array([0.05, 0.06, 0.08]), CRT.primaries_XYZ_cd_m2, curves)
    same = model.normalised
    lowest, highest = same.limits
    assert np.abs(lowest).max() < 1e-12
    assert np.abs(highest - 1.0).max() < 1e-12
    codes = np.random.default_rng(seed).random((20, 3))
    assert np.abs(same.xyz(codes) - model.xyz(codes)).max() < 1e-9
    asked = np.random.default_rng(seed).uniform(0.0, 1.3, (20, 3)) * model.shown_white_XYZ_cd_m2
    answered, expected = same.code(asked), model.code(asked)
    assert np.abs(model.xyz(answered) - model.xyz(expected)).max() < 1e-11
    assert np.abs(answered - expected)[expected > 0.01].max() < 1e-9
    assert np.abs(same.gamut_tolerance * (model.limits[1] - model.limits[0]) / model.gamut_tolerance - 1).max() < 1e-9
    assert same.clipping(asked) == model.clipping(asked)
    assert same.normalised.clipping(asked) == same.clipping(asked)


def test_primaries_that_cannot_be_told_apart_are_refused() -> None:
    curve = ToneCurve()
    with pytest.raises(DeviceError, match="nearly alike"):
        DisplayModel(np.zeros(3), np.ones((3, 3)), (curve, curve, curve))


def _file(tmp_path: Path, modes: str) -> Path:
    path = tmp_path / "d.yaml"
    path.write_text(f"schema_version: 1\npanel: {{resolution_px: [640, 480], pixel_pitch_mm: 0.3}}\nmodes:\n{modes}")
    return path


MODEL = (
    "{black_XYZ_cd_m2: [0, 0, 0], primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]}, "
    "curve: {kind: gog, red: {gain: 1, offset: 0, gamma: 2}, green: {gamma: 2}, blue: {gamma: %s}}}"
)


def test_modes_per_eye_and_same_as(tmp_path: Path) -> None:
    path = _file(
        tmp_path, f"  flat: {{left: {MODEL % 2}, right: {MODEL % '2.5'}}}\n  side-by-side: {{same_as: flat}}\n"
    )
    display = read_display(path)
    models = display.models("side-by-side")
    found = [models.eye("left"), models.eye("right"), display.models("flat").left]
    curves = [model.curves[2] for model in found]
    assert [curve.gamma for curve in curves if isinstance(curve, ToneCurve)] == [2, 2.5, 2]


def test_what_an_eye_s_source_states_of_held_out_readings_is_read(tmp_path: Path) -> None:
    stated = (MODEL % 2)[:-1] + ", source: 'held-out ΔE00 mean 0.31, 95th percentile 0.80, largest 1.20'}"
    display = read_display(_file(tmp_path, f"  flat: {{left: {MODEL % 2}, right: {stated}}}\n"))
    ((eye, errors),) = display.held_out["flat"].items()
    assert (eye, errors.mean, errors.p95, errors.max) == ("right", 0.31, 0.8, 1.2)


@pytest.mark.parametrize(
    ("modes", "part"),
    [
        ("  flat: {same_as: quad}\n", ":4:19: there is no mode 'quad'"),
        ("  flat: {same_as: flat}\n", ":4:19: the mode 'flat' is the same as itself"),
        ("  flat: " + MODEL % 0 + "\n", "'modes.flat.curve.blue.gamma' is 0"),
        ("  flat: " + (MODEL % "2, lift: 0.1") + "\n", "a curve of kind 'gog' has no 'lift'"),
        ("  flat: " + (MODEL % 2).replace("kind: gog", "kind: gogg") + "\n", "did you mean 'gog'?"),
        ("  flat: " + (MODEL % 2).replace("[4, 2, 0]", "[3, 7, 1]") + "\n", ":4:3: the primaries are so nearly alike"),
        ("  flat: {}\n", "black_XYZ_cd_m2' is missing"),
        ("  flat: " + (MODEL % 2).replace("[4, 2, 0]", "[4, 2, .nan]") + "\n", "red.3"),
    ],
)
def test_faults_in_a_display_file_are_placed(tmp_path: Path, modes: str, part: str) -> None:
    with pytest.raises(InputError) as caught:
        read_display(_file(tmp_path, modes))
    assert part in str(caught.value)


@pytest.mark.promise("measured-mode")
def test_a_mode_that_was_not_characterised_is_refused() -> None:
    with pytest.raises(DeviceError, match=r"not characterised in the mode 'side-by-sid'.*did you mean 'side-by-side'"):
        read_display(ASUS).models("side-by-sid")


def test_the_rig_names_its_own_line_when_the_mode_is_absent(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(f"schema_version: 1\ndisplay: {ASUS}\nmode: anaglyph\ndistance_mm: 700\n")
    with pytest.raises(InputError, match=r"rig.yaml:3:7: .*'anaglyph'"):
        read_rig(rig)
    rig.write_text("schema_version: 1\ndisplay: none.yaml\nmode: flat\ndistance_mm: 700\n")
    with pytest.raises(InputError, match=r"rig.yaml:2:10: there is no such"):
        read_rig(rig)


# PLVC in a display file: written and read back, and every wrong number refused in a clear line.

PANEL = "schema_version: 1\npanel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.25}\nmodes:\n"
PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])


def plvc() -> Plvc:
    x = np.linspace(0.0, 1.0, 9)
    curve = TableCurve(tuple(x), tuple(x**2.2))
    own = PRIMARIES.T[:, np.newaxis] * np.linspace(0.97, 1.02, 36).reshape(3, 4, 3)
    return Plvc(np.full(3, 0.1), PRIMARIES, (curve, curve, curve), own, np.linspace(-2, 2, 30).reshape(10, 3))


def written(folder: Path, lines: list[str]) -> Path:
    file = folder / "display.yaml"
    file.write_text(PANEL + "  flat:\n" + "".join(f"    {line}\n" for line in lines), encoding="utf-8")
    return file


def test_it_is_read_as_it_was_written(tmp_path: Path) -> None:
    model = plvc()
    display = read_display(written(tmp_path, ModelSpec.of(model, source="by hand").lines()))
    read = display.models("flat").left
    assert isinstance(read, Plvc)
    codes = np.random.default_rng(1).uniform(0, 1, (200, 3))
    np.testing.assert_allclose(read.xyz(codes), model.xyz(codes), rtol=1e-8)
    assert display.sources["flat"] == "by hand"


def test_mixtures_may_be_left_out(tmp_path: Path) -> None:
    document = yaml.safe_load("\n".join(ModelSpec.of(plvc(), source="").lines()))
    del document["curve"]["mixtures_XYZ_cd_m2"]
    read = read_display(written(tmp_path, yaml.safe_dump(document).splitlines())).models("flat").left
    assert isinstance(read, Plvc)
    assert not read.mixtures_XYZ_cd_m2.any()


WRONG: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "three rows": (lambda c: c["red"]["XYZ_per_light_cd_m2"].pop(), "XYZ_per_light_cd_m2"),
    "two numbers": (lambda c: c["red"]["XYZ_per_light_cd_m2"][0].pop(), "XYZ_per_light_cd_m2"),
    "text": (lambda c: c["green"]["XYZ_per_light_cd_m2"].__setitem__(1, "much"), "XYZ_per_light_cd_m2"),
    "infinite": (lambda c: c["green"]["XYZ_per_light_cd_m2"][1].__setitem__(0, float("inf")), "finite"),
    "not a number": (lambda c: c["mixtures_XYZ_cd_m2"]["red_green"].__setitem__(0, float("nan")), "finite"),
    "a strange key": (lambda c: c["mixtures_XYZ_cd_m2"].update(red_rad=[0, 0, 0]), "red_rad"),
    "a channel that falls": (
        lambda c: c["green"].update(XYZ_per_light_cd_m2=[[-35, -70, -11]] * 4),
        "more drive gives less light",
    ),
    "mixtures beyond all light": (
        lambda c: c["mixtures_XYZ_cd_m2"].update(red_green_blue=[-900, -900, -900]),
        "more drive gives less light",
    ),
    "enormous": (lambda c: c["mixtures_XYZ_cd_m2"].update(red_green=[1e300, 1e300, 1e300]), "at most 1e.12"),
    "very much": (lambda c: c["mixtures_XYZ_cd_m2"].update(red_green=[1e12, 1e12, 1e12]), "cannot be undone"),
    "no tables": (lambda c: c["blue"].pop("light"), "light"),
    "light that falls": (lambda c: c["blue"]["light"].__setitem__(3, 0.9), "rise from 0 to 1"),
}


@pytest.mark.parametrize("fault", WRONG)
def test_what_is_wrong_is_named_with_its_file_and_place(tmp_path: Path, fault: str) -> None:
    spoil, says = WRONG[fault]
    document = yaml.safe_load("\n".join(ModelSpec.of(plvc(), source="").lines()))
    spoil(document["curve"])
    with pytest.raises(InputError, match=says) as refused:
        read_display(written(tmp_path, yaml.safe_dump(document).splitlines()))
    for finding in refused.value.findings:
        assert str(finding.file).endswith("display.yaml")
        assert finding.line


# PLVC as a display model: exact there and back, monotone, one answer to every colour; beside a slow obvious twin.

BLACK = np.array([0.05, 0.05, 0.08])


def of_readings_plvc(seed: int = 1, bend: float = 0.05, mixed: float = 0.02) -> Plvc:
    """Return a display whose channels drift by shares of ``bend`` and take shares of ``mixed`` from each other."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 1.0, 17)
    curves = tuple(TableCurve(tuple(x), tuple(x**gamma)) for gamma in (1.8, 2.2, 2.6))
    own = PRIMARIES.T[:, np.newaxis] * (1.0 + bend * rng.uniform(-1, 1, (3, 4, 3)))
    mixtures = mixed * rng.uniform(-1, 1, (10, 3)) * PRIMARIES.sum(axis=1)
    return Plvc(BLACK, PRIMARIES, curves, own, mixtures)  # type: ignore[arg-type]  # three curves, one each


def plain(seed: int = 0) -> Plvc:
    """Return one whose channels do keep their chromaticity and add up."""
    return of_readings_plvc(seed, 0.0, 0.0)


def twin(model: Plvc, T: np.ndarray) -> np.ndarray:
    """Return XYZ of linear light T (3,), written out term by term."""
    XYZ = model.black_XYZ_cd_m2.copy()
    for c in range(3):
        XYZ = XYZ + T[c] * np.array(
            [
                np.polyval(
                    np.polyfit([*NODES, 1.0], [*model.XYZ_per_light_cd_m2[c, :, k], PRIMARIES[k, c]], 4), T[c] ** 0.5
                )
                for k in range(3)
            ]
        )
    mixtures = model.mixtures_XYZ_cd_m2
    for (i, j), given_ in zip(PAIRS, mixtures[:3], strict=True):
        XYZ = XYZ + T[i] * T[j] * given_
    XYZ = XYZ + T[0] * T[1] * T[2] * mixtures[3]
    for (i, j), given_ in zip(CROSS, mixtures[4:], strict=True):
        XYZ = XYZ + T[i] * (1 - T[i]) * T[j] * given_
    return np.asarray(XYZ)


def test_the_forward_model_is_the_sum_of_its_terms() -> None:
    model = of_readings_plvc()
    codes = np.random.default_rng(3).uniform(0, 1, (50, 3))
    linear = np.stack([curve.linear(codes[:, c]) for c, curve in enumerate(model.curves)], axis=1)
    np.testing.assert_allclose(model.xyz(codes), [twin(model, T) for T in linear], rtol=1e-12)


def test_without_drift_and_mixtures_it_is_the_additive_model() -> None:
    codes = np.random.default_rng(3).uniform(0, 1, (100, 3))
    model = plain()
    expected = BLACK + np.stack([c.linear(codes[:, i]) for i, c in enumerate(model.curves)], axis=1) @ PRIMARIES.T
    np.testing.assert_allclose(model.xyz(codes), expected, rtol=1e-12)
    assert model.steps == 2


@pytest.mark.parametrize("seed", range(2))
def test_there_and_back_within_a_millionth_of_a_code(seed: int) -> None:
    model = of_readings_plvc(seed)
    rng = np.random.default_rng(seed)
    codes = np.concatenate(
        [rng.uniform(0, 1, (4000, 3)), rng.uniform(1e-3, 1, (4000, 3)) ** 3, np.eye(3), 1 - np.eye(3)]
    )
    codes = np.maximum(codes, 2e-3)
    assert np.abs(model.code(model.xyz(codes)) - codes).max() * 255 <= 1e-6
    ends = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    np.testing.assert_allclose(model.xyz(model.code(model.xyz(ends))), model.xyz(ends), atol=1e-9)


def test_newton_agrees_with_a_general_solver() -> None:
    model = of_readings_plvc()
    for T in np.random.default_rng(5).uniform(0.05, 0.95, (8, 3)):
        XYZ = twin(model, T)

        def miss(z: np.ndarray, asked: np.ndarray = XYZ) -> np.ndarray:
            return np.asarray(twin(model, z**2) - asked)

        found = fsolve(miss, np.full(3, 0.7), xtol=1e-13) ** 2
        np.testing.assert_allclose(model.linear(XYZ), found, atol=1e-9)


def test_three_equations_are_solved_and_singular_ones_have_finite_answers() -> None:
    random = np.random.default_rng(6)
    A, b = random.normal(size=(3, 3, 50)), random.normal(size=(3, 50))
    assert _solved(A, b) == pytest.approx(np.linalg.solve(A.T.transpose(0, 2, 1), b.T[..., None])[..., 0].T, rel=1e-6)
    assert np.isfinite(_solved(np.zeros((3, 3, 2)), b[:, :2])).all()


def test_slopes_are_those_of_the_light() -> None:
    model = of_readings_plvc()
    T = np.random.default_rng(4).uniform(0.05, 0.95, (30, 3))
    for c in range(3):
        step = 1e-6 * np.eye(3)[c]
        there = (model.light_of(T + step) - model.light_of(T - step)) / 2e-6
        np.testing.assert_allclose(model.slopes(T)[:, :, c], there, atol=1e-8)


def test_more_drive_gives_more_of_a_channel_s_own_light_whatever_the_others_do() -> None:
    model = of_readings_plvc()
    for others in ([0.0, 0.0], [0.4, 0.9], [1.0, 1.0]):
        for c in range(3):
            codes = np.insert(np.tile(others, (256, 1)), c, np.linspace(0, 1, 256), axis=1)
            light = model.in_primaries(model.xyz(codes))[:, c]
            assert np.all(np.diff(light) > 0)
            np.testing.assert_array_less(-1e-12, np.diff(model.code(model.xyz(codes))[:, c]))


def test_outside_the_gamut_every_colour_has_one_answer_that_comes_back() -> None:
    model = of_readings_plvc()
    T = np.random.default_rng(6).uniform(-0.5, 1.5, (3000, 3))
    np.testing.assert_allclose(model.linear(model.xyz_of_linear(T)), T, atol=1e-9)
    clipping = model.clipping(model.xyz_of_linear(T))
    assert clipping.any_channel == int(((T < -1e-6) | (T > 1 + 1e-6)).any(axis=1).sum())
    assert clip_cost(model, model.xyz_of_linear(np.clip(T, 0, 1))).delta_e_00_max < 1e-6
    assert clip_cost(model, model.xyz_of_linear(T)).delta_e_00_max > 1.0


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3))
def test_every_finite_colour_has_finite_codes(XYZ: list[float]) -> None:
    codes = of_readings_plvc().code(XYZ)
    assert np.all((codes >= 0) & (codes <= 1))


def test_white_is_all_channels_together() -> None:
    model = of_readings_plvc()
    np.testing.assert_allclose(model.white_XYZ_cd_m2, model.xyz(np.ones(3)), rtol=1e-12)
    assert np.abs(model.white_XYZ_cd_m2 - BLACK - PRIMARIES.sum(axis=1)).max() > 0.1


@pytest.mark.parametrize("wrong", [np.zeros((3, 3, 3)), np.full((3, 4, 3), np.nan)])
def test_other_shapes_and_numbers_that_are_not_finite_are_refused(wrong: np.ndarray) -> None:
    model = of_readings_plvc()
    with pytest.raises(DeviceError, match="XYZ_per_light_cd_m2"):
        Plvc(BLACK, PRIMARIES, model.curves, wrong, model.mixtures_XYZ_cd_m2)


# The residual of a display model: its slopes, black, its inverse, its file, and what is refused.


def smooth(seed: int = 1, size: float = 0.02, count: int = 12, width: float = 0.875) -> Plvc:
    """A display with a residual of ``size`` of white at random knots, beside drift and mixtures."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 1.0, 17)
    red, green, blue = (TableCurve(tuple(x), tuple(x**gamma)) for gamma in rng.uniform(1.6, 2.6, 3))
    own = PRIMARIES.T[:, None] * (1.0 + 0.03 * rng.uniform(-1, 1, (3, 4, 3)))
    white = PRIMARIES.sum(axis=1)
    mixtures = 0.01 * rng.uniform(-1, 1, (10, 3)) * white
    residual = Residual(rng.uniform(0, 0.88, (count, 3)), width, size * rng.uniform(-1, 1, (count, 3)) * white)
    return Plvc(np.full(3, 0.05), PRIMARIES, (red, green, blue), own, mixtures, residual)


def test_another_residual_is_another_display() -> None:
    """Else a session would be resumed on it without a word, and costs of clipping be taken from before."""
    one = smooth(1)
    assert one.residual is not None
    wider = replace(one.residual, width=1.1 * one.residual.width)
    others = [smooth(1, size=0.03), replace(one, residual=wider), replace(one, residual=None)]
    told = [json.dumps(model.numbers) for model in (one, smooth(1), *others)]
    assert told[0] == told[1]
    assert len(set(told)) == 4


def residual_twin(model: Plvc, T: Floats) -> Floats:
    """The residual's XYZ, term by term."""
    residual = model.residual
    assert residual is not None

    def phi(place: Floats, knot: Floats) -> float:
        rho = float(np.sqrt(((place - knot) ** 2).sum())) / residual.width
        return (1 - rho) ** 4 * (4 * rho + 1) if rho < 1 else 0.0

    out = np.zeros_like(T)
    for row, light in enumerate(T):
        for knot, XYZ in zip(residual.knots, residual.XYZ_cd_m2, strict=True):
            place = np.sqrt(light + 1 / 64) - 1 / 8
            out[row] += XYZ * (phi(place, knot) - phi(np.zeros(3), knot))
    return out


def test_it_is_the_sum_of_its_kernels() -> None:
    model = smooth()
    T = np.random.default_rng(2).uniform(0, 1, (50, 3))
    alone = replace(model, residual=None)
    np.testing.assert_allclose(model.xyz_of_linear(T) - alone.xyz_of_linear(T), residual_twin(model, T), atol=1e-12)


def test_black_stays_black() -> None:
    model = smooth()
    np.testing.assert_allclose(model.xyz(np.zeros(3)), model.black_XYZ_cd_m2, atol=1e-12)
    assert model.residual is not None
    here = kernels(np.zeros((1, 3)), model.residual.knots, model.residual.width)
    np.testing.assert_array_equal(here, np.zeros_like(here))
    assert np.all(kernels_at_black(model.residual) >= 0)


def test_slopes_are_those_of_small_steps_down_to_black() -> None:
    model = smooth()
    assert model.residual is not None
    T = np.concatenate([np.random.default_rng(3).uniform(1e-4, 1, (30, 3)), np.full((1, 3), 1e-4)]).T
    made, by = kernels_and_slopes(T, model.residual.knots, model.residual.width)
    np.testing.assert_allclose(made.T, kernels(T.T, model.residual.knots, model.residual.width), atol=1e-14)
    for channel in range(3):
        step = np.zeros((3, 1))
        step[channel] = 1e-6
        above, below = (
            kernels_and_slopes(T + sign * step, model.residual.knots, model.residual.width)[0] for sign in (1, -1)
        )
        np.testing.assert_allclose(by[channel], (above - below) / 2e-6, atol=1e-7)
    assert np.all(place_of(np.linspace(0, 1, 9)) <= 1.0)


@pytest.mark.parametrize("seed", range(2))
def test_it_is_undone_everywhere(seed: int) -> None:
    model = smooth(seed, 0.01)
    assert model.clashes() == 0
    rng = np.random.default_rng(seed)
    T = np.concatenate(
        [rng.uniform(0, 1, (500, 3)), 10 ** rng.uniform(-8, 0, (500, 3)), rng.uniform(-0.5, 1.5, (300, 3))]
    )
    np.testing.assert_allclose(model.linear(model.xyz_of_linear(T)), T, atol=1e-9)


def test_one_that_turns_light_round_is_refused() -> None:
    model = smooth(size=1.0)
    assert model.clashes() > 0
    with pytest.raises(DeviceError, match="more drive gives less light"):
        assert model.steps


def test_a_display_file_gives_it_back() -> None:
    model = smooth(count=6, size=0.003)
    read = ModelSpec.model_validate(yaml.safe_load("\n".join(ModelSpec.of(model, source="test").lines()))).model()
    assert isinstance(read, Plvc)
    assert read.residual is not None
    codes = np.random.default_rng(1).uniform(0, 1, (200, 3))
    np.testing.assert_allclose(read.xyz(codes), model.xyz(codes), atol=1e-6)


@pytest.mark.parametrize(
    ("knots", "width", "XYZ", "says"),
    [
        (np.zeros((2, 3)), 1.0, np.zeros((3, 3)), "one each"),
        (np.zeros((0, 3)), 1.0, np.zeros((0, 3)), "1 to 48 rows"),
        (np.zeros((49, 3)), 1.0, np.zeros((49, 3)), "1 to 48 rows"),
        (np.full((2, 3), np.nan), 1.0, np.zeros((2, 3)), "finite"),
        (np.full((2, 3), 1.5), 1.0, np.zeros((2, 3)), r"0\.\.1"),
        (np.zeros((2, 3)), 0.0, np.zeros((2, 3)), "width"),
        (np.zeros((2, 3)), float("nan"), np.zeros((2, 3)), "width"),
    ],
)
def test_wrong_residuals_are_refused(knots: Floats, width: float, XYZ: Floats, says: str) -> None:
    with pytest.raises(DeviceError, match=says):
        Residual(knots, width, XYZ)


def test_one_beyond_all_measure_is_refused() -> None:
    model = smooth()
    with pytest.raises(DeviceError, match="thousand times"):
        replace(model, residual=Residual(np.zeros((1, 3)), 1.0, np.full((1, 3), 1e9)))
