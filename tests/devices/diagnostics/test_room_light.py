"""The light of the room in readings: found, taken off, and compared with a display file in it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from devices.characterise import fit_display
from devices.diagnostics import Diagnosis, MeasuredSet, examine, judge_display, readings, settling, time_trend
from devices.diagnostics.room_light import in_light_of, light_through, room_light, room_lights, without_room
from devices.display import DisplayModel, EyeModels, PanelSpec, ToneCurve, read_display
from devices.display.model_spec import ModelSpec, ten_digits
from devices.errors import DeviceError
from devices.readings import Measurements, PatchEye, find_patches, write_csv
from devices.readings.table import joined
from documents.yaml import yaml_lines
from tests.devices.diagnostics.simulated import characterisation
from tests.kept import known

pytestmark = pytest.mark.usefixtures("fits_kept")


# The room's light from readings with the display switched off: found, taken off, and kept apart in what is written.

AMBIENT = np.array([0.3, 0.32, 0.27])
MODEL = DisplayModel(
    np.array([0.05, 0.06, 0.08]),
    np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]),
    (ToneCurve(gamma=2.1), ToneCurve(gamma=2.2), ToneCurve(gamma=2.3)),
)


def _readings(*, lit: bool = True) -> Measurements:
    """Some of Table C.1 in the room's light or in the dark, and three readings of that light with the screen off."""
    every = find_patches("table_c1").patches
    patches = [every[row] for row in np.union1d(np.arange(0, 120, 4), [26, 52, 78, 119])]
    codes = np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), *(patch.codes for patch in patches), *[(0.0, 0.0, 0.0)] * 3])
    light = MODEL.xyz(codes) + (AMBIENT if lit else 0.0)
    light[-3:] = AMBIENT
    names = ("black", "white", *(patch.name for patch in patches), *(f"black@screen-off#{n}" for n in (1, 2, 3)))
    return Measurements(codes, light, names, mode="flat")


def test_it_is_taken_off_readings_that_hold_it() -> None:
    bare, found = without_room(_readings())
    assert found["both"].readings == 3
    assert found["both"].held
    assert found["both"].ambient_XYZ_cd_m2 == pytest.approx(AMBIENT)
    assert bare.XYZ[:-3] == pytest.approx(MODEL.xyz(bare.codes[:-3]), abs=1e-9)
    assert bare.XYZ[-3:] == pytest.approx(np.tile(AMBIENT, (3, 1)))
    contrasts = found["both"].contrasts
    assert contrasts == pytest.approx((MODEL.contrast(), MODEL.in_room(AMBIENT).contrast()))
    assert "1618 without it and 256 with it." in found["both"].words


def test_readings_in_the_dark_stay_as_they_are() -> None:
    dark = _readings(lit=False)
    bare, found = without_room(dark)
    assert not found["both"].held
    assert np.array_equal(bare.XYZ, dark.XYZ)
    assert "the display was read in the dark" in found["both"].words
    assert found["both"].contrasts == pytest.approx((MODEL.contrast(), MODEL.in_room(AMBIENT).contrast()))


def test_without_a_reading_nothing_changes() -> None:
    table = _readings()
    table = table.select(np.arange(len(table) - 3))
    assert without_room(table) == (table, {})
    assert room_light(table).passed is None
    assert "black@screen-off" in room_light(table).words


def test_a_dark_room_and_a_black_of_nothing_give_no_number() -> None:
    lit = np.asarray(_readings().codes.any(axis=1, keepdims=True))
    none = replace(_readings(lit=False), XYZ=np.where(lit, [[1.0, 1.0, 1.0]], [[0.0, 0.0, 0.0]]))
    assert room_light(none).value is None
    json.dumps(room_light(none).to_json(), allow_nan=False)


def test_each_lens_has_its_own() -> None:
    table = _readings()

    def through(eye: PatchEye, share: float) -> Measurements:
        return replace(table, XYZ=share * table.XYZ, eye=(eye,) * len(table))

    both = joined([through("left", 1.0), through("right", 0.5)])
    found = room_lights(both)
    assert found["right"].ambient_XYZ_cd_m2 == pytest.approx(0.5 * found["left"].ambient_XYZ_cd_m2)
    bare, _ = without_room(both)
    assert bare.XYZ[len(table)] == pytest.approx(0.5 * MODEL.black_XYZ_cd_m2)


@pytest.mark.parametrize("lit", [True, pytest.param(False, marks=pytest.mark.nightly)])
def test_a_fitted_display_file_keeps_black_and_room_apart(tmp_path: Path, lit: bool) -> None:
    fit = fit_display(_readings(lit=lit), model="table", file=tmp_path / "r.csv")
    assert any("White over black" in note for note in fit.notes)
    assert any("It was taken off" in note for note in fit.notes) == lit
    assert fit.to_json()["room"]["both"]["taken_off"] is lit
    file = tmp_path / "d.yaml"
    fit.write(file, PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.3))
    model = read_display(file).models("flat").left
    assert model.ambient_XYZ_cd_m2 == pytest.approx(AMBIENT, rel=0.01)
    assert model.black_XYZ_cd_m2 == pytest.approx(MODEL.black_XYZ_cd_m2, abs=2e-3)
    codes = np.array([[0.2, 0.5, 0.8], [0.6, 0.6, 0.6]])
    assert model.xyz(codes) == pytest.approx(MODEL.in_room(AMBIENT).xyz(codes), rel=0.02)


def test_the_report_gives_contrast_with_the_terms_apart() -> None:
    found = room_light(_readings())
    assert found.value == pytest.approx(MODEL.in_room(AMBIENT).contrast())
    assert known(found.table).rows[0][1:4] == pytest.approx((97.06, 0.06, 0.32))


def test_where_nothing_is_fitted_the_line_to_write_is_named() -> None:
    table = _readings()
    alone = table.select(np.arange(len(table) - 3, len(table)))
    (note,) = [note for note in fit_display(alone, model="none").notes if "screen sends" in note]
    assert note.endswith("ambient_XYZ_cd_m2: [0.3, 0.32, 0.27]")
    assert "taken off" not in note


@pytest.mark.nightly
def test_it_is_written_alone_into_a_mode_that_is_there(tmp_path: Path) -> None:
    file, table = tmp_path / "d.yaml", _readings()
    fit_display(_readings(), model="gog").write(file, PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.3))
    alone = table.select(np.arange(len(table) - 3, len(table)))
    fit = fit_display(replace(alone, XYZ=2.0 * alone.XYZ), model="none")
    before = read_display(file).models("flat").left
    with pytest.raises(DeviceError, match="holds the room's light already"):
        fit.write(file)
    words = fit.write(file, replace=True).written
    assert "Overwritten: the room's light." in words
    after = read_display(file).models("flat").left
    assert after.ambient_XYZ_cd_m2 == pytest.approx(2.0 * AMBIENT)
    assert after.in_the_dark.xyz([0.2, 0.5, 0.8]) == pytest.approx(before.in_the_dark.xyz([0.2, 0.5, 0.8]))
    # A new characterisation has its own, and nothing is said to stay.
    assert "stays: " not in fit_display(table, model="gog").write(file, replace=True).written
    assert read_display(file).models("flat").left.ambient_XYZ_cd_m2 == pytest.approx(AMBIENT)


@pytest.mark.nightly
def test_it_is_not_written_beside_eyes_that_have_their_own(tmp_path: Path) -> None:
    file, table = tmp_path / "d.yaml", _readings()
    panel = PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.3)
    fit_display(table, model="gog", eye="left").write(file, panel)
    alone = table.select(np.arange(len(table) - 3, len(table)))
    with pytest.raises(DeviceError, match="characterised per eye"):
        fit_display(alone, model="none").write(file, replace=True)
    left: PatchEye = "left"
    with pytest.raises(DeviceError, match="or room's light"):
        fit_display(replace(alone, eye=(left,) * 3), model="none").write(file, replace=True)


# Readings compared with a display file in the light they were taken in: in the dark, lit, in another light.
#
# What drift and warm-up are found by, against the obvious way: one fit, one patch, one penalty at a time.

ROOM = np.array([0.55, 0.6, 0.5])
OTHER_ROOM = np.array([1.6, 1.8, 1.5])

LIT = MODEL.in_room(ROOM)
NONE = np.zeros(3)


def _compared_readings(
    room: np.ndarray,
    *,
    off: np.ndarray | None = None,
    shown: DisplayModel = MODEL,
    eye: PatchEye = "both",
    noise: float = 0.002,
    with_black: bool = True,
) -> Measurements:
    """Dark and bright colours in ``room``; ``off``: what the screen gave while it was off, where that was read."""
    steps = np.linspace(0.0, 1.0, 4)
    codes = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    codes = codes if with_black else codes[codes.any(axis=1)]
    light = shown.in_room(room).xyz(codes)
    names = [f"p{row}" for row in range(len(codes))]
    if off is not None:
        codes, light, names = np.vstack([codes, NONE]), np.vstack([light, off]), [*names, "black@screen-off"]
    light = light * (1.0 + noise * np.random.default_rng(5).standard_normal((len(light), 1)))
    return Measurements(codes, light, tuple(names), None, (eye,) * len(codes))


def _difference(*tables: Measurements, model: DisplayModel = LIT) -> Diagnosis:
    sets = [MeasuredSet(f"{place}", table) for place, table in enumerate(tables)]
    return next(one for one in examine(sets, models=EyeModels(model, model)) if one.name == "model_difference")


@pytest.mark.parametrize("off", [None, ROOM])
@pytest.mark.parametrize(("room", "words"), [(NONE, "in the dark"), (ROOM, "hold 0.6")])
def test_the_right_model_passes_in_the_dark_and_in_the_light(
    room: np.ndarray, words: str, off: np.ndarray | None
) -> None:
    found = _difference(_compared_readings(room, off=off))
    assert found.passed
    assert known(found.value) < 0.15
    assert words in found.words


@pytest.mark.parametrize("off", [None, ROOM])
@pytest.mark.parametrize("room", [NONE, ROOM])
def test_a_wrong_model_fails_in_the_dark_and_in_the_light(room: np.ndarray, off: np.ndarray | None) -> None:
    shown = replace(MODEL, curves=(ToneCurve(gamma=2.4),) * 3)
    assert _difference(_compared_readings(room, off=off, shown=shown)).passed is False


def test_a_room_s_light_that_the_file_does_not_have_fails_unless_it_was_read() -> None:
    assert _difference(_compared_readings(OTHER_ROOM)).passed is False
    assert _difference(_compared_readings(OTHER_ROOM), model=MODEL).passed is False
    for model, room in ((LIT, "0.6"), (MODEL, "0")):
        found = _difference(_compared_readings(OTHER_ROOM, off=OTHER_ROOM), model=model)
        assert found.passed
        assert f"the display file has {room}." in found.words


def test_it_may_have_been_read_in_a_file_of_its_own() -> None:
    off = _compared_readings(OTHER_ROOM, off=OTHER_ROOM)
    off = off.select([len(off) - 1])
    assert _difference(_compared_readings(OTHER_ROOM), off).passed
    dark = _difference(_compared_readings(NONE), off)
    assert dark.passed
    assert "in the dark" in dark.words
    assert _difference(_compared_readings(ROOM), off).passed


def test_each_lens_is_compared_in_its_own_light() -> None:
    left, right = (
        _compared_readings(OTHER_ROOM, off=OTHER_ROOM, eye="left"),
        _compared_readings(NONE, off=0.5 * OTHER_ROOM, eye="right"),
    )
    every = examine([MeasuredSet("m", joined([left, right]))], models=EyeModels(LIT, LIT))
    found = [one for one in every if one.name in ("model_difference", "estimated_codes")]
    assert [one.passed for one in found] == [True] * 4
    assert "hold 1.8" in found[0].words
    assert "in the dark" in found[1].words


def test_without_black_they_are_taken_to_hold_it_and_that_is_said() -> None:
    found = _difference(_compared_readings(ROOM, with_black=False))
    assert found.passed
    assert "Black was not read" in found.words


def test_a_screen_that_gives_no_light_while_off_is_in_the_dark() -> None:
    model, words = in_light_of(_compared_readings(NONE), LIT, NONE)
    assert not model.ambient_XYZ_cd_m2.any()
    assert "no light while it was off" in words
    assert in_light_of(_compared_readings(NONE), MODEL, NONE) == (MODEL, "")


def test_black_darker_than_the_room_is_of_the_dark_whatever_the_file_has_for_black() -> None:
    """The file's black is 0; black as read, 0.34, is nearer to 0.6 than to 0, and yet cannot hold 0.6."""
    bright = replace(MODEL, black_XYZ_cd_m2=np.array([0.3, 0.34, 0.3]))
    bare = replace(MODEL, black_XYZ_cd_m2=NONE)
    model, _ = in_light_of(_compared_readings(NONE, shown=bright), bare.in_room(ROOM), ROOM)
    assert not model.ambient_XYZ_cd_m2.any()


def test_the_light_through_a_lens() -> None:
    both, left = (room_lights(_compared_readings(ROOM, off=ROOM, eye=eye, noise=0.0)) for eye in ("both", "left"))
    assert light_through(both, "right") == pytest.approx(ROOM)
    assert light_through(left, "both") == pytest.approx(ROOM)
    assert light_through(left, "right") is None


def test_by_a_display_file(tmp_path: Path) -> None:
    lines = [
        "schema_version: 1",
        "panel: {resolution_px: [100, 100], pixel_pitch_mm: 0.25}",
        *yaml_lines({"ambient_XYZ_cd_m2": ten_digits(ROOM)}),
    ]
    lines += ["modes:", "  flat:", *(f"    {line}" for line in ModelSpec.of(MODEL, source="made up").lines())]
    display, table = tmp_path / "d.yaml", tmp_path / "r.csv"
    display.write_text("\n".join(lines) + "\n", encoding="utf-8")
    for room in (NONE, ROOM):
        write_csv(_compared_readings(room), table)
        verdicts = judge_display([table], display=display)
        found = next(one for one in verdicts.diagnoses if one.name == "model_difference")
        assert found.passed
        json.dumps(verdicts.to_json(), allow_nan=False)


@pytest.mark.parametrize("excess", [0.0, -0.02, -0.3])
def test_one_curve_is_the_best_of_a_least_squares_fit_for_each_time_constant(excess: float) -> None:
    rng = np.random.default_rng(3)
    place = np.repeat([0, 1, 2], [9, 11, 10])
    when = np.concatenate([np.sort(rng.uniform(0, 1800, count)) for count in (9, 11, 10)])
    logs = np.log1p(-0.1 * np.exp(-when / 300)) + 0.2 * place + 0.002 * rng.standard_normal((12, 30))
    taus = np.geomspace(36, 5400, 50)
    found = settling._one_curve(logs, when, place, taus, excess)
    levels = (place[:, None] == np.arange(3)).astype(float)
    for row, series in enumerate(logs):
        fits = []
        for tau in taus:
            fall = np.exp(-when / tau)
            columns = np.column_stack([levels, np.log1p(excess * fall) if excess else fall])
            answer = np.linalg.lstsq(columns, series, rcond=None)[0]
            fits.append((float(((series - columns @ answer) ** 2).sum()), tau, columns @ answer))
        least, tau, fitted = min(fits, key=lambda fit: fit[0])
        assert found.least[row] == pytest.approx(least, rel=1e-9)
        np.testing.assert_allclose(found.fitted[row], fitted, rtol=0, atol=1e-9)
        if row == 0:
            assert found.tau == tau


def test_codes_stand_as_they_were_read_first_with_the_mean_of_their_plain_readings() -> None:
    plain = characterisation(2)
    names = tuple(f"{name}@30deg" if row % 7 == 3 else name for row, name in enumerate(plain.name))
    table = Measurements(plain.codes, plain.XYZ, names, plain.time_s)
    rows = readings.by_code(table)
    assert max(map(len, rows.values())) > 3
    codes, light = readings.means(table)
    np.testing.assert_array_equal(codes, [table.codes[own[0]] for own in rows.values()])
    np.testing.assert_allclose(light, [table.XYZ[own].mean(axis=0) for own in rows.values()], rtol=1e-14, atol=0)


def test_a_smoother_is_the_ridge_regression_on_what_is_within_patches() -> None:
    rng = np.random.default_rng(4)
    _, member, counts = np.unique(np.tile(np.arange(6), 5), return_inverse=True, return_counts=True)
    inside = np.linspace(0, 1, 30)
    rest = time_trend._within(rng.standard_normal(30), member, counts)
    for number in range(6):
        assert rest[member == number].mean() == pytest.approx(0, abs=1e-15)
    tried = 0
    for basis, penalties in time_trend._candidates(inside):
        columns = basis(inside) - np.array([basis(inside)[member == number].mean(axis=0) for number in member])
        fits = list(time_trend._fits(basis, penalties, inside, member, counts))
        assert len(fits) == len(penalties)
        for penalty, fit in zip(penalties, fits, strict=True):
            widened = np.vstack([columns, np.diag(np.sqrt(penalty))])
            answer = np.linalg.lstsq(widened, np.concatenate([rest, np.zeros(len(penalty))]), rcond=None)[0]
            np.testing.assert_allclose(fit.columns @ (fit.operator @ rest), columns @ answer, rtol=0, atol=1e-7)
            tried += 1
    assert tried > 8
