"""Gain maps: the thesis's nine readings, bilinear between them, and an even picture behind the uneven panel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.display import GainMap, read_display
from devices.display.gain_map import Normalise, Positions
from devices.errors import DeviceError

ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"
FIGURE_3_7 = np.array([[0.0697, 0.1047, 0.0955], [0.1088, 0.1587, 0.1434], [0.1340, 0.1774, 0.1608]])
PANEL = (1920, 1080)
KINDS: list[Positions] = ["cells", "corners"]
NORMALISED: list[Normalise] = ["minimum", "centre"]


def _thesis(positions: Positions = "cells", normalise: Normalise = "minimum") -> GainMap:
    return GainMap(FIGURE_3_7, PANEL, positions, normalise)


@pytest.mark.parametrize("positions", KINDS)
def test_figure_3_7_relative_to_the_centre(positions: Positions) -> None:
    """The deviations of a panel far less even than its "percent" say: 56, 34, 40 / 31, 0, 10 / 16, −12, −1 %."""
    deviations = np.round(100 * (1 - _thesis(positions).gains)).astype(int)
    assert deviations.tolist() == [[56, 34, 40], [31, 0, 10], [16, -12, -1]]


def test_readings_stand_in_the_middle_of_their_cells_or_at_the_edges() -> None:
    cells, corners = _thesis("cells"), _thesis("corners")
    relative = FIGURE_3_7 / 0.1587
    assert cells.gain(320, 180) == pytest.approx(relative[0, 0])
    assert cells.gain(1600, 900) == pytest.approx(relative[2, 2])
    assert cells.gain(0, 0) == pytest.approx(relative[0, 0])
    assert cells.gain(640, 540) == pytest.approx((relative[1, 0] + relative[1, 1]) / 2)
    assert corners.gain(0, 0) == pytest.approx(relative[0, 0])
    assert corners.gain(1920, 1080) == pytest.approx(relative[2, 2])
    assert corners.gain(480, 270) == pytest.approx(relative[:2, :2].mean())
    assert corners.gain(-5, 5000) == pytest.approx(relative[2, 0])


@given(st.integers(1, 5), st.integers(1, 5), st.sampled_from(KINDS), st.integers(0, 2**32 - 1))
def test_the_fast_grid_is_the_plain_one(rows: int, columns: int, positions: Positions, seed: int) -> None:
    if positions == "corners" and min(rows, columns) < 2:
        return
    rng = np.random.default_rng(seed)
    readings = rng.uniform(0.05, 2.0, (rows, columns))
    gain_map = GainMap(readings, (640, 480), positions, "centre")
    x, y = rng.uniform(-10, 650, 7), rng.uniform(-10, 490, 9)
    assert np.abs(gain_map.over(x, y) - gain_map.gain(x[None, :], y[:, None])).max() < 1e-12
    assert gain_map.gain(320, 240) == pytest.approx(1.0)

    def plain(at_x: float, at_y: float) -> float:
        def between(values: np.ndarray, share: float) -> float:
            n = len(values)
            places = (np.arange(n) + 0.5) / n if positions == "cells" else np.linspace(0, 1, n)
            return float(np.interp(share, places, values))

        return between(np.array([between(row, at_x / 640) for row in readings]), at_y / 480)

    expected = plain(float(x[0]), float(y[0])) / plain(320.0, 240.0)
    assert gain_map.gain(x[0], y[0]) == pytest.approx(expected, rel=1e-12)


@settings(max_examples=8)
@given(st.integers(1, 4), st.integers(1, 4), st.floats(1e-6, 1e6), st.sampled_from(NORMALISED))
def test_a_map_of_equal_readings_changes_nothing(rows: int, columns: int, level: float, normalise: Normalise) -> None:
    even = GainMap(np.full((rows, columns), level), PANEL, "cells", normalise)
    gains = even.over(np.arange(0.5, 1920, 91), np.arange(0.5, 1080, 83))
    assert gains == pytest.approx(1.0, abs=1e-12)
    xyz = np.random.default_rng(0).uniform(0, 30, (*gains.shape, 3))
    assert even.corrected(xyz, gains) == pytest.approx(xyz, rel=1e-12)
    assert even.luminance_lost == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("normalise", NORMALISED)
def test_an_even_picture_comes_out_of_the_uneven_panel(normalise: Normalise) -> None:
    """What the panel sends is gain · model(code): it must be even, at the stated share of what was asked."""
    model = read_display(ASUS).models("side-by-side").left
    gain_map = _thesis(normalise=normalise)
    gains = gain_map.over(np.arange(0.5, 1920, 60), np.arange(0.5, 1080, 60))
    asked = np.broadcast_to(0.4 * model.white_XYZ_cd_m2, (*gains.shape, 3))
    sent = gains[..., None] * model.xyz(model.code(gain_map.corrected(asked, gains)))
    assert np.abs(sent - gain_map.delivered_share * asked).max() < 1e-9
    uncorrected = gains[..., None] * model.xyz(model.code(asked))
    assert uncorrected[..., 1].min() < 0.45 * asked[0, 0, 1]


def test_the_share_of_luminance_lost_is_told() -> None:
    least = 0.0697 / 0.1587
    dim, bright = _thesis(normalise="minimum"), _thesis(normalise="centre")
    assert dim.luminance_lost == pytest.approx(1 - least)
    assert bright.luminance_lost == 0.0
    assert bright.reachable_share == pytest.approx(least)
    # White everywhere: with `minimum` it is reached everywhere, with `centre` it clips where the panel is dim.
    model = read_display(ASUS).models("side-by-side").left
    gains = dim.over(np.arange(0.5, 1920, 60), np.arange(0.5, 1080, 60))
    white = np.broadcast_to(0.97 * model.white_XYZ_cd_m2, (*gains.shape, 3))
    dimmest = 0.97 / model.limits[1].min()  # red ends at 0.983 of its light
    assert model.clipping(dim.corrected(white, gains)).any_channel == 0
    assert model.clipping(bright.corrected(white, gains)).any_channel == np.count_nonzero(gains < dimmest)


def test_a_panel_brighter_at_the_edges_loses_nothing() -> None:
    bowl = GainMap(np.array([[2.0, 2, 2], [2, 1, 2], [2, 2, 2]]), PANEL, "corners", "minimum")
    assert (bowl.delivered_share, bowl.luminance_lost) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"luminance": [[1, 2], [3, 0]]}, "finite luminances above 0"),
        ({"luminance": [[1, 2], [3, float("nan")]]}, "finite luminances above 0"),
        ({"luminance": [1, 2]}, "finite luminances above 0"),
        ({"luminance": [[1, 2]], "positions": "corners"}, "at least 2 × 2 places, not 1 × 2"),
        ({"resolution_px": (0, 5)}, "no places"),
    ],
)
def test_bad_maps_are_refused(changes: dict[str, Any], part: str) -> None:
    good: dict[str, Any] = {
        "luminance": [[1, 2], [3, 4]],
        "resolution_px": PANEL,
        "positions": "cells",
        "normalise": "centre",
    }
    with pytest.raises(DeviceError, match=part):
        GainMap(**(good | changes))


def test_places_must_be_numbers() -> None:
    with pytest.raises(DeviceError, match="not a finite number of pixels"):
        _thesis().gain(np.nan, 0)
    with pytest.raises(DeviceError, match="not a finite number of pixels"):
        _thesis().over(np.array([np.inf]), np.array([1.0]))
