"""Profiles of display models, read back by LittleCMS; `.cube` tables, by OpenColorIO; tables of colours."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings

from devices.characterise import thesis_display
from devices.colour import delta_e_2000, rgb_to_xyz_matrix, xyz_to_lab
from devices.display import DisplayModel, GammaTable, Plvc, TableCurve, ToneCurve
from devices.errors import DeviceError
from devices.profiles import IccProfile, model_of_profile, read_profile
from devices.profiles.colour_table import between
from devices.profiles.profile import profile_of
from devices.profiles.tag_table import parse_profile_file
from devices.readings import Measurements
from devices.readings.ti3 import write_ti3
from extensions.profiles import (
    CubeInput,
    WrittenProfile,
    convert_colours,
    cube_of_model,
    profile_of_model,
    write_cube,
    write_profile,
)
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import (
    displays,
    plvc_display,
)
from tests.kept import known

# Profiles of display models: LittleCMS gives the model's light, and they are read back as the model.

WRITE_CODES = np.concatenate(
    [np.random.default_rng(1).random((1500, 3)) ** 1.5, np.zeros((1, 3)), np.eye(3), np.ones((1, 3))]
)


def _tags(made: WrittenProfile) -> IccProfile:
    return profile_of(parse_profile_file(made.data, "made.icc"))


def _numbers(made: WrittenProfile, name: str, at: int = 8) -> np.ndarray:
    """Return the numbers of a tag by a reading of its own."""
    data = made.data
    table = {data[i : i + 4]: data[i + 4 : i + 12] for i in range(132, 132 + 12 * int.from_bytes(data[128:132]), 12)}
    offset, size = (int.from_bytes(table[name.encode()][i : i + 4]) for i in (0, 4))
    return np.frombuffer(data[offset + at : offset + size], ">i4") / 65536


def _off(made: WrittenProfile, model: DisplayModel) -> tuple[np.ndarray, np.ndarray]:
    """Return ΔE00 of light by LittleCMS, and of the light of the codes that it finds for the light."""
    to_pcs = _numbers(made, "chad").reshape(3, 3)
    luminance = _numbers(made, "lumi")[1]
    white = model.xyz(np.ones(3))
    wanted = model.xyz(WRITE_CODES)
    seen = luminance * through(made.data, WRITE_CODES) @ np.linalg.inv(to_pcs).T
    codes = through(made.data, wanted @ to_pcs.T / luminance, back=True)
    back = model.xyz(np.clip(codes, 0, 1))
    lab = xyz_to_lab(wanted, white)
    return delta_e_2000(xyz_to_lab(seen, white), lab), delta_e_2000(xyz_to_lab(back, white), lab)


@settings(max_examples=4, deadline=None)
@given(displays())
def test_any_additive_display_keeps_its_light_in_littlecms(model: DisplayModel) -> None:
    for made in (profile_of_model(model, "random"), profile_of_model(model, "random", kind="table", points=9)):
        off, back = _off(made, model)
        assert off.mean() <= 0.1
        assert off.max() <= 0.5
        assert back.mean() <= 0.1
        # What the profile says of itself is so.
        assert abs(made.mean - off.mean()) < 0.05


@pytest.mark.parametrize("kind", ["matrix", "table"])
@pytest.mark.parametrize("make", [thesis_display, lambda: plvc_display(0.0)], ids=["gog", "tables"])
def test_matrix_and_tables_are_both_exact(kind: str, make: Callable[[], DisplayModel]) -> None:
    model = make()
    if isinstance(model, Plvc):
        model = DisplayModel(model.black_XYZ_cd_m2, model.primaries_XYZ_cd_m2, model.curves)
    made = profile_of_model(model, "display", kind="matrix" if kind == "matrix" else "table")
    assert made.kind == kind
    for off in _off(made, model):
        assert off.mean() <= 0.02
        assert off.max() <= 0.15


def test_channels_that_act_on_each_other_get_a_table() -> None:
    model = plvc_display(0.15)
    made = profile_of_model(model, "display")
    assert made.kind == "table"
    off, back = _off(made, model)
    assert off.mean() <= 0.05
    assert off.max() <= 0.5
    assert back.mean() <= 0.1
    with pytest.raises(DeviceError, match="channels act on each other"):
        profile_of_model(model, "display", kind="matrix")


def test_black_that_is_no_mixture_of_the_primaries_gets_a_table() -> None:
    whole = thesis_display()
    model = DisplayModel(np.array([0.0, 0.0, 0.3]), whole.primaries_XYZ_cd_m2, whole.curves)
    made = profile_of_model(model, "display")
    assert made.kind == "table"
    assert _off(made, model)[0].max() <= 0.5
    with pytest.raises(DeviceError, match="black is no mixture"):
        profile_of_model(model, "display", kind="matrix")


def test_a_matrix_profile_is_read_back_as_the_model(tmp_path: Path) -> None:
    whole = thesis_display()
    model = DisplayModel(np.array([0.1, 0.1, 0.12]), whole.primaries_XYZ_cd_m2, whole.curves)
    made = write_profile(model, tmp_path / "d.icc", "display")
    assert made.kind == "matrix"
    back = model_of_profile(read_profile(tmp_path / "d.icc")).model
    assert all(isinstance(curve, ToneCurve) for curve in back.curves)
    np.testing.assert_allclose(back.xyz(WRITE_CODES), model.xyz(WRITE_CODES), atol=2e-3)


def test_header_white_luminance_and_name_are_those_of_version_4() -> None:
    model = thesis_display()
    data = profile_of_model(model, "Großer Bildschirm").data
    assert (data[8], data[12:24], data[36:40]) == (4, b"mntrRGB XYZ ", b"acsp")
    assert int.from_bytes(data[:4]) == len(data)
    assert "Großer Bildschirm".encode("utf-16-be") in data
    without = bytearray(data)
    without[44:48] = without[64:68] = b"\0\0\0\0"
    without[84:100] = b"\0" * 16
    assert data[84:100] == hashlib.md5(without, usedforsecurity=False).digest()
    made = profile_of_model(model, "x")
    white = model.xyz(np.ones(3))
    np.testing.assert_allclose(_tags(made).white, white / white[1], atol=1e-4)
    np.testing.assert_allclose(_tags(made).white_cd_m2(None), white[1], atol=1e-4)
    np.testing.assert_allclose(_numbers(made, "wtpt"), [0.9642, 1.0, 0.8249], atol=2e-5)


def test_a_gamma_table_goes_along_unless_it_changes_nothing() -> None:
    table = GammaTable.from_shares(np.linspace(0, 1, 256) ** 1.1)
    kept = known(_tags(profile_of_model(thesis_display(), "x", gamma_table=table)).gamma_table)
    assert kept.same_as(table)
    for nothing in (None, GammaTable.identity(), GammaTable.unreadable("Wayland")):
        assert _tags(profile_of_model(thesis_display(), "x", gamma_table=nothing)).gamma_table is None


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="66 points"):
        profile_of_model(thesis_display(), "x", points=66)
    with pytest.raises(DeviceError, match="cannot be written"):
        write_profile(thesis_display(), tmp_path / "none" / "d.icc", "x")
    for luminance in (0.1, 40000.0):
        whole = thesis_display()
        scale = luminance / whole.shown_white_XYZ_cd_m2[1]
        model = DisplayModel(whole.black_XYZ_cd_m2, scale * whole.primaries_XYZ_cd_m2, whole.curves)
        with pytest.raises(DeviceError, match=r"a profile holds 0.2 to 32767 cd/m²"):
            profile_of_model(model, "x")
    curve = TableCurve((0.0, 0.5, 1.0), (0.0, 0.2, 1.0))
    dark = DisplayModel(np.zeros(3), np.diag([1.0, -1.0, 1.0]), (curve, curve, curve))
    with pytest.raises(DeviceError, match="white"):
        profile_of_model(dark, "x")


# `.cube` tables, read here by the format's own rules.
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


@pytest.mark.parametrize("target", ["xyz", "code"])
def test_a_table_of_readings_gives_what_is_asked_from_the_other(tmp_path: Path, target: Literal["code", "xyz"]) -> None:
    model = thesis_display()
    codes = np.array([[0, 0, 0], [128, 30, 0], [200, 210, 220]]) / 255
    write_ti3(Measurements(codes, model.xyz(codes)), tmp_path / "d.ti3")
    converted = convert_colours(tmp_path / "d.ti3", model, target)
    assert converted.kind == target
    assert converted.values == pytest.approx(model.xyz(codes) if target == "xyz" else 255 * codes, abs=1e-3)


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


def test_a_table_of_another_observer_is_refused(tmp_path: Path) -> None:
    codes = np.array([[0, 0, 0], [128, 0, 0], [255, 255, 255]]) / 255
    other = Measurements(codes, thesis_display().xyz(codes), observer="CIE 1964 10")
    write_ti3(other, tmp_path / "d.ti3")
    with pytest.raises(DeviceError, match="XYZ for CIE 1964 10 without spectra"):
        convert_colours(tmp_path / "d.ti3", thesis_display(), "code")
    converted = convert_colours(tmp_path / "d.ti3", thesis_display(), "code", observer="CIE 1964 10")
    assert len(converted.values) == len(codes)
