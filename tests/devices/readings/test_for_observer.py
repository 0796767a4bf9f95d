"""Readings turned to another colorimetric observer by their spectra, and what the spacing of spectra does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.characterise import fit_display, table_c1_codes
from devices.colour_matching import STANDARD_OBSERVERS
from devices.display import PanelSpec, read_display, read_rig
from devices.errors import DeviceError
from devices.readings import Measurements, for_observer, read_measurements, sampling_error, xyz_from_spectra
from devices.readings.ti3 import write_ti3
from documents import InputError

pytestmark = pytest.mark.usefixtures("fits_kept")

PANEL = PanelSpec(resolution_px=(1920, 1080), pixel_pitch_mm=0.28)
ROOT = Path(__file__).parents[3]
WAVES = np.arange(380.0, 781.0, 5.0)


def _primaries(waves: np.ndarray) -> np.ndarray:
    """Narrow red, broader green and blue, in W/(sr m² nm)."""
    return np.stack([np.exp(-(((waves - mid) / wide) ** 2)) for mid, wide in ((625, 16), (530, 30), (455, 18))]) * 2e-3


def display_readings(observer: str = "CIE 1931 2") -> Measurements:
    """Some readings of a display of gamma 2.2 by a spectroradiometer of 5 nm."""
    codes = table_c1_codes()[np.union1d(np.arange(0, 120, 4), [26, 52, 78, 119])]
    spectra = (0.002 + codes**2.2) @ _primaries(WAVES)
    XYZ = xyz_from_spectra(spectra, WAVES, observer)
    return Measurements(codes, XYZ, mode="flat", spectra=spectra, wavelengths_nm=WAVES, observer=observer)


@pytest.mark.parametrize("observer", STANDARD_OBSERVERS)
@pytest.mark.parametrize("spacing", [1, 5])
def test_xyz_of_each_observer_are_those_of_colour_science(observer: str, spacing: int) -> None:
    from colour.colorimetry import MSDS_CMFS, SpectralDistribution, SpectralShape, sd_to_XYZ_integration

    waves = np.arange(380.0, 781.0, spacing)
    spectrum = _primaries(waves).sum(axis=0)
    cmfs = MSDS_CMFS[f"{observer} Degree Standard Observer"]
    shape = SpectralShape(max(380.0, cmfs.shape.start), 780.0, spacing)
    known = SpectralDistribution(dict(zip(waves, spectrum, strict=True))).trim(shape)
    efficacy = {"CIE 1931 2": 683.0, "CIE 1964 10": 683.6, "CIE 2015 2": 683.358, "CIE 2015 10": 683.144}[observer]
    theirs = sd_to_XYZ_integration(known, cmfs.copy().align(shape), k=efficacy)
    np.testing.assert_allclose(xyz_from_spectra(spectrum, waves, observer)[0], theirs, rtol=1e-6)


def test_a_model_for_another_observer_comes_from_the_spectra_and_says_so(tmp_path: Path) -> None:
    readings = display_readings()
    write_ti3(readings, tmp_path / "d.ti3")
    fit = fit_display(read_measurements(tmp_path / "d.ti3"), model="gamma", observer="2012_10")
    assert fit.to_json()["observer"] == fit.observer == "CIE 2015 10"
    white = fit.eyes["both"].characterisation.chosen.model.xyz([1.0, 1.0, 1.0])
    np.testing.assert_allclose(white, for_observer(readings, "CIE 2015 10").XYZ.max(axis=0), rtol=6e-3)
    assert np.abs(readings.XYZ.max(axis=0) / white - 1).max() > 0.03
    file = tmp_path / "d.yaml"
    fit.write(file, PANEL)
    assert "observer: CIE 2015 10" in file.read_text()
    assert read_display(file).observers == {"flat": "CIE 2015 10"}


@pytest.mark.nightly
def test_fitted_again_for_the_readings_own_observer_nothing_of_the_other_stays(tmp_path: Path) -> None:
    file, readings = tmp_path / "d.yaml", display_readings()
    fit_display(readings, model="gamma", observer="2012_10").write(file, PANEL)
    fit_display(readings, model="gamma").write(file, replace=True)
    assert read_display(file).observers == {"flat": "CIE 1931 2"}


def test_another_observer_needs_spectra() -> None:
    readings = display_readings()
    bare = Measurements(readings.codes, readings.XYZ)
    assert for_observer(bare, "1931_2") is bare
    with pytest.raises(DeviceError, match=r"^d.csv: .*CIE 1931 2 without spectra") as caught:
        for_observer(bare, "CIE 2015 10", "d.csv")
    assert len(caught.value.findings) == 1


def test_a_rig_and_its_display_must_be_of_one_observer(tmp_path: Path) -> None:
    display = (ROOT / "configs/displays/asus_vg248qe.yaml").read_text(encoding="utf-8")
    own = "  quad-buffered:\n    observer: CIE 2006 10 age 65\n"
    (tmp_path / "d.yaml").write_text(display.replace("  quad-buffered:\n", own), encoding="utf-8")
    rig = tmp_path / "r.yaml"
    text = "schema_version: 1\ndisplay: d.yaml\nmode: quad-buffered\ndistance_mm: 700\n"
    rig.write_text(text)
    with pytest.raises(InputError, match=r"observer CIE 1931 2, .* CIE 2006 10 age 65"):
        read_rig(rig)
    rig.write_text(text + "observer: {kind: cie2006, age_years: 65, field_deg: 10}\n")
    assert read_rig(rig).observer == "CIE 2006 10 age 65"
    rig.write_text(text + "observer: CIE 1964 10\n")
    with pytest.raises(InputError, match=r"r.yaml:5:11: .*observer CIE 1964 10") as caught:
        read_rig(rig)
    assert len(caught.value.findings) == 1
    rig.write_text(text + "observer: CIE 1976\n")
    with pytest.raises(InputError, match=r"r.yaml:5:11: .*did you mean 'CIE 1964 10'"):
        read_rig(rig)


@pytest.mark.nightly
def test_eyes_of_different_observers_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "d.yaml"
    fit_display(display_readings(), model="gamma", eye="left").write(file, PANEL)
    fit_display(display_readings(), model="gamma", eye="right").write(file)
    assert read_display(file).observers == {"flat": "CIE 1931 2"}
    other = fit_display(display_readings(), model="gamma", eye="right", observer="CIE 2006 10 age 65")
    with pytest.raises(DeviceError, match=r"of CIE 1931 2, .* of CIE 2006 10 age 65"):
        other.write(file, replace=True)


@pytest.mark.parametrize(
    ("waves", "says"),
    [
        (np.arange(420.0, 681.0, 5), "420..680 nm; 400..700 nm is the least.*CIE 2015 10"),
        (np.arange(380.0, 781.0, 25), "steps of at most 20 nm.*CIE 2015 10"),
    ],
)
def test_spectra_too_short_or_too_coarse_are_refused_in_one_message(waves: np.ndarray, says: str) -> None:
    with pytest.raises(DeviceError, match=says) as caught:
        xyz_from_spectra(np.ones((2, len(waves))), waves, "CIE 2015 10")
    assert len(caught.value.findings) == 1


def test_what_coarse_spectra_may_do_to_xyz_is_said() -> None:
    coarse = np.arange(380.0, 781.0, 20)
    codes = np.eye(3)
    spectra = _primaries(coarse)
    readings = Measurements(codes, xyz_from_spectra(spectra, coarse), spectra=spectra, wavelengths_nm=coarse)
    seen = for_observer(readings, "CIE 2015 10")
    assert any("may be off" in note for note in seen.assumptions)
    fine = for_observer(display_readings(), "CIE 2015 10")
    assert not any("may be off" in note for note in fine.assumptions)
    assert sampling_error(spectra, coarse) > 10 * sampling_error(_primaries(WAVES), WAVES)


@pytest.mark.parametrize("spacing", [10, *(pytest.param(nm, marks=pytest.mark.nightly) for nm in (5, 20))])
def test_the_stated_error_bounds_the_true_one_nearly_always(spacing: int) -> None:
    rng = np.random.default_rng(3)
    fine, coarse = np.arange(380.0, 781.0), np.arange(380.0, 781.0, spacing)
    within = 0
    for _ in range(200):
        mids, wide, high = rng.uniform(430, 650, 3), rng.uniform(12, 60, 3), rng.random(3)
        spectrum = (high[:, None] * np.exp(-(((fine - mids[:, None]) / wide[:, None]) ** 2))).sum(axis=0)
        true = xyz_from_spectra(spectrum, fine, "CIE 2015 10")[0]
        taken = np.interp(coarse, fine, spectrum)
        found = xyz_from_spectra(taken, coarse, "CIE 2015 10")[0]
        within += bool(np.abs(found - true).max() / true[1] <= sampling_error(taken, coarse, "CIE 2015 10"))
    assert within >= 180
