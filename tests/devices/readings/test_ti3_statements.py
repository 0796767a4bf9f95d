"""What a ``.ti3`` states of observer, device, levels and calibration is honoured or refused, never passed over."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from devices.characterise import fit_display, table_c1_codes, thesis_display
from devices.colour import delta_e_2000, xyz_to_lab
from devices.diagnostics import read_sets
from devices.errors import DeviceError
from devices.readings import (
    CIE_1931_2,
    OBSERVERS,
    Measurements,
    convert_colours,
    read_measurements,
    write_csv,
    xyz_from_spectra,
)
from devices.readings.table import joined
from devices.readings.ti3 import format_ti3, parse_ti3, write_ti3

CODES = np.array([[0, 0, 0], [128, 0, 0], [255, 255, 255]]) / 255
XYZ = np.array([[0.1, 0.1, 0.2], [5.3, 2.8, 0.4], [95.0, 100.0, 108.9]])
PLAIN = Measurements(CODES, XYZ, ("black", "half red", "white"))
STEPS = np.linspace(0.0, 1.0, 256)


def _with(keyword: str) -> list[str]:
    return format_ti3(PLAIN).replace('COLOR_REP "RGB_XYZ"', f'COLOR_REP "RGB_XYZ"\n{keyword}').splitlines()


def _through(curve: np.ndarray, codes: np.ndarray) -> list[str]:
    """Return a .ti3 of the thesis's display read through a card's table ``curve`` (256, 3)."""
    sent = np.stack([np.interp(codes[:, i], STEPS, curve[:, i]) for i in range(3)], axis=1)
    light = thesis_display().xyz(sent)
    rows = [" ".join(f"{value:.6g}" for value in (step, *row)) for step, row in zip(STEPS, curve, strict=True)]
    cal = ["", "CAL   ", "", 'DEVICE_CLASS "DISPLAY"', 'COLOR_REP "RGB"', "BEGIN_DATA_FORMAT"]
    cal += ["RGB_I RGB_R RGB_G RGB_B", "END_DATA_FORMAT", "NUMBER_OF_SETS 256", "BEGIN_DATA", *rows, "END_DATA"]
    return [*format_ti3(Measurements(codes, light)).splitlines(), *cal]


@pytest.mark.parametrize("observer", OBSERVERS)
def test_the_observer_is_read_kept_and_written(observer: str, tmp_path: Path) -> None:
    table = replace(PLAIN, observer=observer)
    assert parse_ti3(format_ti3(table).splitlines(), "d.ti3").observer == observer
    write_csv(table, tmp_path / "d.csv")
    back = read_measurements(tmp_path / "d.csv")
    assert (back.observer, back.select([0]).observer) == (observer, observer)


def test_an_observer_that_is_not_known_is_refused_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"d.ti3:7:10: .*'1955_2' is not known .*1964_10"):
        parse_ti3(_with('OBSERVER "1955_2"'), "d.ti3")
    file = tmp_path / "d.csv"
    write_csv(PLAIN, file)
    file.write_text("# observer: mine\n" + file.read_text())
    with pytest.raises(DeviceError, match=r"d.csv:1: .*'mine' is not known"):
        read_measurements(file)


def test_readings_for_another_observer_are_not_mixed(tmp_path: Path) -> None:
    codes = table_c1_codes()
    other = Measurements(codes, thesis_display().xyz(codes), observer="CIE 1964 10")
    with pytest.raises(DeviceError, match="XYZ for CIE 1964 10 without spectra"):
        fit_display(replace(other, observer=CIE_1931_2), without_glasses=other)
    write_ti3(other, tmp_path / "d.ti3")
    with pytest.raises(DeviceError, match=r"d.ti3: .*1964 10 without spectra"):
        read_sets([tmp_path / "d.ti3"], None)
    assert read_sets([tmp_path / "d.ti3"], None, observer=None)[0].measurements.observer == "CIE 1964 10"
    with pytest.raises(DeviceError, match="XYZ for CIE 1964 10 without spectra"):
        convert_colours(tmp_path / "d.ti3", thesis_display(), "code")
    assert len(convert_colours(tmp_path / "d.ti3", thesis_display(), "code", observer="CIE 1964 10").values) == len(
        codes
    )
    with pytest.raises(DeviceError, match="joined: CIE 1931 2, CIE 1964 10"):
        joined([replace(other, observer=CIE_1931_2), other])


def test_spectra_are_compared_with_xyz_for_the_same_observer() -> None:
    waves = np.arange(380.0, 781, 4)
    spectra = np.array([0.001, 0.02, 0.3])[:, None] * np.exp(-(((waves - 480) / 20) ** 2))
    ten = xyz_from_spectra(spectra, waves, "CIE 1964 10")
    assert np.abs(ten / xyz_from_spectra(spectra, waves) - 1).max() > 0.1
    table = Measurements(CODES, ten, spectra=spectra, wavelengths_nm=waves, observer="CIE 1964 10")
    assert parse_ti3(format_ti3(table).splitlines(), "d.ti3").assumptions == ()
    assert parse_ti3(format_ti3(replace(table, observer=CIE_1931_2)).splitlines(), "d.ti3").assumptions


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('CLASS "DISPLAY"', 'CLASS "OUTPUT"', r"d.ti3:5:14: DEVICE_CLASS is 'OUTPUT'"),
        ('CLASS "DISPLAY"', 'CLASS "INPUT"', "DEVICE_CLASS is 'INPUT'"),
        ('REP "RGB_XYZ"', 'REP "iRGB_XYZ"', r"d.ti3:6:11: COLOR_REP is 'iRGB_XYZ'"),
        ("CTI3", "CTI1", "CTI1 is a list of patches to measure"),
        ('REP "RGB_XYZ"', 'REP "RGB_XYZ"\nTV_OUTPUT_ENCODING "YES"', r"d.ti3:7:20: .*16\.\.235 of 255 .*full range"),
        ('REP "RGB_XYZ"', 'REP "RGB_XYZ"\nOUTPUT_ENCODING "16 235"', "OUTPUT_ENCODING is '16 235'"),
    ],
)
def test_what_is_no_display_over_full_range_is_refused(old: str, new: str, says: str) -> None:
    text = format_ti3(PLAIN)
    assert old in text
    with pytest.raises(DeviceError, match=says):
        parse_ti3(text.replace(old, new).splitlines(), "d.ti3")


def test_video_levels_of_the_calibration_are_refused_too() -> None:
    lines = _through(np.stack([STEPS] * 3, axis=1), CODES)
    lines.insert(lines.index("CAL   ") + 1, 'TV_OUTPUT_ENCODING "YES"')
    with pytest.raises(DeviceError, match="codes were sent as 16"):
        parse_ti3(lines, "d.ti3")


def test_statements_of_a_display_over_full_range_pass() -> None:
    lines = _with('TV_OUTPUT_ENCODING "NO"\nOBSERVER "1931_2"\nOUTPUT_ENCODING "0 255"')
    assert parse_ti3(lines, "d.ti3").assumptions == ()
    bare = [line for line in format_ti3(PLAIN).splitlines() if not line.startswith(("DEVICE", "COLOR", "CTI3"))]
    np.testing.assert_allclose(parse_ti3(bare, "d.ti3").codes, CODES, atol=1e-12)


def test_argyll_s_negative_zero_is_zero() -> None:
    text = format_ti3(PLAIN).replace('"half red" 50.1960784314 0 0', '"half red" 50.1960784314 -0.00100 0.0')
    assert "-0.00100" in text
    assert parse_ti3(text.splitlines(), "d.ti3").codes[1].tolist() == [pytest.approx(128 / 255), 0.0, 0.0]
    with pytest.raises(DeviceError, match=r"RGB_G is -0.5 .device values are 0..100"):
        parse_ti3(text.replace("-0.00100", "-0.5").splitlines(), "d.ti3")


def test_a_calibration_is_applied_to_the_codes_and_said() -> None:
    curve = np.stack([STEPS**1.1, STEPS, 0.93 * STEPS], axis=1)
    found = parse_ti3(_through(curve, CODES), "d.ti3")
    np.testing.assert_allclose(found.codes[2], [1.0, 1.0, 0.93], atol=1e-6)
    assert found.codes[1, 0] == pytest.approx(np.interp(128 / 255, STEPS, STEPS**1.1), abs=1e-6)
    assert found.gamma_table is not None
    assert found.gamma_table.is_identity
    assert "up to 0.07 of full code" in found.assumptions[0]
    assert "no codes above blue 0.93" in found.assumptions[1]


def test_an_identity_says_nothing_and_no_calibration_leaves_the_table_unknown() -> None:
    same = parse_ti3(_through(np.stack([STEPS] * 3, axis=1), CODES), "d.ti3")
    assert (same.assumptions, parse_ti3(format_ti3(PLAIN).splitlines(), "d.ti3").gamma_table) == ((), None)
    np.testing.assert_allclose(same.codes, CODES, atol=1e-12)
    back = parse_ti3(format_ti3(same).splitlines(), "d.ti3")
    assert back.gamma_table is not None


@pytest.mark.parametrize("top", [pytest.param(top, marks=pytest.mark.nightly) for top in (1.0, 0.9)])
def test_a_calibration_that_lifts_black_stays_the_table_of_the_readings(top: float, tmp_path: Path) -> None:
    codes = table_c1_codes()
    curve = np.stack([0.02 + 0.98 * STEPS, 0.015 + 0.985 * STEPS, 0.03 + (top - 0.03) * STEPS], axis=1)
    found = parse_ti3(_through(curve, codes), "d.ti3")
    np.testing.assert_allclose(found.codes, codes, atol=1e-9)
    assert found.gamma_table is not None
    np.testing.assert_allclose(found.gamma_table.shares, curve, atol=2e-5)
    assert "only while this calibration is loaded" in found.assumptions[0]
    fit = fit_display(found, model="table")
    model = fit.eyes["both"].characterisation.chosen.model
    sent = np.stack([np.interp(codes[:, i], STEPS, curve[:, i]) for i in range(3)], axis=1)
    truth, white = thesis_display().xyz(sent), thesis_display().xyz([1.0, 1.0, 1.0])
    assert delta_e_2000(xyz_to_lab(model.xyz(codes), white), xyz_to_lab(truth, white)).max() < 0.5
    assert fit.gamma_table is not None
    assert not fit.gamma_table.is_identity


@pytest.mark.parametrize(("green", "codes_to", "kept"), [(0.746, 1.0, True), (0.76, 1.0, False), (0.85, 0.8, True)])
def test_a_calibration_that_ends_far_below_full_drive_stays_the_table(
    green: float, codes_to: float, kept: bool
) -> None:
    """The conversion of codes is never what takes full drive away: (0.85, 0.8) would send green to 0.68 at most."""
    codes = codes_to * table_c1_codes()
    found = parse_ti3(_through(np.stack([STEPS, green * STEPS, 0.95 * STEPS], axis=1), codes), "d.ti3")
    assert found.gamma_table is not None
    assert found.gamma_table.is_identity is not kept
    np.testing.assert_allclose(found.codes, codes * ([1, 1, 1] if kept else [1, green, 0.95]), atol=1e-5)
    assert any(f"green {green:g}" in said for said in found.assumptions)


def test_a_calibration_of_five_digits_that_changes_nothing_leaves_the_codes() -> None:
    rounded = np.round(np.stack([STEPS] * 3, axis=1), 5)
    found = parse_ti3([line.replace("CAL   ", "CAL    ") for line in _through(rounded, CODES)], "d.ti3")
    np.testing.assert_allclose(found.codes, CODES, atol=1e-12)
    assert found.assumptions == ()
    assert found.gamma_table is not None
    assert found.gamma_table.is_identity


@pytest.mark.nightly
def test_the_model_of_readings_through_a_calibration_is_that_of_the_panel(tmp_path: Path) -> None:
    codes = table_c1_codes()
    curve = np.stack([STEPS**1.15, STEPS**1.1, STEPS**1.2], axis=1)
    file = tmp_path / "d.ti3"
    file.write_text("\n".join(_through(curve, codes)))
    fit = fit_display(read_measurements(file), model="gog", file=file)
    model = fit.eyes["both"].characterisation.chosen.model
    asked = np.random.default_rng(1).random((200, 3))
    truth = thesis_display().xyz(asked)
    white = thesis_display().xyz([1.0, 1.0, 1.0])
    apart = delta_e_2000(xyz_to_lab(model.xyz(asked), white), xyz_to_lab(truth, white))
    ignored = thesis_display().xyz(np.stack([np.interp(asked[:, i], STEPS, curve[:, i]) for i in range(3)], axis=1))
    assert apart.max() < 0.05
    assert delta_e_2000(xyz_to_lab(ignored, white), xyz_to_lab(truth, white)).mean() > 1.0
    source = " ".join(fit.mode_lines().models["both"])
    assert "calibration of the graphics card's table" in source


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("RGB_I RGB_R", "RGB_I RGB_X", "the calibration has no RGB_R"),
        ("1 1 1 1\n", "1 1 1 1.2\n", "RGB_B of the calibration is '1.2'"),
        ("1 1 1 1\n", "1 1 many 1\n", "RGB_G of the calibration is 'many'"),
        ("1 1 1 1\n", "0.5 1 1 1\n", "RGB_I of the calibration does not rise from 0 to 1"),
        ("1 1 1 1\n", "", "NUMBER_OF_SETS is 256, and there are 255 rows"),
    ],
)
def test_a_broken_calibration_is_refused_with_its_place(old: str, new: str, says: str) -> None:
    text = "\n".join(_through(np.stack([STEPS] * 3, axis=1), CODES))
    assert text.count(old) == 1
    with pytest.raises(DeviceError, match=says) as caught:
        parse_ti3(text.replace(old, new).splitlines(), "d.ti3")
    assert all(finding.line and finding.column for finding in caught.value.findings)
