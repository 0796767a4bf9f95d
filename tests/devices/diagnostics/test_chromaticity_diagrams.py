"""Gamuts and samples in xy, as in thesis Figures 3.1 to 3.12, and in u′v′.

The shipped curve against colour-science.
"""

from __future__ import annotations

import numpy as np
import pytest

from devices.characterise import table_c1_codes, thesis_display
from devices.colour_matching import colorimetric_observer
from devices.diagnostics import MeasuredSet, Panel, examine, locus_line
from devices.diagnostics.chromaticity_diagrams import LOCUS, diagrams, triangle, uv_from_xy
from devices.diagnostics.colours import chromaticities, outside, primary_colours
from devices.diagnostics.gamut_and_model import gamut, gamut_change, gamuts
from devices.diagnostics.readings import uv, xy
from devices.display import DisplayModel
from devices.readings import Measurements, PatchEye
from tests.devices.diagnostics.simulated import characterisation

MODEL = thesis_display()
CODES = table_c1_codes()
READ = Measurements(CODES, MODEL.xyz(CODES))
PALE = DisplayModel(MODEL.black_XYZ_cd_m2, MODEL.primaries_XYZ_cd_m2 @ (0.8 * np.eye(3) + 0.1), MODEL.curves)
PALE_READ = Measurements(CODES, PALE.xyz(CODES))


def points(panel: Panel, name: str) -> np.ndarray:
    (line,) = (line for line in panel.lines if line.name == name)
    return np.column_stack([line.x, line.y])


def test_both_diagrams_show_the_same_colours() -> None:
    in_xy, in_uv = gamut(READ).series
    assert [(panel.title, panel.x_label, panel.y_label) for panel in (in_xy, in_uv)] == [
        ("CIE 1931", "x", "y"),
        ("CIE 1976", "u′", "v′"),
    ]
    assert [line.name for line in in_xy.lines] == [line.name for line in in_uv.lines]
    corners = MODEL.xyz(np.eye(3)) - MODEL.xyz(np.zeros(3))
    np.testing.assert_allclose(points(in_xy, "primaries and white"), xy(corners), atol=1e-12)
    np.testing.assert_allclose(points(in_uv, "primaries and white"), uv(corners), atol=1e-12)
    # Known colours: equal energy, and the spectrum's ends of the horseshoe, red at (0.62, 0.51).
    np.testing.assert_allclose(uv_from_xy(np.array([[1 / 3, 1 / 3]])), [[4 / 19, 9 / 19]], rtol=1e-12)
    np.testing.assert_allclose(points(in_uv, "real colours")[-1], [0.6234, 0.5065], atol=1e-4)


def test_the_thesis_s_white_and_triangle() -> None:
    """Expression 3.12: white at (0.3117, 0.3151) if each primary counts 1."""
    matrix = MODEL.primaries_XYZ_cd_m2
    lines = triangle("thesis", xy(matrix.T), xy(matrix.sum(axis=1)))
    outline, white = lines
    assert outline.style == "outline"
    assert (white.x[0], white.y[0]) == pytest.approx((0.3117, 0.3151), abs=5e-5)
    in_uv = diagrams(lines)[1]
    # u′ = 4x / (−2x + 12y + 3), v′ = 9y / (−2x + 12y + 3)
    below = -2 * 0.3117 + 12 * 0.3151 + 3
    white_uv = in_uv.lines[-1]
    assert (white_uv.x[0], white_uv.y[0]) == pytest.approx((4 * 0.3117 / below, 9 * 0.3151 / below), abs=5e-5)


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
    assert found.value is not None
    assert 30 < found.value < 90
    in_xy = found.series[0]
    left, right = (points(in_xy, f"glasses, {eye} eye") for eye in ("left", "right"))
    assert len(left) == 3  # a whole outline, which closes itself
    np.testing.assert_allclose(right[:3], xy(PALE.xyz(np.eye(3)) - PALE.xyz(np.zeros(3))), atol=1e-3)
    whites = [line for line in in_xy.lines if line.style == "points"]
    assert len(whites) == 2
    assert len({line.colour for line in whites}) == 2
    assert found.table is not None
    assert [row[0] for row in found.table.rows] == ["glasses, left eye", "glasses, right eye"]


def test_one_gamut_alone_has_no_diagram_of_several() -> None:
    assert "gamuts" not in [one.name for one in examine([MeasuredSet("panel", READ)])]
    grey = np.repeat(np.linspace(0, 1, 5)[:, None], 3, axis=1)
    without = Measurements(grey, MODEL.xyz(grey))
    found = gamuts([("a", READ), ("grey", without)])
    assert (found.passed, found.value) == (None, None)


@pytest.mark.filterwarnings("ignore")
def test_the_locus_is_that_of_cie_1931() -> None:
    nm, x, y = (np.array(column, dtype=np.float64) for column in zip(*LOCUS, strict=True))
    assert np.abs(xy(colorimetric_observer("CIE 1931 2").functions_at(nm)) - np.column_stack([x, y])).max() <= 5.1e-5


def test_each_figure_of_samples_has_it_and_a_display_lies_inside() -> None:
    lines = chromaticities(characterisation()).series[0].lines
    assert lines[0] == locus_line()
    corners = np.column_stack([lines[1].x, lines[1].y])
    assert len(corners) == 3
    # Each primary lies inside some triangle of the horseshoe.
    curve = np.column_stack([lines[0].x, lines[0].y])
    fans = [curve[[0, start, start + 1]] for start in range(1, len(curve) - 1)]
    assert np.min([outside(corners, fan) for fan in fans], axis=0).max() == 0
