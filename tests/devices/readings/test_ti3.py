"""``.ti3`` files with and without spectra, right and wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.errors import DeviceError
from devices.readings import Measurements, read_measurements, xyz_from_spectra
from devices.readings.ti3 import format_ti3, parse_ti3, write_ti3
from documents import Finding

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
    assert back.spectra is not None
    assert back.wavelengths_nm is not None
    assert table.spectra is not None
    np.testing.assert_allclose(back.wavelengths_nm, waves, atol=1e-6)
    np.testing.assert_allclose(back.spectra, table.spectra, rtol=1e-14)
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
    assert table.spectra is not None
    rows = [
        f"{100 * r} {100 * g} {100 * b} " + " ".join(repr(1000 * float(v)) for v in light)
        for (r, g, b), light in zip(CODES.tolist(), table.spectra, strict=True)
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
    assert found.spectra is not None
    np.testing.assert_allclose(xyz_from_spectra(found.spectra, waves), table.XYZ, rtol=1e-9)
    assert f"multiplied by {factor:.4g}" in found.assumptions[0]


def _spectra(waves: np.ndarray) -> np.ndarray:
    found = _spectral(waves).spectra
    assert found is not None
    return found


def test_normalised_files_come_back_to_candelas_with_their_spectra() -> None:
    waves = np.arange(380.0, 731, 10)
    table = _spectral(waves)
    white = float(table.XYZ[2, 1])
    assert table.spectra is not None
    relative = Measurements(
        CODES, table.XYZ * 100 / white, table.name, spectra=table.spectra * 100 / white, wavelengths_nm=waves
    )
    text = format_ti3(relative).replace('Y_100 "NO"', 'Y_100 "YES"').splitlines()
    text = [f'LUMINANCE_XYZ_CDM2 "0 {white!r} 0"' if line.startswith("LUMINANCE") else line for line in text]
    found = parse_ti3(text, "d.ti3")
    assert found.spectra is not None
    np.testing.assert_allclose(found.XYZ, table.XYZ)
    np.testing.assert_allclose(found.spectra, table.spectra)
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
    assert back.time_s is not None
    assert (back.mode, back.eye, back.time_s.tolist()) == (table.mode, table.eye, [0.0, 1.25, 1e9 / 7])
    assert "KEYWORD" not in format_ti3(PLAIN)
    with pytest.raises(DeviceError, match="'up' is no eye"):
        parse_ti3(text.replace(" right ", " up ").splitlines(), "d")
    with pytest.raises(DeviceError, match=r"TIME_S is 'soon'.*a finite number"):
        parse_ti3(text.replace(" 1.25", " soon").splitlines(), "d")
