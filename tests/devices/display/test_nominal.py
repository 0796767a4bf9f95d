"""Nominal displays in rig files and display files: what they say, what they refuse, and whose panel they take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from colour import RGB_COLOURSPACES, RGB_to_XYZ

from devices.colour import srgb_decoded
from devices.display import Nominal, PanelSpec, ReportedMonitor, panel_of_monitor, read_display, read_rig
from documents import InputError

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


def test_taking_a_guessed_black_off_would_change_the_codes_of_an_sRGB_picture(tmp_path: Path) -> None:
    """As docs/decisions/0022 states: that is why a nominal display's black is not part of the model."""
    nominal = Nominal.of("srgb", 100.0)
    codes = np.repeat(np.arange(256)[:, np.newaxis], 3, axis=1)
    picture = nominal.model().xyz(codes / 255.0)
    taken_off = np.rint(255.0 * nominal.light_model().code(picture))
    assert np.flatnonzero((taken_off != codes).any(axis=1)).tolist() == list(range(1, 75))
    assert np.array_equal(np.rint(255.0 * nominal.model().code(picture)), codes)


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
