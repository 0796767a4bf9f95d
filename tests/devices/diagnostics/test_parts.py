"""The parts of a display file that readings give, all checks at once, and gamuts in diagrams."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.characterise import table_c1_codes, thesis_display
from devices.colour_matching import colorimetric_observer
from devices.compensation import fit_crosstalk
from devices.diagnostics import MeasuredSet, PlotAxes, examine, locus_line
from devices.diagnostics.chromaticity_diagrams import LOCUS, uv_from_xy
from devices.diagnostics.colours import chromaticities, outside, primary_colours
from devices.diagnostics.eyewear import crosstalk, crosstalk_readings
from devices.diagnostics.gamut_and_model import gamut, gamut_change, gamuts
from devices.diagnostics.panel import uniformity
from devices.diagnostics.readings import tag, uv, xy
from devices.diagnostics.settling import settle
from devices.display import DisplayModel, EyeModels, read_display
from devices.errors import DeviceError
from devices.readings import Measurements, PatchEye, read_csv
from tests.devices.diagnostics.simulated import MODEL, characterisation, judged, readings
from tests.devices.diagnostics.simulated import crosstalk_readings as leaking
from tests.kept import known

# The parts of a display file that readings give, what names tell, and all checks at once.

FIGURE_3_7 = np.array([[0.0697, 0.1047, 0.0955], [0.1088, 0.1587, 0.1434], [0.1340, 0.1774, 0.1608]])
DISPLAY = """\
schema_version: 1
panel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.2768}
modes:
  quad-buffered:
    black_XYZ_cd_m2: [0.02, 0.021, 0.03]
    primaries_XYZ_cd_m2: {red: [10.83, 5.62, 0.54], green: [9.67, 18.65, 1.63], blue: [5.68, 2.20, 29.18]}
    curve: {kind: gamma, red: {gamma: 1.8132}, green: {gamma: 1.7649}, blue: {gamma: 1.7156}}
"""


def _grid(luminance: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Measurements:
    grey = np.full(3, 120 / 255)
    named = {
        f"gray120@r{row + 1}c{column + 1}": (grey, np.array([0.95, 1.0, 1.09]) * value)
        for (row, column), value in np.ndenumerate(luminance)
    }
    return readings(named, noise=0.0)


def _inside(part: str, folder: Path) -> Path:
    """A display file with ``part`` in its mode."""
    file = folder / "display.yaml"
    file.write_text(DISPLAY + "".join(f"    {line}\n" for line in part.splitlines()), encoding="utf-8")
    return file


def test_figure_3_7_is_uneven_by_56_percent(tmp_path: Path) -> None:
    assert uniformity(_grid(np.full((3, 3), 7.0))).passed is True
    found = judged(uniformity(_grid(FIGURE_3_7)), False)
    assert found.value == pytest.approx(56.1, abs=0.05)
    assert "-56.1 %" in found.words
    assert "+11.8 %" in found.words
    display = read_display(_inside(found.output, tmp_path))
    gain_map = known(display.gain_map("quad-buffered"))
    assert np.allclose(gain_map.luminance, FIGURE_3_7)


@pytest.mark.parametrize(("leaks", "passed"), [((0.02, 0.03), True), ((0.02, 0.08), False)])
def test_crosstalk_becomes_part_of_a_display_file(leaks: tuple[float, float], passed: bool, tmp_path: Path) -> None:
    found = judged(crosstalk(leaking({"left": leaks[0], "right": leaks[1]}, noise=0.0)), passed)
    assert found.value == pytest.approx(100 * leaks[1], abs=1e-6)
    display = read_display(_inside(found.output, tmp_path))
    read = known(display.crosstalk("quad-buffered"))
    assert np.allclose(read.left, leaks[0] * np.eye(3), atol=1e-6)
    assert np.allclose(read.right, leaks[1] * np.eye(3), atol=1e-6)


def test_crosstalk_readings_are_those_that_were_meant() -> None:
    table = leaking({"left": 0.02, "right": 0.03}, noise=0.0)
    assert len(crosstalk_readings(table)) == 18
    fit = fit_crosstalk(crosstalk_readings(table))
    assert (fit.left.kind, fit.right.kind) == ("full", "full")
    again = replace(table, name=tuple(f"{name}#2" for name in table.name))
    assert crosstalk_readings(again) == crosstalk_readings(table)
    assert crosstalk_readings(characterisation()) == ()
    nobody: tuple[PatchEye, ...] = tuple("both" for _ in table.eye)
    both = replace(table, eye=nobody)
    with pytest.raises(DeviceError, match="name the lens"):
        crosstalk_readings(both)
    lit = replace(table, codes=np.ones_like(table.codes))
    assert crosstalk(lit).passed is None
    assert "black is code 0" in crosstalk(lit).words


@pytest.mark.parametrize(
    ("name", "kind", "parts"),
    [
        ("gray120@r1c3", "place", ("1", "3")),
        ("White@-20deg", "angle", ("", "-20")),
        ("white@v10.5deg#3", "angle", ("v", "10.5")),
        ("gray120@on-white", "surround", ("white",)),
        ("gray120@warm-up-r2c1#3", "warm-up", ("2", "1")),
        ("gray120@warm-up", "warm-up", ("", "")),
        ("black@other=Red", "other", ("red",)),
    ],
)
def test_names_tell_what_was_read(name: str, kind: str, parts: tuple[str, ...]) -> None:
    found = known(tag(name))
    assert (found.kind, found.parts) == (kind, parts)
    assert found.base == name.split("@")[0].lower()


@pytest.mark.parametrize("name", ["white", "white#2", "someone@home", "gray120@r0c1", "a@b@c", "", "@"])
def test_other_names_are_plain(name: str) -> None:
    assert tag(name) is None


@settings(max_examples=6)
@given(st.floats(0.3, 2.0), st.floats(-0.5, 0.5), st.floats(1.0, 20.0))
def test_an_exact_exponential_is_found(settled: float, excess: float, tau: float) -> None:
    time = np.linspace(0, 60, 25)
    found = settle(60 * time, settled + excess * np.exp(-time / tau))
    if abs(excess) > 1e-6:
        assert found.tau_s == pytest.approx(60 * tau, rel=1e-3)
        assert found.settled == pytest.approx(settled, rel=1e-4)
    else:
        assert found.stable_s == 0


@settings(max_examples=6)
@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=20))
def test_points_mixed_from_corners_lie_inside(shares: list[tuple[float, float]]) -> None:
    corners = np.array([[0.45, 0.52], [0.13, 0.57], [0.18, 0.16]])
    for turned in (corners, corners[::-1]):
        weights = np.array([(a * b, a * (1 - b), 1 - a) for a, b in shares])
        assert outside(weights @ turned, turned).max() < 1e-12


def test_points_outside_are_as_far_as_they_are() -> None:
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    points = np.array([[0.5, -0.25], [-3.0, -4.0], [1.0, 1.0], [np.nan, 0.0]])
    assert outside(points, corners) == pytest.approx([0.25, 5.0, np.sqrt(0.5), np.inf])


def test_everything_at_once() -> None:
    panel = characterisation()
    bare = characterisation(7, light=lambda codes: MODEL.xyz(codes) / 0.15)
    special = leaking({"left": 0.02, "right": 0.03}, noise=0.0)
    found = examine(
        [MeasuredSet("panel", panel), MeasuredSet("special", special), MeasuredSet("grid", _grid(FIGURE_3_7))],
        models=EyeModels(MODEL, MODEL),
        without_glasses=MeasuredSet("bare", bare),
    )
    verdicts = {(one.name, one.subject): one.passed for one in found}
    assert verdicts["uniformity", "grid"] is False
    assert [key for key, passed in verdicts.items() if passed is False] == [("uniformity", "grid")]
    assert verdicts["crosstalk", "special"] is True
    assert verdicts["pixel_independence", ""] is None
    assert verdicts["primaries", "special, left eye"] is True
    assert verdicts["glasses_transmittance", "panel"] is True
    assert len({one.name for one in found}) == 35
    json.dumps([one.to_json() for one in found], allow_nan=False)
    assert all(one.source and one.words for one in found)


@pytest.mark.shared_data
def test_a_real_crt_is_told_where_its_readings_fail(shared_data: Path) -> None:
    file = shared_data / "data/displays/apple17_crt_2000.csv"
    found = {one.name: one for one in examine([MeasuredSet("crt", read_csv(file))])}
    assert [name for name, one in found.items() if one.passed is False] == ["channel_constancy", "tone_response"]
    assert all(found[name].passed for name in ("primaries", "chromaticities", "headroom"))
    assert "blue moves most" in found["channel_constancy"].words
    assert "of blue" in found["tone_response"].words


# Gamuts and samples in xy, as in thesis Figures 3.1 to 3.12, and in u′v′.
#
# The shipped curve against colour-science.

DIAGRAMS_MODEL = thesis_display()
CODES = table_c1_codes()
READ = Measurements(CODES, DIAGRAMS_MODEL.xyz(CODES))
PALE = DisplayModel(
    DIAGRAMS_MODEL.black_XYZ_cd_m2, DIAGRAMS_MODEL.primaries_XYZ_cd_m2 @ (0.8 * np.eye(3) + 0.1), DIAGRAMS_MODEL.curves
)
PALE_READ = Measurements(CODES, PALE.xyz(CODES))


def points(panel: PlotAxes, name: str) -> np.ndarray:
    (line,) = (line for line in panel.lines if line.name == name)
    return np.column_stack([line.x, line.y])


def test_both_diagrams_show_the_same_colours() -> None:
    in_xy, in_uv = gamut(READ).series
    assert [(panel.title, panel.x_label, panel.y_label) for panel in (in_xy, in_uv)] == [
        ("CIE 1931", "x", "y"),
        ("CIE 1976", "u′", "v′"),
    ]
    assert [line.name for line in in_xy.lines] == [line.name for line in in_uv.lines]
    corners = DIAGRAMS_MODEL.xyz(np.eye(3)) - DIAGRAMS_MODEL.xyz(np.zeros(3))
    np.testing.assert_allclose(points(in_xy, "primaries and white"), xy(corners), atol=1e-12)
    np.testing.assert_allclose(points(in_uv, "primaries and white"), uv(corners), atol=1e-12)
    # Known colours: equal energy, and the spectrum's ends of the horseshoe, red at (0.62, 0.51).
    np.testing.assert_allclose(uv_from_xy(np.array([[1 / 3, 1 / 3]])), [[4 / 19, 9 / 19]], rtol=1e-12)
    np.testing.assert_allclose(points(in_uv, "real colours")[-1], [0.6234, 0.5065], atol=1e-4)


def test_every_chromaticity_figure_has_both() -> None:
    for diagnosis in (
        gamut(READ),
        gamut_change(READ, PALE_READ, "a", "b"),
        gamuts([("a", READ), ("b", PALE_READ)]),
        chromaticities(READ),
        primary_colours(READ),
    ):
        assert [panel.title for panel in diagnosis.series] == ["CIE 1931", "CIE 1976"], diagnosis.name
        assert all(panel.equal for panel in diagnosis.series)
        assert diagnosis.series[0].lines[0] == locus_line()


def test_the_gamuts_of_both_eyes_are_in_one_diagram() -> None:
    """Through glasses whose right lens is paler; each eye's triangle and white are drawn."""
    left_eye: tuple[PatchEye, ...] = ("left",)
    right_eye: tuple[PatchEye, ...] = ("right",)
    eyes = left_eye * len(CODES) + right_eye * len(CODES)
    both = Measurements(np.vstack([CODES, CODES]), np.vstack([READ.XYZ, PALE_READ.XYZ]), eye=eyes)
    (found,) = (one for one in examine([MeasuredSet("glasses", both)]) if one.name == "gamuts")
    assert found.passed is None
    assert 30 < known(found.value) < 90
    in_xy = found.series[0]
    left, right = (points(in_xy, f"glasses, {eye} eye") for eye in ("left", "right"))
    assert len(left) == 3  # a whole outline, which closes itself
    np.testing.assert_allclose(right[:3], xy(PALE.xyz(np.eye(3)) - PALE.xyz(np.zeros(3))), atol=1e-3)
    whites = [line for line in in_xy.lines if line.style == "points"]
    assert len(whites) == 2
    assert len({line.colour for line in whites}) == 2
    assert [row[0] for row in known(found.table).rows] == ["glasses, left eye", "glasses, right eye"]


def test_one_gamut_alone_has_no_diagram_of_several() -> None:
    assert "gamuts" not in [one.name for one in examine([MeasuredSet("panel", READ)])]
    grey = np.repeat(np.linspace(0, 1, 5)[:, None], 3, axis=1)
    without = Measurements(grey, DIAGRAMS_MODEL.xyz(grey))
    found = gamuts([("a", READ), ("grey", without)])
    assert (found.passed, found.value) == (None, None)


@pytest.mark.filterwarnings("ignore")
def test_the_locus_is_that_of_cie_1931() -> None:
    nm, x, y = (np.array(column, dtype=np.float64) for column in zip(*LOCUS, strict=True))
    assert np.abs(xy(colorimetric_observer("CIE 1931 2").functions_at(nm)) - np.column_stack([x, y])).max() <= 5.1e-5
