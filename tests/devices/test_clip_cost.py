"""What the gamut clip costs, against colour-science and by counting."""

from pathlib import Path

import numpy as np
import pytest

from devices.ciede2000 import delta_e_2000
from devices.clip_cost import clip_cost
from devices.colour import xyz_to_lab
from devices.display import DisplayModel
from devices.display_file import read_display
from devices.tone_curve import ToneCurve

ASUS = Path(__file__).parents[2] / "configs/displays/asus_vg248qe.yaml"


def _plain() -> DisplayModel:
    curve = ToneCurve(gamma=2.2)
    return DisplayModel(np.zeros(3), np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]), (curve, curve, curve))


def test_a_picture_inside_the_gamut_costs_nothing() -> None:
    model = _plain()
    linear = np.random.default_rng(0).uniform(0.01, 0.99, (50, 40, 3))
    cost = clip_cost(model, linear @ model.primaries_XYZ_cd_m2.T)
    assert (cost.delta_e_00_mean, cost.delta_e_00_max, cost.clipping.any_channel) == (0.0, 0.0, 0)
    assert cost.clipping.pixels == 2000


def test_the_cost_is_the_ciede2000_of_asked_and_shown() -> None:
    colour = pytest.importorskip("colour", reason="colour-science is the oracle")
    model = _plain()
    linear = np.random.default_rng(1).uniform(-0.05, 1.4, (300, 3))
    asked = np.maximum(linear @ model.primaries_XYZ_cd_m2.T, 0.0)
    shown = np.clip(model.linear(asked), 0, 1) @ model.primaries_XYZ_cd_m2.T
    white = model.white_XYZ_cd_m2

    def lab(xyz: np.ndarray) -> np.ndarray:
        return np.asarray(colour.XYZ_to_Lab(xyz / white[1], colour.XYZ_to_xy(white)))

    expected = np.asarray(colour.delta_E(lab(asked), lab(shown), method="CIE 2000"))
    cost = clip_cost(model, asked)
    assert cost.delta_e_00_mean == pytest.approx(expected.mean(), abs=1e-6)
    assert cost.delta_e_00_max == pytest.approx(expected.max(), abs=1e-6)
    assert cost.clipping.any_channel == np.count_nonzero(
        ((model.linear(asked) < -1e-6) | (model.linear(asked) > 1 + 1e-6)).any(axis=1)
    )


def test_light_that_a_channel_s_full_drive_does_not_reach_is_a_cost() -> None:
    """Table 3.6's red gives 0.98 of its light at full drive; asked for 1 it is not out of gamut but falls short."""
    model = read_display(ASUS).models("side-by-side").left
    cost = clip_cost(model, model.primaries_XYZ_cd_m2[:, 0])
    assert cost.clipping.any_channel == 0
    assert cost.delta_e_00_max > 0.1


def test_leaving_out_the_pixels_shown_as_asked_changes_nothing() -> None:
    model = read_display(ASUS).models("side-by-side").left
    linear = np.random.default_rng(2).uniform(-0.02, 1.1, (2000, 3)) ** 3
    asked = np.maximum(linear @ model.primaries_XYZ_cd_m2.T, 0.0)
    white = model.white_XYZ_cd_m2
    everywhere = delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(model.xyz(model.code(asked)), white))
    cost = clip_cost(model, asked)
    assert cost.delta_e_00_mean == pytest.approx(everywhere.mean(), abs=1e-9)
    assert cost.delta_e_00_max == pytest.approx(everywhere.max(), abs=1e-9)
