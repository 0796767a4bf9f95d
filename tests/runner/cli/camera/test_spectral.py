from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from devices.camera import Exposure
from devices.readings import xyz_from_spectra
from documents import InputError
from stimuli.develop import read_camera_image
from stimuli.pictures import read_exr
from tests.invoked import invoked, printed_json
from tests.stimuli.spectral.pictures import WAVES, bumps, save_envi, save_exr

LIGHT = bumps(WAVES)


run, told = partial(invoked, "camera", "spectral"), partial(printed_json, "camera", "spectral")


def test_radiance_becomes_xyz(tmp_path: Path) -> None:
    found = told(save_exr(tmp_path / "a.exr", LIGHT), "-o", tmp_path / "xyz.exr")
    truth = xyz_from_spectra(LIGHT.reshape(-1, 81), WAVES).reshape(7, 9, 3)
    np.testing.assert_allclose(read_exr(tmp_path / "xyz.exr").left, truth, rtol=1e-3)
    assert found["mean_luminance_cd_m2"] == pytest.approx(truth[..., 1].mean(), rel=1e-5)
    assert found["steps"][0]["observer"] == "CIE 1931 2"


def test_reflectance_of_envi_in_a_light(tmp_path: Path) -> None:
    header = save_envi(tmp_path / "a.hdr", np.ones((4, 5, 81), np.float32))
    options = ("--quantity", "reflectance", "--illuminant", "D65", "--white-luminance", 90)
    result = run(header, "-o", tmp_path / "xyz.exr", *options)
    assert result.exit_code == 0
    assert "81 bands over 380..780 nm, reflectance; XYZ, mean 90 cd/m², largest 90 cd/m²" in result.output
    np.testing.assert_allclose(read_exr(tmp_path / "xyz.exr").left[..., 1], 90, rtol=1e-3)


def test_camera_rgb_reads_back_as_a_photograph(tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text("wavelength_nm,red,green,blue\n380,0,1,2\n780,2,1,0\n", encoding="utf-8")
    picture = save_exr(tmp_path / "a.exr", LIGHT)
    options = ("--sensitivities", tmp_path / "s.csv", "--full-scale", 30000, "--exposure", "1/15,8,200")
    told(picture, "-o", tmp_path / "rgb.exr", *options)
    image = read_camera_image(tmp_path / "rgb.exr")
    assert image.exposure == Exposure(1 / 15, 8, 200)
    assert 0.1 < image.rgb.max() <= 1
    assert [step["step"] for step in image.steps][:2] == ["spectra_to_camera", "read"]


def test_what_does_not_go_together_is_refused(tmp_path: Path) -> None:
    picture = save_exr(tmp_path / "a.exr", LIGHT)
    before = picture.read_bytes()
    wrong = (["--sensitivities", "s.csv"], ["--exposure", "1,8"], ["--illuminant", "A"])
    for options in (["-o", picture], ["-o", tmp_path / "b.png"], *(["-o", tmp_path / "b.exr", *one] for one in wrong)):
        result = run(picture, *options)
        assert isinstance(result.exception, InputError)
        assert len(result.exception.findings) == 1
    assert picture.read_bytes() == before
    assert not (tmp_path / "b.exr").exists()
