"""Profiles of display models: LittleCMS gives the model's light, and they are read back as the model."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from devices.characterise import thesis_display
from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import DisplayModel, GammaTable, Plvc, Residual, TableCurve, ToneCurve
from devices.errors import DeviceError
from devices.profiles import Profile, WrittenProfile, model_of_profile, profile_of_model, read_profile, write_profile
from devices.profiles.profile import profile_of
from devices.profiles.tag_table import parse_profile_file
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import displays, plvc_display

CODES = np.concatenate(
    [np.random.default_rng(1).random((1500, 3)) ** 1.5, np.zeros((1, 3)), np.eye(3), np.ones((1, 3))]
)


def _tags(made: WrittenProfile) -> Profile:
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
    wanted = model.xyz(CODES)
    seen = luminance * through(made.data, CODES) @ np.linalg.inv(to_pcs).T
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


@pytest.mark.nightly
def test_a_smooth_residual_gets_a_table_too() -> None:
    rng = np.random.default_rng(2)
    residual = Residual(0.88 * rng.random((24, 3)), 0.6, rng.standard_normal((24, 3)))
    model = replace(plvc_display(0.05), residual=residual)
    made = profile_of_model(model, "display", points=25)
    codes = np.maximum(CODES, 0.1)
    luminance, to_pcs = _numbers(made, "lumi")[1], _numbers(made, "chad").reshape(3, 3)
    # Where the model gives light below 0, a profile holds none.
    relative = np.maximum(model.xyz(codes) @ to_pcs.T / luminance, 0.0)
    white = to_pcs @ model.xyz(np.ones(3)) / luminance
    off = delta_e_2000(xyz_to_lab(through(made.data, codes), white), xyz_to_lab(relative, white))
    assert off.mean() <= 0.1
    assert off.max() <= 0.5


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
    np.testing.assert_allclose(back.xyz(CODES), model.xyz(CODES), atol=2e-3)


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
    kept = _tags(profile_of_model(thesis_display(), "x", gamma_table=table)).gamma_table
    assert kept is not None
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
