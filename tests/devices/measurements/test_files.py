"""Measurements from spectra, ArgyllCMS and Psychtoolbox files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.errors import DeviceError
from devices.measurements import read_measurements, xyz_from_spectra
from devices.measurements.psychtoolbox import read_psychtoolbox


@pytest.mark.parametrize("step", [1, 4, 5, 10])
def test_equal_energy_is_white_at_any_spacing(step: int) -> None:
    waves = np.arange(380, 781, step, dtype=float)
    # CIE 15: ȳ sums to 106.857 over 1 nm, and x̄ and z̄ to nearly the same.
    XYZ = xyz_from_spectra(np.ones(len(waves)), waves)[0]
    np.testing.assert_allclose(XYZ, 683 * 106.857, rtol=2e-3)


def test_uneven_wavelengths_are_weighed_by_their_width() -> None:
    waves = np.concatenate([np.arange(380, 500, 2), np.arange(500, 781, 5)]).astype(float)
    np.testing.assert_allclose(xyz_from_spectra(np.ones(len(waves)), waves)[0], 683 * 106.857, rtol=5e-3)


@pytest.mark.parametrize("waves", [[400, 700], np.arange(420, 781, 4), np.arange(780, 379, -4), [400, 400, 700]])
def test_spectra_that_do_not_tell_are_refused(waves: object) -> None:
    found = np.asarray(waves, dtype=float)
    with pytest.raises(DeviceError):
        xyz_from_spectra(np.ones(len(found)), found)


def _calibration(path: Path, levels: np.ndarray, ambient: bool = True) -> tuple[np.ndarray, np.ndarray]:
    from scipy.io import savemat

    waves = 380 + 4 * np.arange(101)
    peaks = [np.exp(-(((waves - at) / 30) ** 2)) * 1e-3 for at in (610, 540, 450)]
    share = (levels / levels.max()) ** 2.2
    mon = np.stack([np.concatenate([s * peak for s in share]) for peak in peaks], axis=1)
    dark = np.full(101, 1e-6)
    cal = {"S_device": [380.0, 4.0, 101.0], "rawdata": {"rawGammaInput": levels[:, None], "mon": mon}}
    if ambient:
        cal["P_ambient"] = dark[:, None]
    savemat(path, {"cals": np.array([{"S_device": 0}, cal], dtype=object)})
    return np.array(peaks), dark


def test_a_psychtoolbox_calibration(tmp_path: Path) -> None:
    path = tmp_path / "cal.mat"
    peaks, dark = _calibration(path, np.linspace(0.1, 1, 10))
    found = read_measurements(path)
    assert found.codes.shape == (31, 3)
    assert found.name[0] == "black"
    assert found.spectra is not None
    # Power per band of 4 nm, ambient added again.
    np.testing.assert_allclose(found.spectra[10], (peaks[0] + dark) / 4)
    assert found.codes[10].tolist() == [1, 0, 0]
    assert "the last of 2" in found.assumptions[0]


def test_levels_of_255_and_no_ambient_are_told(tmp_path: Path) -> None:
    path = tmp_path / "cal.mat"
    _calibration(path, np.linspace(25.5, 255, 10), ambient=False)
    found = read_psychtoolbox(path)
    assert found.codes.max() == 1
    assert any("0..255" in said for said in found.assumptions)
    assert any("black is not measured" in said for said in found.assumptions)


def test_what_is_no_calibration_is_refused(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / "cal.mat"
    path.write_bytes(b"no matlab at all, but long enough to have a header" * 9)
    with pytest.raises(DeviceError, match="MATLAB"):
        read_psychtoolbox(path)
    savemat(path, {"other": 1})
    with pytest.raises(DeviceError, match="cals"):
        read_psychtoolbox(path)
    with pytest.raises(DeviceError, match="no known table"):
        read_measurements(tmp_path / "d.xlsx")
