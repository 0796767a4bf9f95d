"""Spectral pictures, curves and numbers made to do harm."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from stimuli.errors import StimulusError
from stimuli.spectral import Illumination, read_spectral
from stimuli.spectral import picture as pictures
from stimuli.spectral.convert import spectral_to_camera, spectral_to_xyz
from stimuli.spectral.curves import read_illuminant, read_sensitivities

WAVES = np.arange(400.0, 710.0, 10.0)
LISTED = "wavelength = {" + ", ".join(f"{wave:g}" for wave in WAVES) + "}\nwavelength units = Nanometers\n"
HEAD = "wavelength_nm,red,green,blue\n"


def envi(folder: Path, more: str = "", **changed: object) -> Path:
    keys = {"samples": 8, "lines": 8, "bands": 31, "header offset": 0, "data type": 4, "interleave": "bsq"}
    keys |= {key.replace("_", " "): one for key, one in changed.items()}
    text = "".join(f"{key} = {one}\n" for key, one in keys.items())
    path = folder / "a.hdr"
    path.write_text(f"ENVI\n{text}file type = ENVI Standard\nbyte order = 0\n{LISTED}{more}", encoding="utf-8")
    (folder / "a.img").write_bytes(np.full(8 * 8 * 31, 0.5, np.float32).tobytes())
    return path


def told(error: pytest.ExceptionInfo[StimulusError]) -> str:
    (finding,) = error.value.findings
    text = str(finding)
    assert text.isprintable()
    assert len(text) < 1500
    return text


@pytest.mark.parametrize(
    ("changed", "more", "reason"),
    [
        ({"samples": 10**9, "lines": 10**9}, "", "cut short"),
        ({"lines": "9" * 30}, "", "a.hdr: "),
        ({"header_offset": "9" * 400}, "", "cut short"),
        ({"bands": 0}, "", "0 bands"),
        ({"samples": -8, "lines": -8}, "", "-8 samples"),
        ({}, "data ignore value = {1, 2}\n", "its data ignore value is"),
        ({}, "reflectance scale factor = nan\n", "scale factor is nan"),
        ({}, "description = {" + "x" * 1_100_000 + "}\n", "its header is larger than 1000 kB"),
        ({"interleave": "\u202e<b>\x1b[2J"}, "", "its interleave is"),
    ],
)
def test_headers_that_lie_are_refused(tmp_path: Path, changed: dict[str, object], more: str, reason: str) -> None:
    began_s = time.process_time()
    with pytest.raises(StimulusError) as caught:
        spectral_to_xyz(read_spectral(envi(tmp_path, more, **changed), "radiance"))
    assert reason in told(caught)
    assert time.process_time() - began_s < 5


def test_rows_that_fill_the_memory_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = envi(tmp_path)
    monkeypatch.setattr(pictures, "MAX_CHUNK_VALUES", 8 * 31)
    assert spectral_to_xyz(read_spectral(path, "radiance")).xyz.shape == (8, 8, 3)
    monkeypatch.setattr(pictures, "MAX_CHUNK_VALUES", 8 * 31 - 1)
    with pytest.raises(StimulusError, match="more than 247 values"):
        read_spectral(path, "radiance")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (HEAD + "400,1e308,1,1\n700,1,1,1\n", "s.csv:2:2: red is '1e308' (a number in 0..1e+30"),
        (HEAD + "400,nan,1,1\n", "s.csv:2:2: red is 'nan'"),
        ("wavelength_nm,red,red,green,blue\n400,1,2,1,1\n700,1,1,1,1\n", "the column 'red' stands twice"),
        (HEAD + "\u202e<b>\x1b[2J" + "y" * 100_000 + ",1,1,1\n", "s.csv:2:1: wavelength_nm is '<b>[2Jyyy"),
        (HEAD + '"' + "400,1,1,1\n" * 100_000, "not CSV"),
        (HEAD + "".join(f"{400 + number / 1e4:.4f},1,1,1\n" for number in range(150_000)), "larger than 2 MB"),
    ],
)
def test_curves_that_do_harm_are_refused(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "s.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(StimulusError) as caught:
        read_sensitivities(path, WAVES)
    assert reason in told(caught)


@pytest.mark.parametrize("number", [1e-300, 1e300, float("nan"), 0.0])
def test_absurd_numbers_are_refused(tmp_path: Path, number: float) -> None:
    with pytest.raises(StimulusError, match="'scale' is"):
        Illumination(scale=number)
    with pytest.raises(StimulusError, match="'white_luminance_cd_m2' is"):
        Illumination("D65", number)
    sensor = tmp_path / "s.csv"
    sensor.write_text(HEAD + "400,1,1,1\n700,1,1,1\n", encoding="utf-8")
    with pytest.raises(StimulusError, match="full scale is at"):
        spectral_to_camera(read_spectral(envi(tmp_path), "radiance"), sensor, number)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="this system has no file without an end")
def test_a_curve_without_an_end_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "endless.csv").symlink_to("/dev/zero")
    with pytest.raises(StimulusError, match="this is a link to a device"):
        read_illuminant(str(tmp_path / "endless.csv"), WAVES)
