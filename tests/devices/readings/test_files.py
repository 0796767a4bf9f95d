"""Measurements from spectra, ArgyllCMS and Psychtoolbox files.

MAT-files: what SciPy writes is read as SciPy reads it, and what a file only announces is not believed.
"""

from __future__ import annotations

import io
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from devices.errors import DeviceError
from devices.readings import MatFileError, read_mat, read_measurements, xyz_from_spectra
from devices.readings.psychtoolbox import read_psychtoolbox
from tests.stress.foreign_formats import FORMATS

RNG = np.random.default_rng(1)
NUMBERS = {
    "double": np.array([[380.0, 5.0, 81.0]]),
    "single": RNG.random((3, 4, 2)).astype(np.float32),
    **{
        f"{sign}int{bits}": RNG.integers(0, 100, (2, 3)).astype(f"{sign}int{bits}")
        for sign in ("", "u")
        for bits in (8, 16, 32, 64)
    },
    "truth": np.array([[True, False]]),
}


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


def _row(*values: object) -> np.ndarray:
    row = np.empty((1, len(values)), dtype=object)
    row[0, :] = values
    return row


def _saved(compressed: bool, **variables: object) -> bytes:
    stream = io.BytesIO()
    savemat(stream, variables, do_compression=compressed)  # type: ignore[arg-type]  # a stream is right too
    return stream.getvalue()


@pytest.mark.parametrize("compressed", [False, True])
def test_what_scipy_writes_is_read(compressed: bool) -> None:
    others = {"text": "a display äö€", "empty": np.zeros((0, 0)), "complex": np.array([[1 + 2j]])}
    inner = {**NUMBERS, **others, "cell": _row("x", np.eye(2)), "struct": {"deep": {"x": 3.0}}}
    data = _saved(compressed, other=np.zeros((100, 100)), cals=_row(inner, {"x": 1.0}))
    read: Any = read_mat(data, "cals", "cal")
    assert set(read) == {"cals"}
    (first,), (second,) = read["cals"]
    for name, values in NUMBERS.items():
        np.testing.assert_array_equal(first[name], values)
    assert first["text"] == others["text"]
    assert first["empty"].size == 0
    assert first["complex"] is None
    assert first["cell"][0] == "x"
    np.testing.assert_array_equal(first["cell"][1], np.eye(2))
    assert first["struct"][0]["deep"][0]["x"].tolist() == [[3.0]]
    assert second["x"].tolist() == [[1.0]]


@pytest.mark.nightly
def test_large_variables_that_are_not_wanted_are_not_unpacked() -> None:
    data = _saved(True, pictures=np.zeros(8_000_000), cal={"x": 1.0})
    assert list(read_mat(data, "cal")) == ["cal"]
    with pytest.raises(MatFileError, match="unpacks to more than 50 MB"):
        read_mat(data, "pictures")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        pytest.param("a bomb", "unpacks to more than|a part states", marks=pytest.mark.nightly),
        pytest.param("a hundred bombs", "more than 20000000 numbers", marks=pytest.mark.nightly),
        pytest.param("structs", "values in one variable", marks=pytest.mark.nightly),
        ("too many cells", "values in one variable"),
        ("nested", "in each other"),
        ("variables", "more than 10000 variables"),
        ("negative", "has the dimensions -1 by -1"),
        ("version 7.3", "version 7.3"),
        ("version 4", "no MAT-file of version 5"),
        ("nothing", "no MAT-file of version 5"),
    ],
)
def test_what_a_file_only_announces_is_not_believed(name: str, why: str) -> None:
    (mat,) = (form for form in FORMATS if form.name == "mat")
    data = mat.crafted()[name]
    began_s = time.process_time()
    with pytest.raises(MatFileError, match=why):
        read_mat(data, "cals")
    assert time.process_time() - began_s < 5
