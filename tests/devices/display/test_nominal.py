"""Nominal displays, the room's light, and viewing geometry."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from colour import RGB_COLOURSPACES, RGB_to_XYZ
from colour.contrast import (
    contrast_sensitivity_function_Barten1999,
    pupil_diameter_Barten1999,
    retinal_illuminance_Barten1999,
    sigma_Barten1999,
)
from hypothesis import given
from hypothesis import strategies as st

from devices.colour import srgb_decoded
from devices.compensation import cancel_crosstalk
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.display import (
    Crosstalk,
    DisplayModel,
    EyeModels,
    FinestDetail,
    GainMap,
    Nominal,
    PanelSpec,
    Plvc,
    ReportedMonitor,
    TableCurve,
    ToneCurve,
    contrast_sensitivity,
    disparity_arcmin,
    finest_visible,
    minimum_resolution,
    mm_from_px,
    nyquist_resolution,
    panel_of_monitor,
    pixels_per_degree,
    px_from_mm,
    read_display,
    read_rig,
    size_mm,
    visible,
    visual_angle_deg,
)
from devices.errors import DeviceError
from documents import InputError

# Nominal displays in rig files and display files: what they say, what they refuse, and whose panel they take.

PANEL = "panel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.2768}"
DP = ReportedMonitor("DP-1", (1920, 1080), (531, 299), 59.95)


def _rig(folder: Path, display: str, mode: str = "side-by-side", more: str = "") -> Path:
    file = folder / "rig.yaml"
    file.write_text(f"schema_version: 1\ndisplay: {display}\nmode: {mode}\ndistance_mm: 700\n{more}")
    return file


def test_a_rig_names_a_nominal_display_in_place_of_a_file(tmp_path: Path) -> None:
    rig = read_rig(_rig(tmp_path, f"{{nominal: srgb, white_cd_m2: 120, {PANEL}}}", "checkerboard"))
    assert rig.nominal == Nominal("srgb", 120.0, 0.12, black_assumed=True)
    assert rig.stamps == {"nominal": "srgb"}
    assert not rig.is_characterised
    assert rig.display.panel.resolution_px == (1920, 1080)
    assert "black 0.12 cd/m² (assumed)" in rig.nominal.words
    assert rig.display.source("checkerboard") == f"nominal, not measured: {rig.nominal.words}"
    assert "cyclopean display measure" in rig.nominal.remark
    stated = read_rig(_rig(tmp_path, f"{{nominal: srgb, white_cd_m2: 120, black_cd_m2: 0.3, {PANEL}}}"))
    assert stated.nominal is not None
    assert "black 0.3 cd/m²" in stated.nominal.words
    assert "assumed" not in stated.nominal.words


@pytest.mark.parametrize(("kind", "space"), [("srgb", "sRGB"), ("display-p3", "Display P3")])
def test_codes_give_the_light_of_the_standard(kind: str, space: str, tmp_path: Path) -> None:
    model = read_rig(_rig(tmp_path, f"{{nominal: {kind}, white_cd_m2: 80, {PANEL}}}")).models.left
    codes = np.random.default_rng(1).random((50, 3))
    standard = RGB_COLOURSPACES[space]
    expected = 80.0 * np.asarray(RGB_to_XYZ(srgb_decoded(codes), standard, apply_cctf_decoding=False))
    assert np.abs(model.xyz(codes) - expected).max() < 0.02  # the standards print matrices of four digits
    assert model.shown_white_XYZ_cd_m2[1] == pytest.approx(80.0, abs=1e-9)
    assert model.shown_black_XYZ_cd_m2.tolist() == [0.0, 0.0, 0.0]


def test_the_curves_of_gamma_and_bt1886(tmp_path: Path) -> None:
    gamma = read_rig(_rig(tmp_path, f"{{nominal: gamma2.2, white_cd_m2: 100, {PANEL}}}")).models.left
    assert gamma.xyz([0.5] * 3)[1] == pytest.approx(100 * 0.5**2.2)
    spec = f"{{nominal: bt1886, white_cd_m2: 100, black_cd_m2: 0.1, {PANEL}}}"
    rig = read_rig(_rig(tmp_path, spec))
    assert rig.nominal is not None
    # What an instrument would read: a·(V + b)^2.4 of ITU-R BT.1886, Annex 1.
    span = 100 ** (1 / 2.4) - 0.1 ** (1 / 2.4)
    b = 0.1 ** (1 / 2.4) / span
    for code in (0.0, 0.1, 0.5, 1.0):
        seen = rig.nominal.light_model().xyz([code] * 3)
        assert seen[1] == pytest.approx((span**2.4) * (code + b) ** 2.4)


def test_black_adds_to_what_is_seen_and_is_never_corrected_for(tmp_path: Path) -> None:
    rigs = [
        read_rig(_rig(tmp_path, f"{{nominal: srgb, white_cd_m2: 100, black_cd_m2: {black}, {PANEL}}}"))
        for black in (0.0, 5.0)
    ]
    colours = np.random.default_rng(2).random((20, 3))
    one, other = (rig.models.left for rig in rigs)
    assert np.array_equal(one.code(one.xyz(colours)), other.code(other.xyz(colours)))
    nominal = rigs[1].nominal
    assert nominal is not None
    light = nominal.light_model()
    assert (light.shown_black_XYZ_cd_m2[1], light.shown_white_XYZ_cd_m2[1]) == pytest.approx((5.0, 100.0))
    # As stated in decision 0022: light = black + (1 - black / white) * XYZ of the picture.
    expected = nominal.black_XYZ_cd_m2 + 0.95 * other.xyz(colours)
    assert np.abs(light.xyz(colours) - expected).max() < 1e-9


def test_the_panel_comes_from_the_monitor_and_says_so(tmp_path: Path) -> None:
    file = _rig(tmp_path, "{nominal: srgb, white_cd_m2: 100}")
    rig = read_rig(file, ask_monitor=lambda _: DP)
    panel = rig.display.panel
    assert panel.resolution_px == (1920, 1080)
    assert panel.pixel_pitch_mm == pytest.approx(531 / 1920, rel=2e-3)
    assert panel.refresh_hz == 59.95
    assert rig.nominal is not None
    assert "panel from the monitor 'DP-1', 531 x 299 mm" in rig.nominal.words
    known = PanelSpec(resolution_px=(800, 600), pixel_pitch_mm=0.3)
    assert read_rig(file, ask_monitor=lambda _: known).display.panel is known
    for ask in (None, lambda _: None):
        with pytest.raises(InputError, match=r"rig.yaml:2:10.*panel: \{resolution_px: \[1920, 1080\]"):
            read_rig(file, ask_monitor=ask)


@pytest.mark.parametrize(
    ("size_px", "size_mm", "reason"),
    [
        ((1920, 1080), (0, 0), "its size is not known"),
        ((1920, 1080), (530, 0), "its size is not known"),
        ((1920, 1080), (160, 90), "that is a shape"),
        ((1080, 1920), (90, 160), "that is a shape"),
        ((1920, 1080), (1600, 900), "that is a shape"),
        ((1920, 1080), (508, 286), "what systems suppose"),
        ((3840, 2160), (1016, 571), "what systems suppose"),
        ((1280, 1024), (531, 299), "would not be square"),
        ((1920, 1080), (19, 11), None),
        ((1920, 1080), (19200, 10800), "pixels would be 10 mm apart"),
        ((0, 0), (531, 299), "it shows no pixels"),
    ],
)
def test_a_size_that_is_nonsense_is_refused_with_what_to_write(
    size_px: tuple[int, int], size_mm: tuple[int, int], reason: str | None
) -> None:
    monitor = ReportedMonitor("HDMI-1", size_px, size_mm)
    if reason is None:
        assert panel_of_monitor(monitor).resolution_px == size_px
        return
    with pytest.raises(InputError, match=reason) as refused:
        panel_of_monitor(monitor)
    assert "HDMI-1" in str(refused.value)
    assert "pixel_pitch_mm" in str(refused.value)


@pytest.mark.parametrize(
    ("size_px", "size_mm"),
    [((1920, 1080), (531, 299)), ((1080, 1920), (299, 531)), ((2560, 1600), (286, 179)), ((1920, 1080), (1872, 1053))],
)
def test_sizes_of_real_monitors_are_taken(size_px: tuple[int, int], size_mm: tuple[int, int]) -> None:
    panel = panel_of_monitor(ReportedMonitor("m", size_px, size_mm))
    assert panel.pixel_pitch_mm == pytest.approx(size_mm[0] / size_px[0], rel=0.005)
    assert panel.refresh_hz == 60.0


@pytest.mark.parametrize(
    ("display", "words"),
    [
        ("{nominal: sgrb, white_cd_m2: 100}", "did you mean 'srgb'"),
        ("{nominal: srgb}", "'display.white_cd_m2' is missing"),
        ("{nominal: srgb, white_cd_m2: 0}", "white_cd_m2"),
        ("{nominal: srgb, white_cd_m2: 100, black_cd_m2: 100}", "must be below white_cd_m2"),
        ("{nominal: srgb, white_cd_m2: 100, black_cd_m2: -1}", "black_cd_m2"),
        ("{nominal: srgb, white: 100}", "unknown key 'display.white'"),
    ],
)
def test_wrong_keys_are_named_with_their_place(display: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"rig.yaml:2") as refused:
        read_rig(_rig(tmp_path, display))
    assert words in str(refused.value)


def test_another_observer_than_that_of_the_standards_is_refused(tmp_path: Path) -> None:
    file = _rig(tmp_path, f"{{nominal: srgb, white_cd_m2: 100, {PANEL}}}", more="observer: CIE 1964 10\n")
    with pytest.raises(InputError, match="its display in this mode for CIE 1931 2"):
        read_rig(file)


def test_the_rigs_room_light_is_taken_off_as_on_any_display(tmp_path: Path) -> None:
    display = f"{{nominal: srgb, white_cd_m2: 100, {PANEL}}}"
    model = read_rig(_rig(tmp_path, display, more="ambient_XYZ_cd_m2: [0.5, 0.5, 0.5]\n")).models.left
    assert model.shown_black_XYZ_cd_m2.tolist() == [0.5, 0.5, 0.5]


def _display(folder: Path, text: str) -> Path:
    file = folder / "display.yaml"
    file.write_text(f"schema_version: 1\n{PANEL}\n{text}")
    return file


def test_a_display_file_may_be_nominal_and_stays_so_in_modes_that_were_not_measured(tmp_path: Path) -> None:
    measured = (
        "modes:\n  flat:\n    black_XYZ_cd_m2: [0, 0, 0]\n"
        "    primaries_XYZ_cd_m2: {red: [41, 21, 2], green: [36, 72, 12], blue: [18, 7, 95]}\n"
        "    curve: {kind: srgb}\n    source: measured today\n"
    )
    _display(tmp_path, f"nominal: srgb\nwhite_cd_m2: 100\n{measured}")
    display = read_display(tmp_path / "display.yaml")
    assert display.nominal_in("flat") is None
    assert display.source("flat") == "measured today"
    assert display.nominal_in("side-by-side") == display.nominal
    assert display.models("side-by-side").left.shown_white_XYZ_cd_m2[1] == pytest.approx(100.0)
    assert read_rig(_rig(tmp_path, "display.yaml", "flat")).stamps == {}
    assert read_rig(_rig(tmp_path, "display.yaml", "top-bottom")).stamps == {"nominal": "srgb"}
    # What is nominal needs no permission, and borrows no other mode's measurements.
    allowed = read_rig(_rig(tmp_path, "display.yaml", "top-bottom"), allow_uncharacterised=True)
    assert allowed.characterised_as == "top-bottom"
    with pytest.raises(InputError, match="flat, any other, nominal"):
        display.only_mode()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "needs 'modes:' that were measured, or 'nominal: srgb'"),
        ("modes: {}\n", "needs 'modes:' that were measured, or 'nominal: srgb'"),
        ("nominal: srgb\n", "add 'white_cd_m2: 100'"),
        ("nominal: srgb\nwhite_cd_m2: 1\nblack_cd_m2: 2\n", "must be below white_cd_m2"),
        ("white_cd_m2: 100\nmodes: {flat: {same_as: flat}}\n", "add 'nominal: srgb'"),
    ],
)
def test_a_display_file_without_modes_must_be_nominal(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        read_display(_display(tmp_path, text))
    assert words in str(refused.value)


def test_a_panel_in_a_line_has_60_hz_and_8_bits_where_they_are_not_said() -> None:
    short = PanelSpec.parse("1920x1080,0.2768")
    assert (short.refresh_hz, short.bits, short.text) == (60.0, 8, "1920x1080,0.2768,60,8")
    assert PanelSpec.parse("1920x1080,0.2768,120,10").bits == 10


# The room's light: a term of its own in the forward model, in files, and in what is asked of the display.

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


def _ambient_display(tmp_path: Path, modes: str, room: str = "") -> Path:
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
    display = read_display(_ambient_display(tmp_path, modes, "ambient_XYZ_cd_m2: [0.1, 0.2, 0.3]\n"))
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
        read_display(_ambient_display(tmp_path, f"  flat: {MODEL % ''}\n", "ambient_XYZ_cd_m2: [0.1, -1, 0.3]\n"))


def test_a_rig_s_own_word_goes_before_the_display_file_s(tmp_path: Path) -> None:
    _ambient_display(tmp_path, f"  flat: {MODEL % ''}\n", "ambient_XYZ_cd_m2: [0.1, 0.2, 0.3]\n")
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


# Viewing geometry against the thesis's own figures and against plain trigonometry.
#
# Contrast sensitivity: against colour-science's Barten 1999, and what must be true at any light.

positive = st.floats(0.01, 1e5)


def test_the_letters_and_strokes_of_the_snellen_chart() -> None:
    assert float(size_mm(5 / 60, 6096)) == pytest.approx(8.866, abs=2e-3)  # 20 feet; the thesis's 8.86 mm
    assert float(size_mm(1 / 60, 6000)) == pytest.approx(1.745, abs=1e-3)
    assert float(visual_angle_deg(1.7453, 6000)) * 60 == pytest.approx(1.0, abs=1e-4)


def test_the_plate_on_the_rig() -> None:
    angle = float(visual_angle_deg(150, 700))
    assert angle == pytest.approx(12.2310, abs=1e-4)
    assert float(minimum_resolution(angle)) == pytest.approx(733.86, abs=0.01)
    assert float(nyquist_resolution(angle)) == pytest.approx(1467.7, abs=0.1)
    assert pixels_per_degree(0.2768, 700) == pytest.approx(44.139, abs=1e-3)
    assert float(px_from_mm(150, 0.2768)) == pytest.approx(541.908, abs=1e-3)


def test_disparity_is_small_angle_parallax_over_distance() -> None:
    one = float(disparity_arcmin(1, 0.2768, 700))
    assert one == pytest.approx(math.degrees(0.2768 / 700) * 60, rel=3e-3)
    assert float(disparity_arcmin(0, 0.2768, 700)) == 0.0
    assert float(disparity_arcmin(-1, 0.2768, 700)) < 0 < one


def test_parallax_of_the_eyes_distance_is_infinity() -> None:
    whole = float(disparity_arcmin(65.0, 1.0, 700, 65.0))
    assert whole == pytest.approx(60 * 2 * math.degrees(math.atan(32.5 / 700)))


@given(st.floats(-1e6, 1e6), positive)
def test_pixels_and_millimetres_undo_each_other(length: float, pitch: float) -> None:
    assert float(px_from_mm(mm_from_px(length, pitch), pitch)) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_distance_or_pitch_that_cannot_be_is_refused(value: float) -> None:
    with pytest.raises(DeviceError, match="distance_mm"):
        visual_angle_deg(1, value)
    with pytest.raises(DeviceError, match="distance_mm"):
        size_mm(1, value)
    with pytest.raises(DeviceError, match="pixel_pitch_mm"):
        pixels_per_degree(value, 700)
    with pytest.raises(DeviceError, match="interpupillary_distance_mm"):
        disparity_arcmin(1, 0.3, 700, value)


@pytest.mark.parametrize("luminance", [0.01, 1.0, 100.0, 1000.0])
@pytest.mark.parametrize("field", [0.5, 10.0, 60.0])
def test_against_colour_science(luminance: float, field: float) -> None:
    frequencies = np.geomspace(0.1, 60.0, 40)
    pupil = pupil_diameter_Barten1999(luminance, field, field)
    theirs = contrast_sensitivity_function_Barten1999(
        frequencies,
        sigma=sigma_Barten1999(0.5 / 60, 0.08 / 60, pupil),
        X_0=field,
        E=retinal_illuminance_Barten1999(luminance, pupil, True),
    )
    np.testing.assert_allclose(contrast_sensitivity(frequencies, luminance, field), theirs, rtol=1e-12)


@given(st.floats(0.01, 5000.0), st.floats(0.2, 50.0))
def test_more_light_and_two_eyes_see_more(luminance: float, frequency: float) -> None:
    one = float(contrast_sensitivity(frequency, luminance, 5.0))
    assert float(contrast_sensitivity(frequency, 2 * luminance, 5.0)) > one
    assert float(contrast_sensitivity(frequency, luminance, 5.0, eyes=1)) == pytest.approx(one / np.sqrt(2), rel=1e-12)


@pytest.mark.parametrize("luminance", [0.05, 20.0, 300.0])
def test_the_finest_visible_is_where_the_sensitivity_crosses(luminance: float) -> None:
    for contrast in (0.02, 0.3, 1.0):
        finest = finest_visible(luminance, contrast)
        # The search ends within 2^-40 of a step.
        assert contrast * float(contrast_sensitivity(finest, luminance)) == pytest.approx(1.0, abs=1e-6)
        assert visible(contrast, 0.99 * finest, luminance)
        assert not visible(contrast, 1.01 * finest, luminance)
    assert finest_visible(luminance, 1e-5) == 0.0


def test_the_sentences_both_ways() -> None:
    near, far = FinestDetail.of(44.0, 130.0), FinestDetail.of(160.0, 130.0)
    assert "(22 cycles per degree)" in near.sentences()[0]
    assert near.sentences()[1].endswith("in lines 2 pixels wide or more")
    assert far.sentences()[0].endswith("too fine to be seen at any contrast")
    assert FinestDetail.of(18.0, 130.0).sentences()[1].endswith("down to one pixel")


def test_wrong_input() -> None:
    with pytest.raises(DeviceError, match="is 0 cycles per degree"):
        contrast_sensitivity([1.0, 0.0], 100.0)
    with pytest.raises(DeviceError, match="luminance is -3 cd/m²"):
        contrast_sensitivity(1.0, -3.0)
    with pytest.raises(DeviceError, match="field is inf degrees"):
        contrast_sensitivity(1.0, 1.0, np.inf)
    with pytest.raises(DeviceError, match="3 eyes"):
        contrast_sensitivity(1.0, 1.0, eyes=3)
    with pytest.raises(DeviceError, match="0 to 1"):
        visible(1.5, 1.0, 100.0)
