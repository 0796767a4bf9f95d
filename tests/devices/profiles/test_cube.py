"""`.cube` tables, read here by the format's own rules."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.characterise import thesis_display
from devices.colour import delta_e_2000, rgb_to_xyz_matrix, xyz_to_lab
from devices.display import DisplayModel, ToneCurve
from devices.errors import DeviceError
from devices.profiles import CubeInput, cube_of_model, write_cube
from devices.profiles.colour_table import between
from tests.devices.profiles.profile_bytes import plvc_display


def _read(text: str) -> tuple[dict[str, str], np.ndarray]:
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    words = {line.split()[0]: line.partition(" ")[2] for line in lines if line[0].isalpha()}
    return words, np.array([[float(v) for v in line.split()] for line in lines if not line[0].isalpha()])


def _srgb_display(luminance: float) -> DisplayModel:
    primaries = luminance * rgb_to_xyz_matrix((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))
    curve = ToneCurve(1.0, 0.0, 2.2)
    return DisplayModel(np.zeros(3), primaries, (curve, curve, curve))


def test_red_runs_fastest_and_the_corners_are_the_displays_own() -> None:
    words, rows = _read(cube_of_model(_srgb_display(80.0), "my\ndisplay", points=5).text)
    assert words["TITLE"] == '"my display"'
    assert words["LUT_3D_SIZE"] == "5"
    assert (words["DOMAIN_MIN"], words["DOMAIN_MAX"]) == ("0 0 0", "1 1 1")
    assert len(rows) == 125
    np.testing.assert_allclose(rows[4], [1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(rows[20], [0, 1, 0], atol=1e-6)
    np.testing.assert_allclose(rows[100], [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(rows[-1], [1, 1, 1], atol=1e-6)
    grey = (((0.5 + 0.055) / 1.055) ** 2.4) ** (1 / 2.2)
    np.testing.assert_allclose(rows[62], [grey] * 3, atol=1e-6)


def test_white_of_srgb_is_the_white_of_any_display() -> None:
    for model in (thesis_display(), plvc_display(0.15)):
        made, finer = (cube_of_model(model, "x", points=points) for points in (9, 17))
        np.testing.assert_allclose(_read(made.text)[1][-1], [1, 1, 1], atol=1e-5)
        assert 0.0 < made.outside < 0.6
        assert finer.mean < 0.5 * made.mean


@pytest.mark.parametrize("given", ["srgb", pytest.param("light", marks=pytest.mark.nightly)])
def test_opencolorio_reads_the_table_as_it_is_meant(given: CubeInput, tmp_path: Path) -> None:
    oiio = pytest.importorskip("OpenImageIO")
    model = thesis_display()
    path = tmp_path / "display.cube"
    write_cube(model, path, "x", given, points=33 if given == "srgb" else 1024)
    asked = np.random.default_rng(1).random((40, 50, 3)).astype(np.float32)
    picture = oiio.ImageBuf(oiio.ImageSpec(50, 40, 3, oiio.FLOAT))
    picture.set_pixels(oiio.ROI(), asked)
    found = oiio.ImageBufAlgo.ociofiletransform(picture, str(path))
    if found.has_error:
        pytest.skip(f"OpenImageIO without OpenColorIO: {found.geterror()}")
    codes = np.asarray(found.get_pixels(oiio.FLOAT)).reshape(-1, 3)
    asked64 = asked.reshape(-1, 3).astype(np.float64)
    if given == "light":
        lowest, highest = model.limits
        wanted = model.code(model.xyz_of_linear(lowest + (highest - lowest) * asked64))
        assert np.abs(codes - wanted)[asked64 > 0.05].max() < 1e-4
    else:
        rows = _read(path.read_text(encoding="utf-8"))[1].reshape(33, 33, 33, 3).transpose(2, 1, 0, 3)
        # Interpolated in cubes there, in tetrahedra here: the same but for what bends within a cube.
        assert np.abs(codes - between(rows, asked64)).mean() < 1e-3
        assert np.abs(codes - between(rows, asked64)).max() < 0.05


def test_light_in_is_linear_out() -> None:
    model = thesis_display()
    made = cube_of_model(model, "x", "light")
    words, rows = _read(made.text)
    assert words["LUT_1D_SIZE"] == "4096"
    share = np.linspace(0, 1, 4096)
    black, white = model.xyz(np.zeros(3)), model.xyz(np.ones(3))
    wanted = black + share[:, None] * (white - black)
    off = delta_e_2000(xyz_to_lab(model.xyz(rows), white), xyz_to_lab(wanted, white))
    assert off.max() < 0.02
    assert made.largest < 0.1
    assert "from light" in made.sentence("light")


def test_what_cannot_be_a_cube_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="act on each other"):
        cube_of_model(plvc_display(0.15), "x", "light")
    with pytest.raises(DeviceError, match="130 points"):
        cube_of_model(thesis_display(), "x", points=130)
    with pytest.raises(DeviceError, match="cannot be written"):
        write_cube(thesis_display(), tmp_path / "none" / "x.cube", "x", points=2)


@pytest.mark.parametrize("given", ["srgb", "light"])
def test_the_room_s_light_is_left_out(given: CubeInput) -> None:
    model = thesis_display()
    lit, dark = (cube_of_model(each, "x", given, points=9) for each in (model.in_room([3.0, 4.0, 2.0]), model))
    assert lit == dark
