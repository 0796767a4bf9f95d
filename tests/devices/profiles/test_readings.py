"""Profiles as readings: those inside, a table or matrix that is asked, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.display import GammaTable
from devices.errors import DeviceError
from devices.profiles import read_profile
from devices.readings import Measurements, carried, read_measurements
from devices.readings.ti3 import format_ti3
from tests.devices.profiles.profile_bytes import curv, matrix_tags, para, profile, text, vcgt

CODES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.25, 0.5, 0.75], [1, 1, 1.0]])
LIGHT = np.array([[0.1, 0.1, 0.2], [40, 20, 2], [30, 60, 9], [15, 6, 80], [11, 12, 30], [85, 86, 91.0]])
READINGS = Measurements(CODES, LIGHT, tuple("KRGBxW"), instrument="i1")


def _file(folder: Path, tags: dict[str, bytes], version: int = 2) -> Path:
    path = folder / "display.icc"
    path.write_bytes(profile(tags, version=version))
    return path


@pytest.mark.parametrize("tag", ["targ", "CIED", "DevD"])
def test_measurements_inside_are_read_as_from_their_own_file(tmp_path: Path, tag: str) -> None:
    path = _file(tmp_path, matrix_tags(para(0, 2.2)) | {tag: text(format_ti3(READINGS))})
    found = read_measurements(path)
    np.testing.assert_allclose(found.codes, CODES, atol=1e-12)
    np.testing.assert_allclose(found.XYZ, LIGHT, rtol=1e-12)
    assert found.name == READINGS.name
    assert found.instrument == "i1"
    assert "6 readings inside the profile" in found.assumptions[0]


@pytest.mark.parametrize("full", [100, 255])
def test_codes_and_colours_apart_are_joined_by_their_samples(tmp_path: Path, full: int) -> None:
    codes = ["IT8.7/3", "BEGIN_DATA_FORMAT", "SAMPLE_ID RGB_R RGB_G RGB_B", "END_DATA_FORMAT", "BEGIN_DATA"]
    codes += [f"{i} " + " ".join(f"{full * v}" for v in row) for i, row in enumerate(CODES.tolist())]
    light = ["IT8.7/3", "BEGIN_DATA_FORMAT", "SAMPLE_ID XYZ_X XYZ_Y XYZ_Z", "END_DATA_FORMAT", "BEGIN_DATA"]
    rows = [f"{i} " + " ".join(f"{v}" for v in row) for i, row in enumerate(LIGHT.tolist())]
    tags = matrix_tags(para(0, 2.2)) | {"DevD": text("\n".join([*codes, "END_DATA"]))}
    path = _file(tmp_path, tags | {"CIED": text("\n".join([*light, *rows[::-1], "END_DATA"]))})
    found = read_measurements(path)
    np.testing.assert_allclose(found.codes, CODES[::-1])
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
    lines = format_ti3(Measurements(CODES, light)).splitlines()
    silent = {"targ": text("\n".join(line for line in lines if not line.startswith(("NORMALIZED", "LUMINANCE"))))}
    np.testing.assert_allclose(read_measurements(_file(tmp_path, silent)).XYZ, light)
    np.testing.assert_allclose(read_measurements(_file(tmp_path, silent), white_cd_m2=80.0).XYZ, 0.8 * light)
    bright = silent | {"lumi": matrix_tags(curv(), lumi=300.0)["lumi"]}
    np.testing.assert_allclose(read_measurements(_file(tmp_path, bright)).XYZ, 3 * light)


def test_codes_are_those_that_the_gamma_table_sent(tmp_path: Path) -> None:
    tags = {"targ": text(format_ti3(READINGS)), "vcgt": vcgt(1, 2, [0, 16384, 65535])}
    found = read_measurements(_file(tmp_path, tags))
    np.testing.assert_allclose(found.codes[4], [0.125, 0.25, 0.625], atol=2e-5)
    assert found.gamma_table is not None
    assert found.gamma_table.is_identity
    assert any("'vcgt'" in said and "identity table" in said for said in found.assumptions)
    same = read_measurements(_file(tmp_path, tags | {"vcgt": vcgt(1, 2, [0, 65535])}))
    np.testing.assert_allclose(same.codes, CODES)
    assert same.gamma_table is not None


def test_a_calibration_beside_the_readings_goes_before_the_profiles(tmp_path: Path) -> None:
    calibrated = Measurements(CODES, LIGHT, gamma_table=GammaTable.from_shares([0.0, 0.8]))
    path = _file(tmp_path, {"targ": text(format_ti3(calibrated)), "vcgt": vcgt(1, 2, [0, 16384, 65535])})
    np.testing.assert_allclose(read_measurements(path).codes, 0.8 * CODES, atol=3e-3)


@pytest.mark.parametrize("entries", [[0, 16384, 45000], [3000, 16384, 65535]])
def test_a_gamma_table_without_black_or_full_drive_stays_that_of_the_readings(
    tmp_path: Path, entries: list[int]
) -> None:
    tags = {"targ": text(format_ti3(READINGS)), "vcgt": vcgt(1, 2, entries)}
    found = read_measurements(_file(tmp_path, tags))
    np.testing.assert_allclose(found.codes, CODES)
    assert found.gamma_table is not None
    assert np.asarray(found.gamma_table.entries)[:, 0].tolist() == entries
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
