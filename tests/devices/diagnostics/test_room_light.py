"""The room's light from readings with the display switched off: found, taken off, and kept apart in what is written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from devices.characterise import fit_display
from devices.diagnostics.room_light import room_light, room_lights, without_room
from devices.display import DisplayModel, PanelSpec, ToneCurve, read_display
from devices.errors import DeviceError
from devices.readings import Measurements, PatchEye, find_patches
from devices.readings.table import joined

pytestmark = pytest.mark.usefixtures("fits_kept")

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
    assert found.table is not None
    assert found.table.rows[0][1:4] == pytest.approx((97.06, 0.06, 0.32))


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
    words = fit.write(file, replace=True).words
    assert "Overwritten: the room's light." in words
    after = read_display(file).models("flat").left
    assert after.ambient_XYZ_cd_m2 == pytest.approx(2.0 * AMBIENT)
    assert after.in_the_dark.xyz([0.2, 0.5, 0.8]) == pytest.approx(before.in_the_dark.xyz([0.2, 0.5, 0.8]))
    # A new characterisation has its own, and nothing is said to stay.
    assert "stays: " not in fit_display(table, model="gog").write(file, replace=True).words
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
