"""A profile with a table beside its matrix: the table holds [ICC2022], for pictures and for displays alike."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from devices.characterise import thesis_display
from devices.errors import DeviceError
from devices.profiles import model_of_profile, profile_of_model, read_profile
from devices.profiles.tag_table import parse_profile_file
from devices.readings import profile_measurements, read_profile_measurements
from runner.cli.main import group
from stimuli.pictures import StereoImage, read_picture
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import CHAD, COLORANTS, matrix_tags, para, profile

CODES = np.random.default_rng(3).integers(0, 256, (8, 12, 3), dtype=np.uint8)
ADAPTATION = np.reshape(CHAD, (3, 3))


def tables(*names: str) -> dict[str, bytes]:
    """Return a table of a display whose primaries and curves are not sRGB's, under ``names``."""
    content = parse_profile_file(profile_of_model(thesis_display(), "display", kind="table", points=9).data, "made")
    tag = content.tag("A2B0")
    assert tag is not None
    return dict.fromkeys(names, tag.data)


def read(path: Path, data: bytes, codes: np.ndarray = CODES) -> StereoImage:
    Image.fromarray(codes).save(path, icc_profile=data)
    return read_picture(path, white_luminance_cd_m2=100)


@pytest.mark.parametrize("names", [("A2B0",), ("A2B0", "A2B1")])
def test_the_table_holds_where_there_is_a_matrix_too(tmp_path: Path, names: tuple[str, ...]) -> None:
    both = profile(matrix_tags(para(0, 1.8)) | tables(*names))
    found = read(tmp_path / "both.png", both).left.reshape(-1, 3)
    wanted = 100 * through(both, CODES.reshape(-1, 3) / 255) @ np.linalg.inv(ADAPTATION).T
    # LittleCMS keeps sampled curves in 16 bits; the matrix is off by more than a cd/m².
    assert np.abs(found - wanted).max() < 0.1
    by_matrix = read(tmp_path / "matrix.png", profile(matrix_tags(para(0, 1.8)))).left.reshape(-1, 3)
    assert np.abs(by_matrix - wanted).max() > 5


def test_a_matrix_alone_stays_exact(tmp_path: Path) -> None:
    found = read(tmp_path / "a.png", profile(matrix_tags(para(0, 1.8)))).left.reshape(-1, 3)
    primaries = np.stack([COLORANTS[name] for name in ("rXYZ", "gXYZ", "bXYZ")], axis=1)
    wanted = 100 * (CODES.reshape(-1, 3) / 255) ** 1.8 @ (np.linalg.inv(ADAPTATION) @ primaries).T
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=2e-3)


@pytest.mark.parametrize("more", [{}, tables("A2B1")])
def test_pictures_and_displays_read_one_light(tmp_path: Path, more: dict[str, bytes]) -> None:
    (tmp_path / "display.icc").write_bytes(profile(matrix_tags(para(0, 1.8)) | more))
    readings = profile_measurements(read_profile(tmp_path / "display.icc"))
    codes = np.rint(255 * readings.codes)
    whole = np.abs(codes - 255 * readings.codes).max(axis=1) < 1e-6
    assert whole.sum() > 20
    picture = read(tmp_path / "a.png", (tmp_path / "display.icc").read_bytes(), codes[whole][None].astype(np.uint8))
    np.testing.assert_allclose(picture.left[0], readings.XYZ[whole], rtol=1e-5, atol=1e-5)


@pytest.mark.nightly
def test_display_fit_takes_the_table_and_the_matrix_says_that_it_is_not_all(tmp_path: Path) -> None:
    path = tmp_path / "display.icc"
    path.write_bytes(profile(matrix_tags(para(0, 1.8)) | tables("A2B1")))
    told = CliRunner().invoke(group, ["display", "fit", str(path), "--json", "--brief"])
    assert told.exit_code == 0, told.output
    assert "('A2B1')" in " ".join(json.loads(told.stdout)["both"]["said"])
    assert any("ranks above" in note for note in model_of_profile(read_profile(path)).notes)
    path.write_bytes(profile(matrix_tags(para(0, 1.8))))
    assert not any("ranks above" in note for note in model_of_profile(read_profile(path)).notes)
    path.write_bytes(profile({name: tag for name, tag in matrix_tags(para(0, 1.8)).items() if "XYZ" not in name}))
    with pytest.raises(DeviceError):
        read_profile_measurements(path)


def test_a_damaged_matrix_is_not_needed_beside_a_table(tmp_path: Path) -> None:
    tags = matrix_tags(para(0, 1.8)) | tables("A2B1")
    whole = read(tmp_path / "a.png", profile(tags))
    del tags["rTRC"]
    np.testing.assert_array_equal(read(tmp_path / "b.png", profile(tags)).left, whole.left)
