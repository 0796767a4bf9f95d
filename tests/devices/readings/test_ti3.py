"""``.ti3`` files: their numbers, and what they state, which is honoured or refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.characterise import fit_display, table_c1_codes, thesis_display
from devices.colour import delta_e_2000, xyz_to_lab
from devices.diagnostics import read_sets
from devices.errors import DeviceError
from devices.readings import (
    CIE_1931_2,
    OBSERVERS,
    Measurements,
    read_measurements,
    write_csv,
    xyz_from_spectra,
)
from devices.readings.table import joined
from devices.readings.ti3 import format_ti3, parse_ti3, write_ti3
from documents import Finding
from tests.kept import known

# ``.ti3`` files with and without spectra, right and wrong.

CODES = np.array([[0, 0, 0], [128, 0, 0], [255, 255, 255]]) / 255
PLAIN = Measurements(
    CODES,
    np.array([[0.1, 0.1, 0.2], [5.3, 2.8, 0.4], [95.0, 100.0, 108.9]]),
    ("black", "half red", 'the "white"'),
    instrument="CS-2000",
)


def _spectral(waves: np.ndarray, XYZ: np.ndarray | None = None) -> Measurements:
    shapes = np.array([np.exp(-(((waves - at) / 40) ** 2)) for at in (450, 620, 540)])
    spectra = np.array([0.001, 0.02, 0.3])[:, None] * shapes
    own = xyz_from_spectra(spectra, waves)
    return Measurements(CODES, own if XYZ is None else XYZ, ("a", "b", "c"), spectra=spectra, wavelengths_nm=waves)


@pytest.mark.parametrize("waves", [np.arange(380.0, 781, 4), np.arange(380.0, 781), np.linspace(380, 730, 106)])
def test_spectra_come_back_at_their_own_spacing(tmp_path: Path, waves: np.ndarray) -> None:
    table = _spectral(waves)
    write_ti3(table, tmp_path / "d.ti3")
    back = read_measurements(tmp_path / "d.ti3")
    np.testing.assert_allclose(known(back.wavelengths_nm), waves, atol=1e-6)
    np.testing.assert_allclose(known(back.spectra), known(table.spectra), rtol=1e-14)
    np.testing.assert_array_equal(back.XYZ, table.XYZ)
    assert back.assumptions == ()


def test_argyll_s_keywords_are_written() -> None:
    text = format_ti3(_spectral(np.linspace(380, 730, 106)))
    for line in ('SPECTRAL_BANDS "106"', 'SPECTRAL_START_NM "380.000000"', 'SPECTRAL_END_NM "730.000000"'):
        assert line in text
    assert " SPEC_380 SPEC_383 SPEC_387 SPEC_390 " in text
    assert "NUMBER_OF_FIELDS 114" in text


def test_without_XYZ_the_spectra_are_summed_at_their_own_spacing() -> None:
    waves = np.arange(380.0, 781, 4)
    table = _spectral(waves)
    fields = [f"SPEC_{wave:.0f}" for wave in waves]
    rows = [
        f"{100 * r} {100 * g} {100 * b} " + " ".join(repr(1000 * float(v)) for v in light)
        for (r, g, b), light in zip(CODES.tolist(), known(table.spectra), strict=True)
    ]
    text = ["BEGIN_DATA_FORMAT", f"RGB_R RGB_G RGB_B {' '.join(fields)}", "END_DATA_FORMAT", "BEGIN_DATA", *rows]
    found = parse_ti3([*text, "END_DATA"], "d.ti3")
    np.testing.assert_allclose(found.XYZ, table.XYZ, rtol=1e-12)
    assert "XYZ were summed from the spectra" in " ".join(found.assumptions)
    assert "names of the spectral fields" in " ".join(found.assumptions)


@pytest.mark.parametrize("factor", [10.0, 0.2])
def test_spectra_of_another_scale_are_brought_to_that_of_XYZ_and_said(factor: float) -> None:
    waves = np.arange(380.0, 781, 10)
    table = _spectral(waves, factor * xyz_from_spectra(_spectra(waves), waves))
    found = parse_ti3(format_ti3(table).splitlines(), "d.ti3")
    np.testing.assert_allclose(xyz_from_spectra(known(found.spectra), waves), table.XYZ, rtol=1e-9)
    assert f"multiplied by {factor:.4g}" in found.assumptions[0]


def _spectra(waves: np.ndarray) -> np.ndarray:
    found = known(_spectral(waves).spectra)
    return found


def test_normalised_files_come_back_to_candelas_with_their_spectra() -> None:
    waves = np.arange(380.0, 731, 10)
    table = _spectral(waves)
    white = float(table.XYZ[2, 1])
    relative = Measurements(
        CODES, table.XYZ * 100 / white, table.name, spectra=known(table.spectra) * 100 / white, wavelengths_nm=waves
    )
    text = format_ti3(relative).replace('Y_100 "NO"', 'Y_100 "YES"').splitlines()
    text = [f'LUMINANCE_XYZ_CDM2 "0 {white!r} 0"' if line.startswith("LUMINANCE") else line for line in text]
    found = parse_ti3(text, "d.ti3")
    np.testing.assert_allclose(found.XYZ, table.XYZ)
    np.testing.assert_allclose(known(found.spectra), known(table.spectra))
    assert found.assumptions == ()
    without = [line for line in text if not line.startswith("LUMINANCE")]
    assert "relative" in parse_ti3(without, "d.ti3").assumptions[0]


def test_spectra_that_disagree_with_XYZ_are_told_and_XYZ_kept() -> None:
    waves = np.arange(380.0, 781, 4)
    other = _spectral(waves).XYZ * [1.0, 1.0, 3.0]
    found = parse_ti3(format_ti3(_spectral(waves, other)).splitlines(), "d.ti3")
    assert "XYZ differ from those of the spectra" in found.assumptions[0]
    np.testing.assert_array_equal(found.XYZ, other)


@pytest.mark.parametrize("waves", [[380.5, 381.2, 390], [380, 380.4, 380.8], [380.5, 400.2, 500]])
def test_wavelengths_that_the_format_cannot_name_are_refused(waves: list[float]) -> None:
    table = Measurements(CODES, PLAIN.XYZ, spectra=np.ones((3, 3)), wavelengths_nm=np.array(waves))
    with pytest.raises(DeviceError, match="evenly spaced"):
        format_ti3(table)


@pytest.mark.parametrize(
    ("old", "new", "place", "says"),
    [
        ("100 100 100 95.0", "100 100 101 95.0", "20:27", "device values are 0..100"),
        ("5.3 2.8", "5.3 many", "19:36", "XYZ_Y is 'many'"),
        ("5.3 2.8", "nan 2.8", "19:32", "XYZ_X is 'nan'"),
        ("5.3 2.8", "5.3", "19:40", "the line has 7 fields, the format 8"),
        ("5.3 2.8", "5.3 2.8 1", "19:42", "the line has 9 fields, the format 8"),
        ("XYZ_Z", "LAB_B", "13:1", "no XYZ_Z"),
        ("XYZ_Z", "XYZ_Y", "13:53", "XYZ_Y stands twice"),
        ("END_DATA\n", "", "17:1", "not closed by END_DATA"),
        ("NUMBER_OF_SETS 3", "NUMBER_OF_SETS 4", "16:16", "NUMBER_OF_SETS is 4, and there are 3 rows"),
        ("NUMBER_OF_FIELDS 8", "NUMBER_OF_FIELDS 9", "11:18", "there are 8 fields"),
        ('"half red"', '"half', "19:3", "a quotation mark is not closed"),
        ('Y_100 "NO"', 'Y_100 "MAYBE"', "7:21", "YES or NO"),
        ("BEGIN_DATA_FORMAT", "# nothing", "", "names no fields"),
    ],
)
def test_a_bad_file_names_line_and_column(old: str, new: str, place: str, says: str) -> None:
    text = format_ti3(PLAIN)
    assert old in text
    with pytest.raises(DeviceError, match=says) as caught:
        parse_ti3(text.replace(old, new).splitlines(), "d.ti3")
    assert any(str(finding).startswith(f"d.ti3:{place}") for finding in caught.value.findings)
    assert all(finding.line and finding.column for finding in caught.value.findings)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('BANDS "11"', 'BANDS "12"', "SPECTRAL_BANDS is 12, and there are 11"),
        ('BANDS "11"', 'BANDS "many"', "SPECTRAL_BANDS is 'many'"),
        ('START_NM "380', 'START_NM "360', "SPEC_380 stands where 360 nm should"),
        ('END_NM "780.000000"', 'END_NM "-1"', "SPECTRAL_END_NM is '-1'"),
        ("SPEC_420", "SPEC_460", "stands twice"),
    ],
)
def test_bad_spectral_keywords_name_line_and_column(old: str, new: str, says: str) -> None:
    table = Measurements(CODES, PLAIN.XYZ, spectra=np.ones((3, 11)), wavelengths_nm=np.linspace(380, 780, 11))
    with pytest.raises(DeviceError, match=says) as caught:
        parse_ti3(format_ti3(table).replace(old, new).splitlines(), "d.ti3")
    assert all(finding.line and finding.column for finding in caught.value.findings)


def test_spectra_too_coarse_to_tell_XYZ_are_refused_with_their_place() -> None:
    table = Measurements(CODES, PLAIN.XYZ, spectra=np.ones((3, 11)), wavelengths_nm=np.linspace(380, 780, 11))
    with pytest.raises(DeviceError, match=r"d.ti3:\d+:\d+: .*at most 20 nm"):
        parse_ti3(format_ti3(table).splitlines(), "d.ti3")


@given(st.lists(st.sampled_from([*format_ti3(PLAIN).splitlines(), 'SPEC_400 "', "0", '""', "END_DATA x"]), max_size=25))
def test_any_lines_are_read_or_refused_with_a_place(lines: list[str]) -> None:
    findings: tuple[Finding, ...] = ()
    try:
        parse_ti3(lines, "d.ti3")
    except DeviceError as error:
        findings = error.findings
    assert all(finding.line and finding.column for finding in findings)


def test_mode_eyes_and_times_come_back_and_are_declared() -> None:
    table = replace(PLAIN, mode="quad-buffered", eye=("left", "right", "both"), time_s=np.array([0.0, 1.25, 1e9 / 7]))
    text = format_ti3(table)
    for name in ("STEREO_MODE", "EYE", "TIME_S"):
        assert f'KEYWORD "{name}"' in text
    back = parse_ti3(text.splitlines(), "d")
    assert (back.mode, back.eye, known(back.time_s).tolist()) == (table.mode, table.eye, [0.0, 1.25, 1e9 / 7])
    assert "KEYWORD" not in format_ti3(PLAIN)
    with pytest.raises(DeviceError, match="'up' is no eye"):
        parse_ti3(text.replace(" right ", " up ").splitlines(), "d")
    with pytest.raises(DeviceError, match=r"TIME_S is 'soon'.*a finite number"):
        parse_ti3(text.replace(" 1.25", " soon").splitlines(), "d")


# What a ``.ti3`` states of observer, device, levels and calibration is honoured or refused, never passed over.

XYZ = np.array([[0.1, 0.1, 0.2], [5.3, 2.8, 0.4], [95.0, 100.0, 108.9]])
STATED_PLAIN = Measurements(CODES, XYZ, ("black", "half red", "white"))
STEPS = np.linspace(0.0, 1.0, 256)


def _with(keyword: str) -> list[str]:
    return format_ti3(STATED_PLAIN).replace('COLOR_REP "RGB_XYZ"', f'COLOR_REP "RGB_XYZ"\n{keyword}').splitlines()


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
    table = replace(STATED_PLAIN, observer=observer)
    assert parse_ti3(format_ti3(table).splitlines(), "d.ti3").observer == observer
    write_csv(table, tmp_path / "d.csv")
    back = read_measurements(tmp_path / "d.csv")
    assert (back.observer, back.select([0]).observer) == (observer, observer)


def test_an_observer_that_is_not_known_is_refused_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"d.ti3:7:10: .*'1955_2' is not known .*1964_10"):
        parse_ti3(_with('OBSERVER "1955_2"'), "d.ti3")
    file = tmp_path / "d.csv"
    write_csv(STATED_PLAIN, file)
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
    text = format_ti3(STATED_PLAIN)
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
    bare = [line for line in format_ti3(STATED_PLAIN).splitlines() if not line.startswith(("DEVICE", "COLOR", "CTI3"))]
    np.testing.assert_allclose(parse_ti3(bare, "d.ti3").codes, CODES, atol=1e-12)


def test_argyll_s_negative_zero_is_zero() -> None:
    text = format_ti3(STATED_PLAIN).replace('"half red" 50.1960784314 0 0', '"half red" 50.1960784314 -0.00100 0.0')
    assert "-0.00100" in text
    assert parse_ti3(text.splitlines(), "d.ti3").codes[1].tolist() == [pytest.approx(128 / 255), 0.0, 0.0]
    with pytest.raises(DeviceError, match=r"RGB_G is -0.5 .device values are 0..100"):
        parse_ti3(text.replace("-0.00100", "-0.5").splitlines(), "d.ti3")


def test_a_calibration_is_applied_to_the_codes_and_said() -> None:
    curve = np.stack([STEPS**1.1, STEPS, 0.93 * STEPS], axis=1)
    found = parse_ti3(_through(curve, CODES), "d.ti3")
    np.testing.assert_allclose(found.codes[2], [1.0, 1.0, 0.93], atol=1e-6)
    assert found.codes[1, 0] == pytest.approx(np.interp(128 / 255, STEPS, STEPS**1.1), abs=1e-6)
    assert known(found.gamma_table).is_identity
    assert "up to 0.07 of full code" in found.assumptions[0]
    assert "no codes above blue 0.93" in found.assumptions[1]


def test_an_identity_says_nothing_and_no_calibration_leaves_the_table_unknown() -> None:
    same = parse_ti3(_through(np.stack([STEPS] * 3, axis=1), CODES), "d.ti3")
    assert (same.assumptions, parse_ti3(format_ti3(STATED_PLAIN).splitlines(), "d.ti3").gamma_table) == ((), None)
    np.testing.assert_allclose(same.codes, CODES, atol=1e-12)
    back = parse_ti3(format_ti3(same).splitlines(), "d.ti3")
    assert back.gamma_table is not None


@pytest.mark.parametrize("top", [pytest.param(top, marks=pytest.mark.nightly) for top in (1.0, 0.9)])
def test_a_calibration_that_lifts_black_stays_the_table_of_the_readings(top: float, tmp_path: Path) -> None:
    codes = table_c1_codes()
    curve = np.stack([0.02 + 0.98 * STEPS, 0.015 + 0.985 * STEPS, 0.03 + (top - 0.03) * STEPS], axis=1)
    found = parse_ti3(_through(curve, codes), "d.ti3")
    np.testing.assert_allclose(found.codes, codes, atol=1e-9)
    np.testing.assert_allclose(known(found.gamma_table).shares, curve, atol=2e-5)
    assert "only while this calibration is loaded" in found.assumptions[0]
    fit = fit_display(found, model="table")
    model = fit.eyes["both"].characterisation.chosen.model
    sent = np.stack([np.interp(codes[:, i], STEPS, curve[:, i]) for i in range(3)], axis=1)
    truth, white = thesis_display().xyz(sent), thesis_display().xyz([1.0, 1.0, 1.0])
    assert delta_e_2000(xyz_to_lab(model.xyz(codes), white), xyz_to_lab(truth, white)).max() < 0.5
    assert not known(fit.gamma_table).is_identity


@pytest.mark.parametrize(("green", "codes_to", "kept"), [(0.746, 1.0, True), (0.76, 1.0, False), (0.85, 0.8, True)])
def test_a_calibration_that_ends_far_below_full_drive_stays_the_table(
    green: float, codes_to: float, kept: bool
) -> None:
    """The conversion of codes is never what takes full drive away: (0.85, 0.8) would send green to 0.68 at most."""
    codes = codes_to * table_c1_codes()
    found = parse_ti3(_through(np.stack([STEPS, green * STEPS, 0.95 * STEPS], axis=1), codes), "d.ti3")
    assert known(found.gamma_table).is_identity is not kept
    np.testing.assert_allclose(found.codes, codes * ([1, 1, 1] if kept else [1, green, 0.95]), atol=1e-5)
    assert any(f"green {green:g}" in said for said in found.assumptions)


def test_a_calibration_of_five_digits_that_changes_nothing_leaves_the_codes() -> None:
    rounded = np.round(np.stack([STEPS] * 3, axis=1), 5)
    found = parse_ti3([line.replace("CAL   ", "CAL    ") for line in _through(rounded, CODES)], "d.ti3")
    np.testing.assert_allclose(found.codes, CODES, atol=1e-12)
    assert found.assumptions == ()
    assert known(found.gamma_table).is_identity


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
