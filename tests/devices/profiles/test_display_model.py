"""Profiles and `.cube` tables as models and as readings, read and written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import GammaTable, SrgbCurve, TableCurve, ToneCurve
from devices.errors import DeviceError
from devices.profiles import ProfileModel, model_of_profile, read_profile
from devices.profiles.curves import SampledCurve
from devices.profiles.display_model import tabled_curve
from devices.profiles.profile import profile_of
from devices.profiles.tag_table import parse_profile_file
from devices.readings import Measurements, carried, read_measurements
from devices.readings.ti3 import format_ti3
from extensions.profiles import profile_of_model
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import (
    CHAD,
    D50,
    curv,
    matrix_tags,
    para,
    profile,
    text,
    vcgt,
    xyz,
)
from tests.kept import known

# Matrix and curves as a display model: what kind of curve, what white, what black, and how exactly.

CODES = np.random.default_rng(1).random((500, 3))
SRGB = para(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
D65 = np.array([0.95047, 1.0, 1.08883])


def _model(data: bytes, white_cd_m2: float | None = None) -> ProfileModel:
    return model_of_profile(profile_of(parse_profile_file(data, "display.icc")), white_cd_m2)


def _largest_difference(made: ProfileModel, data: bytes, luminance: float = 100.0) -> float:
    """Return the largest ΔE00 between the model and what LittleCMS and the tags written here give."""
    wanted = through(data, CODES) @ np.linalg.inv(np.reshape(CHAD, (3, 3))).T * luminance
    white = luminance * D65
    return float(delta_e_2000(xyz_to_lab(made.model.xyz(CODES), white), xyz_to_lab(wanted, white)).max())


@pytest.mark.parametrize(
    ("curve", "wanted"),
    [
        (curv(), ToneCurve(1.0, 0.0, 1.0)),
        (curv(0x0240), ToneCurve(1.0, 0.0, 2.25)),
        (para(0, 2.25), ToneCurve(1.0, 0.0, 2.25)),
        (para(1, 2.0, 1.25, -0.25), ToneCurve(1.25, -0.25, 2.0)),
        (para(2, 2.0, 0.75, 0.125, 0.125), ToneCurve(0.75, 0.125, 2.0)),
        (curv(*(round(65535 * (i / 255) ** 2.2) for i in range(256))), ToneCurve(1.0, 0.0, 2.2)),
    ],
)
def test_a_curve_of_the_family_is_taken_exactly(curve: bytes, wanted: ToneCurve) -> None:
    data = profile(matrix_tags(curve))
    made = _model(data)
    assert made.model.curves == (wanted,) * 3
    assert _largest_difference(made, data) < 0.05


@pytest.mark.parametrize(
    ("curve", "entries"),
    [
        (para(3, 1 / 0.45, 1 / 1.099, 0.099 / 1.099, 1 / 4.5, 0.081), 1024),
        (curv(*(round(65535 * (0.01 + 0.99 * (i / 255) ** 1.8)) for i in range(256))), 64),
        (curv(*(round(65535 * (3 * x**2 - 2 * x**3)) for x in np.linspace(0, 1, 1024))), 128),
        (curv(*(round(65535 * max(x - 0.1, 0) / 0.9) for x in np.linspace(0, 1, 512))), 128),
        (curv(*(round(65535 * min(x / 0.9, 1)) for x in np.linspace(0, 1, 512))), 128),
    ],
)
def test_another_curve_becomes_a_short_table(curve: bytes, entries: int) -> None:
    data = profile(matrix_tags(curve))
    made = _model(data)
    assert all(isinstance(each, TableCurve) and len(each.codes) <= entries for each in made.model.curves)
    assert _largest_difference(made, data) < 0.15
    assert any("became a table of" in note for note in made.notes)


@pytest.mark.parametrize(
    "curve",
    [SRGB, curv(*(round(65535 * float(SrgbCurve().linear(i / 1023))) for i in range(1024)))],
    ids=["para", "curv"],
)
def test_the_curve_of_srgb_is_known_by_its_name(curve: bytes) -> None:
    data = profile(matrix_tags(curve))
    made = _model(data)
    assert made.model.curves == (SrgbCurve(),) * 3
    assert any("of sRGB" in note for note in made.notes)
    assert _largest_difference(made, data) < 0.05
    written = profile_of_model(made.model, "sRGB").data
    assert _model(written).model.curves == (SrgbCurve(),) * 3


def test_channels_of_different_kinds_all_become_tables() -> None:
    data = profile(matrix_tags(curv(0x0240), SRGB, para(2, 2.0, 0.75, 0.125, 0.125)))
    made = _model(data)
    assert all(isinstance(each, TableCurve) for each in made.model.curves)
    assert _largest_difference(made, data) < 0.1


def test_light_of_code_0_is_the_models_black() -> None:
    made = _model(profile(matrix_tags(para(2, 2.0, 1.0, 0.0, 0.01), lumi=200.0)))
    black = made.model.xyz(np.zeros(3))
    np.testing.assert_allclose(black, 2.0 * D65, rtol=2e-3)
    assert not any("no light" in note for note in made.notes)


def test_white_is_as_bright_as_the_profile_or_the_caller_says() -> None:
    curves = para(0, 2.2)
    np.testing.assert_allclose(
        _model(profile(matrix_tags(curves, lumi=143.0))).model.white_XYZ_cd_m2, 143 * D65, rtol=1e-3
    )
    np.testing.assert_allclose(
        _model(profile(matrix_tags(curves, lumi=143.0)), 80.0).model.white_XYZ_cd_m2[1], 80, rtol=1e-3
    )
    with pytest.raises(DeviceError, match=r"no tag 'lumi'.*--white-cd-m2"):
        _model(profile(matrix_tags(curves, lumi=None)))
    with pytest.raises(DeviceError, match="no tag 'lumi'"):
        _model(profile(matrix_tags(curves, lumi=0.0)))
    with pytest.raises(DeviceError, match="a number above 0"):
        _model(profile(matrix_tags(curves)), -3.0)


def test_a_profile_of_version_2_is_absolute_by_its_white_point() -> None:
    tags = matrix_tags(para(0, 2.2))
    del tags["chad"]
    tags["wtpt"] = xyz(*D65)
    white = _model(profile(tags, version=2)).model.white_XYZ_cd_m2
    np.testing.assert_allclose(white, 100 * D65, rtol=1e-3)
    tags["wtpt"] = xyz(*D50)
    made = _model(profile(tags, version=2))
    np.testing.assert_allclose(made.model.white_XYZ_cd_m2, np.multiply(100, D50), rtol=1e-3)
    assert any("taken for D50" in note for note in made.notes)


def test_the_black_point_lies_beneath_the_light_of_the_curves() -> None:
    tags = matrix_tags(para(0, 2.2))
    tags["bkpt"] = xyz(0.002, 0.002, 0.003)
    made = _model(profile(tags, version=2))
    np.testing.assert_allclose(made.model.black_XYZ_cd_m2, [0.2, 0.2, 0.3], atol=2e-3)
    np.testing.assert_allclose(made.model.white_XYZ_cd_m2[1], 100.0, rtol=1e-4)
    assert any("'bkpt'" in note for note in made.notes)


def test_the_black_point_is_not_added_to_curves_that_have_it() -> None:
    tags = matrix_tags(para(2, 2.2, 0.998, 0.0, 0.002))
    without = _model(profile(tags, version=2)).model
    tags["bkpt"] = xyz(0.002, 0.002, 0.003)
    made = _model(profile(tags, version=2))
    np.testing.assert_allclose(made.model.xyz(np.zeros(3)), without.xyz(np.zeros(3)))
    assert not any("'bkpt'" in note for note in made.notes)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"gTRC": curv(*range(65535, -1, -257))}, "'gTRC' falls by 1e\\+02 %"),
        ({"gTRC": curv(30000, 30000, 30000)}, "'gTRC' rises from 0.458 to 0.458"),
        ({"gTRC": xyz(1, 1, 1)}, "type 'XYZ '"),
        ({"gXYZ": xyz(0.436, 0.2225, 0.0139)}, "do not span"),
        ({"gXYZ": curv()}, "'gXYZ' is of the type 'curv'"),
        ({"chad": b"sf32\0\0\0\0" + b"\0" * 36}, "'chad' is no chromatic adaptation: 0 0 0"),
        ({"chad": curv()}, "'chad' is of the type 'curv'"),
        ({"gTRC": None}, "has rXYZ, gXYZ, bXYZ, rTRC, bTRC but not gTRC"),
        (dict.fromkeys(("rXYZ", "gXYZ", "bXYZ", "rTRC", "gTRC", "bTRC")), "does not say what light a code gives"),
    ],
)
def test_what_gives_no_model_is_refused_in_one_line(change: dict[str, bytes | None], words: str) -> None:
    tags = {name: data for name, data in (matrix_tags(para(0, 2.2)) | change).items() if data is not None}
    with pytest.raises(DeviceError, match=words) as caught:
        _model(profile(tags))
    assert len(caught.value.findings) == 1
    assert str(caught.value).startswith("display.icc: ")


def test_small_steps_back_become_flat() -> None:
    values = np.linspace(0, 1, 256) ** 2.2
    values[100] = values[101] + 0.001
    table, off = tabled_curve(SampledCurve(values))
    assert np.all(np.diff(table.light) > 0)
    assert off < 0.01


def test_the_gamma_table_of_a_profile_is_named(tmp_path: Path) -> None:
    from tests.devices.profiles.profile_bytes import vcgt

    path = tmp_path / "display.icc"
    path.write_bytes(profile(matrix_tags(para(0, 2.2)) | {"vcgt": vcgt(1, 2, [0, 20000, 60000])}))
    made = model_of_profile(read_profile(path))
    assert any("'vcgt'" in note and "while that table is loaded" in note for note in made.notes)


# Profiles as readings: those inside, a table or matrix that is asked, and what is refused.

READINGS_CODES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.25, 0.5, 0.75], [1, 1, 1.0]])
LIGHT = np.array([[0.1, 0.1, 0.2], [40, 20, 2], [30, 60, 9], [15, 6, 80], [11, 12, 30], [85, 86, 91.0]])
READINGS = Measurements(READINGS_CODES, LIGHT, tuple("KRGBxW"), instrument="i1")


def _file(folder: Path, tags: dict[str, bytes], version: int = 2) -> Path:
    path = folder / "display.icc"
    path.write_bytes(profile(tags, version=version))
    return path


@pytest.mark.parametrize("tag", ["targ", "CIED", "DevD"])
def test_measurements_inside_are_read_as_from_their_own_file(tmp_path: Path, tag: str) -> None:
    path = _file(tmp_path, matrix_tags(para(0, 2.2)) | {tag: text(format_ti3(READINGS))})
    found = read_measurements(path)
    np.testing.assert_allclose(found.codes, READINGS_CODES, atol=1e-12)
    np.testing.assert_allclose(found.XYZ, LIGHT, rtol=1e-12)
    assert found.name == READINGS.name
    assert found.instrument == "i1"
    assert "6 readings inside the profile" in found.assumptions[0]


@pytest.mark.parametrize("full", [100, 255])
def test_codes_and_colours_apart_are_joined_by_their_samples(tmp_path: Path, full: int) -> None:
    codes = ["IT8.7/3", "BEGIN_DATA_FORMAT", "SAMPLE_ID RGB_R RGB_G RGB_B", "END_DATA_FORMAT", "BEGIN_DATA"]
    codes += [f"{i} " + " ".join(f"{full * v}" for v in row) for i, row in enumerate(READINGS_CODES.tolist())]
    light = ["IT8.7/3", "BEGIN_DATA_FORMAT", "SAMPLE_ID XYZ_X XYZ_Y XYZ_Z", "END_DATA_FORMAT", "BEGIN_DATA"]
    rows = [f"{i} " + " ".join(f"{v}" for v in row) for i, row in enumerate(LIGHT.tolist())]
    tags = matrix_tags(para(0, 2.2)) | {"DevD": text("\n".join([*codes, "END_DATA"]))}
    path = _file(tmp_path, tags | {"CIED": text("\n".join([*light, *rows[::-1], "END_DATA"]))})
    found = read_measurements(path)
    np.testing.assert_allclose(found.codes, READINGS_CODES[::-1])
    np.testing.assert_allclose(found.XYZ, LIGHT[::-1])
    path = _file(tmp_path, tags | {"CIED": text("\n".join([*light, *rows, "9 1 1 1", "END_DATA"]))})
    with pytest.raises(DeviceError, match=r"\[CIED\]:12:.*SAMPLE_ID 9"):
        read_measurements(path)


def test_relative_readings_take_the_profiles_luminance_or_the_callers(tmp_path: Path) -> None:
    relative = format_ti3(READINGS).replace('NORMALIZED_TO_Y_100 "NO"', 'NORMALIZED_TO_Y_100 "YES"')
    relative = "\n".join(line for line in relative.splitlines() if "LUMINANCE" not in line)
    path = _file(tmp_path, matrix_tags(para(0, 2.2), lumi=250.0) | {"targ": text(relative)})
    found = read_measurements(path)
    np.testing.assert_allclose(found.XYZ, 2.5 * LIGHT)
    assert any("a white of 250 (the profile's 'lumi')" in said for said in found.assumptions)
    assert not any("does not say how bright" in said for said in found.assumptions)
    np.testing.assert_allclose(read_measurements(path, white_cd_m2=50.0).XYZ, 0.5 * LIGHT)
    path = _file(tmp_path, matrix_tags(para(0, 2.2), lumi=None) | {"targ": text(relative)})
    with pytest.raises(DeviceError, match="--white-cd-m2"):
        read_measurements(path)
    path = _file(tmp_path, {"targ": text(format_ti3(READINGS))})
    with pytest.raises(DeviceError, match="--white-cd-m2 90 was given"):
        read_measurements(path, white_cd_m2=90.0)


def test_a_white_of_exactly_100_is_relative_where_it_is_known_how_bright_it_is(tmp_path: Path) -> None:
    light = LIGHT * 100 / LIGHT[-1, 1]
    lines = format_ti3(Measurements(READINGS_CODES, light)).splitlines()
    silent = {"targ": text("\n".join(line for line in lines if not line.startswith(("NORMALIZED", "LUMINANCE"))))}
    np.testing.assert_allclose(read_measurements(_file(tmp_path, silent)).XYZ, light)
    np.testing.assert_allclose(read_measurements(_file(tmp_path, silent), white_cd_m2=80.0).XYZ, 0.8 * light)
    bright = silent | {"lumi": matrix_tags(curv(), lumi=300.0)["lumi"]}
    np.testing.assert_allclose(read_measurements(_file(tmp_path, bright)).XYZ, 3 * light)


def test_codes_are_those_that_the_gamma_table_sent(tmp_path: Path) -> None:
    tags = {"targ": text(format_ti3(READINGS)), "vcgt": vcgt(1, 2, [0, 16384, 65535])}
    found = read_measurements(_file(tmp_path, tags))
    np.testing.assert_allclose(found.codes[4], [0.125, 0.25, 0.625], atol=2e-5)
    assert known(found.gamma_table).is_identity
    assert any("'vcgt'" in said and "identity table" in said for said in found.assumptions)
    same = read_measurements(_file(tmp_path, tags | {"vcgt": vcgt(1, 2, [0, 65535])}))
    np.testing.assert_allclose(same.codes, READINGS_CODES)
    assert same.gamma_table is not None


def test_a_calibration_beside_the_readings_goes_before_the_profiles(tmp_path: Path) -> None:
    calibrated = Measurements(READINGS_CODES, LIGHT, gamma_table=GammaTable.from_shares([0.0, 0.8]))
    path = _file(tmp_path, {"targ": text(format_ti3(calibrated)), "vcgt": vcgt(1, 2, [0, 16384, 65535])})
    np.testing.assert_allclose(read_measurements(path).codes, 0.8 * READINGS_CODES, atol=3e-3)


@pytest.mark.parametrize("entries", [[0, 16384, 45000], [3000, 16384, 65535]])
def test_a_gamma_table_without_black_or_full_drive_stays_that_of_the_readings(
    tmp_path: Path, entries: list[int]
) -> None:
    tags = {"targ": text(format_ti3(READINGS)), "vcgt": vcgt(1, 2, entries)}
    found = read_measurements(_file(tmp_path, tags))
    np.testing.assert_allclose(found.codes, READINGS_CODES)
    assert np.asarray(known(found.gamma_table).entries)[:, 0].tolist() == entries
    assert any("'vcgt'" in said and "only while that table is loaded" in said for said in found.assumptions)


def test_a_matrix_is_asked_for_colours(tmp_path: Path) -> None:
    path = _file(tmp_path, matrix_tags(para(2, 2.0, 1.0, 0.0, 0.01), lumi=200.0), version=4)
    found = read_measurements(path)
    white = found.XYZ[np.all(found.codes == 1, axis=1)][0]
    np.testing.assert_allclose(white, [1.01 * 190.1, 1.01 * 200, 1.01 * 217.8], rtol=2e-2)
    assert any("holds no measurements: its model" in said for said in found.assumptions)
    assert carried(read_profile(path)) is None


def test_what_holds_nothing_names_its_tags(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"its tags: cprt, lumi .*needed are targ") as caught:
        read_measurements(_file(tmp_path, {"cprt": text("none"), "lumi": matrix_tags(curv())["lumi"]}))
    assert len(caught.value.findings) == 1


def test_a_white_for_a_file_that_is_no_profile_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="no ICC profile"):
        read_measurements(tmp_path / "readings.csv", white_cd_m2=100.0)
