"""Matrix and curves as a display model: what kind of curve, what white, what black, and how exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import SrgbCurve, TableCurve, ToneCurve
from devices.errors import DeviceError
from devices.profiles import ProfileModel, model_of_profile, profile_of_model, read_profile
from devices.profiles.curves import SampledCurve
from devices.profiles.display_model import tabled_curve
from devices.profiles.profile import profile_of
from devices.profiles.tag_table import parse_profile_file
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import CHAD, D50, curv, matrix_tags, para, profile, xyz

CODES = np.random.default_rng(1).random((500, 3))
SRGB = para(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
D65 = np.array([0.95047, 1.0, 1.08883])


def _model(data: bytes, white_cd_m2: float | None = None) -> ProfileModel:
    return model_of_profile(profile_of(parse_profile_file(data, "display.icc")), white_cd_m2)


def _largest_difference(made: ProfileModel, data: bytes, luminance: float = 100.0) -> float:
    """Return the largest ΔE00 between the model and what LittleCMS and the tags written here give."""
    wanted = through(data, CODES) @ np.linalg.inv(np.reshape(CHAD, (3, 3))).T * luminance
    white = luminance * D65
    return float(delta_e_2000(xyz_to_lab(made.model.xyz(CODES), white), xyz_to_lab(wanted, white)).max())


@pytest.mark.parametrize(
    ("curve", "wanted"),
    [
        (curv(), ToneCurve(1.0, 0.0, 1.0)),
        (curv(0x0240), ToneCurve(1.0, 0.0, 2.25)),
        (para(0, 2.25), ToneCurve(1.0, 0.0, 2.25)),
        (para(1, 2.0, 1.25, -0.25), ToneCurve(1.25, -0.25, 2.0)),
        (para(2, 2.0, 0.75, 0.125, 0.125), ToneCurve(0.75, 0.125, 2.0)),
        (curv(*(round(65535 * (i / 255) ** 2.2) for i in range(256))), ToneCurve(1.0, 0.0, 2.2)),
    ],
)
def test_a_curve_of_the_family_is_taken_exactly(curve: bytes, wanted: ToneCurve) -> None:
    data = profile(matrix_tags(curve))
    made = _model(data)
    assert made.model.curves == (wanted,) * 3
    assert _largest_difference(made, data) < 0.05


@pytest.mark.parametrize(
    ("curve", "entries"),
    [
        (para(3, 1 / 0.45, 1 / 1.099, 0.099 / 1.099, 1 / 4.5, 0.081), 1024),
        (curv(*(round(65535 * (0.01 + 0.99 * (i / 255) ** 1.8)) for i in range(256))), 64),
        (curv(*(round(65535 * (3 * x**2 - 2 * x**3)) for x in np.linspace(0, 1, 1024))), 128),
        (curv(*(round(65535 * max(x - 0.1, 0) / 0.9) for x in np.linspace(0, 1, 512))), 128),
        (curv(*(round(65535 * min(x / 0.9, 1)) for x in np.linspace(0, 1, 512))), 128),
    ],
)
def test_another_curve_becomes_a_short_table(curve: bytes, entries: int) -> None:
    data = profile(matrix_tags(curve))
    made = _model(data)
    assert all(isinstance(each, TableCurve) and len(each.codes) <= entries for each in made.model.curves)
    assert _largest_difference(made, data) < 0.15
    assert any("became a table of" in note for note in made.notes)


@pytest.mark.parametrize(
    "curve",
    [SRGB, curv(*(round(65535 * float(SrgbCurve().linear(i / 1023))) for i in range(1024)))],
    ids=["para", "curv"],
)
def test_the_curve_of_srgb_is_known_by_its_name(curve: bytes) -> None:
    data = profile(matrix_tags(curve))
    made = _model(data)
    assert made.model.curves == (SrgbCurve(),) * 3
    assert any("of sRGB" in note for note in made.notes)
    assert _largest_difference(made, data) < 0.05
    written = profile_of_model(made.model, "sRGB").data
    assert _model(written).model.curves == (SrgbCurve(),) * 3


def test_channels_of_different_kinds_all_become_tables() -> None:
    data = profile(matrix_tags(curv(0x0240), SRGB, para(2, 2.0, 0.75, 0.125, 0.125)))
    made = _model(data)
    assert all(isinstance(each, TableCurve) for each in made.model.curves)
    assert _largest_difference(made, data) < 0.1


def test_light_of_code_0_is_the_models_black() -> None:
    made = _model(profile(matrix_tags(para(2, 2.0, 1.0, 0.0, 0.01), lumi=200.0)))
    black = made.model.xyz(np.zeros(3))
    np.testing.assert_allclose(black, 2.0 * D65, rtol=2e-3)
    assert not any("no light" in note for note in made.notes)


def test_white_is_as_bright_as_the_profile_or_the_caller_says() -> None:
    curves = para(0, 2.2)
    np.testing.assert_allclose(
        _model(profile(matrix_tags(curves, lumi=143.0))).model.white_XYZ_cd_m2, 143 * D65, rtol=1e-3
    )
    np.testing.assert_allclose(
        _model(profile(matrix_tags(curves, lumi=143.0)), 80.0).model.white_XYZ_cd_m2[1], 80, rtol=1e-3
    )
    with pytest.raises(DeviceError, match=r"no tag 'lumi'.*--white-cd-m2"):
        _model(profile(matrix_tags(curves, lumi=None)))
    with pytest.raises(DeviceError, match="no tag 'lumi'"):
        _model(profile(matrix_tags(curves, lumi=0.0)))
    with pytest.raises(DeviceError, match="a number above 0"):
        _model(profile(matrix_tags(curves)), -3.0)


def test_a_profile_of_version_2_is_absolute_by_its_white_point() -> None:
    tags = matrix_tags(para(0, 2.2))
    del tags["chad"]
    tags["wtpt"] = xyz(*D65)
    white = _model(profile(tags, version=2)).model.white_XYZ_cd_m2
    np.testing.assert_allclose(white, 100 * D65, rtol=1e-3)
    tags["wtpt"] = xyz(*D50)
    made = _model(profile(tags, version=2))
    np.testing.assert_allclose(made.model.white_XYZ_cd_m2, np.multiply(100, D50), rtol=1e-3)
    assert any("taken for D50" in note for note in made.notes)


def test_the_black_point_lies_beneath_the_light_of_the_curves() -> None:
    tags = matrix_tags(para(0, 2.2))
    tags["bkpt"] = xyz(0.002, 0.002, 0.003)
    made = _model(profile(tags, version=2))
    np.testing.assert_allclose(made.model.black_XYZ_cd_m2, [0.2, 0.2, 0.3], atol=2e-3)
    np.testing.assert_allclose(made.model.white_XYZ_cd_m2[1], 100.0, rtol=1e-4)
    assert any("'bkpt'" in note for note in made.notes)


def test_the_black_point_is_not_added_to_curves_that_have_it() -> None:
    tags = matrix_tags(para(2, 2.2, 0.998, 0.0, 0.002))
    without = _model(profile(tags, version=2)).model
    tags["bkpt"] = xyz(0.002, 0.002, 0.003)
    made = _model(profile(tags, version=2))
    np.testing.assert_allclose(made.model.xyz(np.zeros(3)), without.xyz(np.zeros(3)))
    assert not any("'bkpt'" in note for note in made.notes)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"gTRC": curv(*range(65535, -1, -257))}, "'gTRC' falls by 1e\\+02 %"),
        ({"gTRC": curv(30000, 30000, 30000)}, "'gTRC' rises from 0.458 to 0.458"),
        ({"gTRC": xyz(1, 1, 1)}, "type 'XYZ '"),
        ({"gXYZ": xyz(0.436, 0.2225, 0.0139)}, "do not span"),
        ({"gXYZ": curv()}, "'gXYZ' is of the type 'curv'"),
        ({"chad": b"sf32\0\0\0\0" + b"\0" * 36}, "'chad' is no chromatic adaptation: 0 0 0"),
        ({"chad": curv()}, "'chad' is of the type 'curv'"),
        ({"gTRC": None}, "has rXYZ, gXYZ, bXYZ, rTRC, bTRC but not gTRC"),
        (dict.fromkeys(("rXYZ", "gXYZ", "bXYZ", "rTRC", "gTRC", "bTRC")), "does not say what light a code gives"),
    ],
)
def test_what_gives_no_model_is_refused_in_one_line(change: dict[str, bytes | None], words: str) -> None:
    tags = {name: data for name, data in (matrix_tags(para(0, 2.2)) | change).items() if data is not None}
    with pytest.raises(DeviceError, match=words) as caught:
        _model(profile(tags))
    assert len(caught.value.findings) == 1
    assert str(caught.value).startswith("display.icc: ")


def test_small_steps_back_become_flat() -> None:
    values = np.linspace(0, 1, 256) ** 2.2
    values[100] = values[101] + 0.001
    table, off = tabled_curve(SampledCurve(values))
    assert np.all(np.diff(table.light) > 0)
    assert off < 0.01


def test_the_gamma_table_of_a_profile_is_named(tmp_path: Path) -> None:
    from tests.devices.profiles.profile_bytes import vcgt

    path = tmp_path / "display.icc"
    path.write_bytes(profile(matrix_tags(para(0, 2.2)) | {"vcgt": vcgt(1, 2, [0, 20000, 60000])}))
    made = model_of_profile(read_profile(path))
    assert any("'vcgt'" in note and "while that table is loaded" in note for note in made.notes)
