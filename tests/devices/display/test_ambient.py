"""The room's light: a term of its own in the forward model, in files, and in what is asked of the display."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.compensation import cancel_crosstalk
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.display import (
    Crosstalk,
    DisplayModel,
    EyeModels,
    GainMap,
    Plvc,
    TableCurve,
    ToneCurve,
    read_display,
    read_rig,
)
from devices.errors import DeviceError
from documents import InputError

BLACK = np.array([0.05, 0.06, 0.08])
PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])
CURVES = (ToneCurve(0.98, 0.02, 2.1), ToneCurve(1.0, 0.0, 2.3), ToneCurve(0.95, 0.05, 1.9))
DARK = DisplayModel(BLACK, PRIMARIES, CURVES)
AMBIENT = np.array([0.9, 1.0, 0.8])
lights = st.tuples(st.floats(0.0, 3.0), st.floats(0.0, 3.0), st.floats(0.0, 3.0))
codes = st.lists(st.floats(0.05, 0.95), min_size=3, max_size=3)


@given(lights, codes)
def test_it_is_added_to_the_light_and_taken_off_what_is_asked(
    ambient: tuple[float, float, float], code: list[float]
) -> None:
    lit = DARK.in_room(ambient)
    assert lit.xyz(code) == pytest.approx(DARK.xyz(code) + np.array(ambient), abs=1e-12)
    assert np.abs(lit.code(DARK.xyz(code) + np.array(ambient)) - code).max() < 1e-9
    assert lit.black_XYZ_cd_m2 == pytest.approx(BLACK)
    assert lit.normalised.ambient_XYZ_cd_m2 == pytest.approx(np.array(ambient))
    assert np.abs(lit.normalised.xyz(code) - lit.xyz(code)).max() < 1e-9


def test_light_below_that_of_the_room_cannot_be_shown() -> None:
    lit = DARK.in_room(AMBIENT)
    assert lit.clipping(DARK.shown_black_XYZ_cd_m2).any_channel == 1
    assert lit.clipping(lit.shown_black_XYZ_cd_m2).any_channel == 0
    assert lit.shown_black_XYZ_cd_m2 == pytest.approx(DARK.shown_black_XYZ_cd_m2 + AMBIENT)
    assert lit.shown_white_XYZ_cd_m2 == pytest.approx(DARK.shown_white_XYZ_cd_m2 + AMBIENT)


def test_contrast_with_and_without_the_room() -> None:
    lit = DARK.in_room(AMBIENT)
    assert lit.contrast(in_the_room=False) == pytest.approx(DARK.contrast())
    white, black = DARK.shown_white_XYZ_cd_m2[1], DARK.shown_black_XYZ_cd_m2[1]
    assert lit.contrast() == pytest.approx((white + 1.0) / (black + 1.0))
    assert DisplayModel(np.zeros(3), PRIMARIES, (ToneCurve(gamma=2),) * 3).contrast() == np.inf


def test_it_does_not_leak() -> None:
    """Both eyes get the room's light by themselves; what leaks is the display's."""
    leaks = Crosstalk(0.05 * np.eye(3), 0.03 * np.eye(3))
    models = EyeModels(DARK.in_room(AMBIENT), DARK.in_room(0.8 * AMBIENT))
    zero = np.zeros((1, 3))
    left, right = seen_XYZ(models, leaks, zero, zero)
    assert left[0] == pytest.approx(models.left.shown_black_XYZ_cd_m2)
    assert right[0] == pytest.approx(models.right.shown_black_XYZ_cd_m2)
    asked = [model.xyz([[0.5, 0.6, 0.7], [0.8, 0.4, 0.6]]) for model in (models.left, models.right)]
    done = cancel_crosstalk(models, leaks, asked[0], asked[1])
    sent = [model.code(model.xyz_of_linear(light)) for model, light in
            ((models.left, done.left_linear), (models.right, done.right_linear))]  # fmt: skip
    seen = seen_XYZ(models, leaks, sent[0], sent[1])
    assert np.abs(np.array(seen) - np.array(asked)).max() < 1e-9
    # What is sent is what would be sent in the dark for as much less.
    dark = cancel_crosstalk(EyeModels(DARK, DARK), leaks, asked[0] - AMBIENT, asked[1] - 0.8 * AMBIENT)
    assert dark.left_linear == pytest.approx(done.left_linear, abs=1e-12)


@pytest.mark.parametrize("normalise", ["minimum", "centre"])
def test_no_gain_map_dims_it(normalise: str) -> None:
    # `normalise` is one of two names, given as plain text by parametrize.
    gain_map = GainMap(np.array([[0.7, 0.9], [0.8, 1.1]]), (30, 40), "corners", normalise)  # type: ignore[arg-type]
    lit, gain = DARK.in_room(AMBIENT), gain_map.over(np.arange(30) + 0.5, np.arange(40) + 0.5)
    asked = np.broadcast_to(lit.xyz([0.5, 0.6, 0.7]), (40, 30, 3))
    sent = gain_map.corrected(asked, gain, lit.ambient_XYZ_cd_m2)
    seen = AMBIENT + gain[..., None] * (lit.xyz(lit.code(sent)) - AMBIENT)
    assert np.abs(seen - (AMBIENT + gain_map.delivered_share * (asked - AMBIENT))).max() < 1e-9


def test_a_display_whose_channels_act_on_each_other_has_it_too() -> None:
    table = TableCurve((0.0, 0.3, 1.0), (0.0, 0.07, 1.0))
    own = np.tile(PRIMARIES.T[:, np.newaxis], (1, 4, 1))
    mixtures = np.zeros((10, 3))
    mixtures[0] = -0.5
    dark = Plvc(BLACK, PRIMARIES, (table, table, table), own, mixtures)
    lit = dark.in_room(AMBIENT)
    assert isinstance(lit, Plvc)
    assert lit.xyz([0.5, 0.6, 0.7]) == pytest.approx(dark.xyz([0.5, 0.6, 0.7]) + AMBIENT)
    assert lit.code(lit.xyz([0.5, 0.6, 0.7])) == pytest.approx([0.5, 0.6, 0.7], abs=1e-9)


@pytest.mark.parametrize("wrong", [[-0.1, 0, 0], [np.nan, 0, 0], [1.0, 1.0]])
def test_what_is_no_light_is_refused(wrong: list[float]) -> None:
    with pytest.raises(DeviceError, match="three finite numbers of at least 0"):
        DARK.in_room(wrong)


MODEL = (
    "{black_XYZ_cd_m2: [0, 0, 0], primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]}, "
    "curve: {kind: gamma, red: {gamma: 2}, green: {gamma: 2}, blue: {gamma: 2}}%s}"
)


def _display(tmp_path: Path, modes: str, room: str = "") -> Path:
    path = tmp_path / "d.yaml"
    panel = "panel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}"
    path.write_text(f"schema_version: 1\n{panel}\n{room}modes:\n{modes}")
    return path


def test_a_display_file_has_it_for_all_modes_or_for_one_or_an_eye(tmp_path: Path) -> None:
    own, per_eye = ", ambient_XYZ_cd_m2: [0.3, 0.4, 0.5]", ", ambient_XYZ_cd_m2: [0, 0, 0]"
    modes = (
        f"  flat: {MODEL % ''}\n  side-by-side: {MODEL % own}\n"
        f"  top-bottom: {{left: {MODEL % per_eye}, right: {MODEL % ''}}}\n  anaglyph: {{same_as: side-by-side}}\n"
    )
    display = read_display(_display(tmp_path, modes, "ambient_XYZ_cd_m2: [0.1, 0.2, 0.3]\n"))
    flat = display.models("flat")
    assert flat.left is flat.right
    assert flat.left.ambient_XYZ_cd_m2.tolist() == [0.1, 0.2, 0.3]
    assert flat.left.black_XYZ_cd_m2.tolist() == [0, 0, 0]
    for mode in ("side-by-side", "anaglyph"):
        assert display.models(mode).left.ambient_XYZ_cd_m2.tolist() == [0.3, 0.4, 0.5]
    split = display.models("top-bottom")
    assert split.left.ambient_XYZ_cd_m2.tolist() == [0, 0, 0]
    assert split.right.ambient_XYZ_cd_m2.tolist() == [0.1, 0.2, 0.3]
    with pytest.raises(InputError, match=r"ambient_XYZ_cd_m2.2' is -1"):
        read_display(_display(tmp_path, f"  flat: {MODEL % ''}\n", "ambient_XYZ_cd_m2: [0.1, -1, 0.3]\n"))


def test_a_rig_s_own_word_goes_before_the_display_file_s(tmp_path: Path) -> None:
    _display(tmp_path, f"  flat: {MODEL % ''}\n", "ambient_XYZ_cd_m2: [0.1, 0.2, 0.3]\n")
    rig = tmp_path / "rig.yaml"
    rig.write_text("schema_version: 1\ndisplay: d.yaml\nmode: flat\ndistance_mm: 700\n")
    assert read_rig(rig).models.left.ambient_XYZ_cd_m2.tolist() == [0.1, 0.2, 0.3]
    rig.write_text(rig.read_text() + "ambient_XYZ_cd_m2: [1, 2, 3]\n")
    models = read_rig(rig).models
    assert models.left is models.right
    assert models.left.ambient_XYZ_cd_m2.tolist() == [1, 2, 3]
    rig.write_text(rig.read_text().replace("[1, 2, 3]", "{left: [1, 2, 3], right: [0.5, 1, 1.5]}"))
    models = read_rig(rig).models
    assert models.right.ambient_XYZ_cd_m2.tolist() == [0.5, 1, 1.5]
    assert models.left.white_XYZ_cd_m2.tolist() == [10, 12, 13]
