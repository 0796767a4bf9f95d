"""Dithering keeps the mean light; gain maps make an uneven panel even."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation import (
    Compensation,
    Correction,
    EyeView,
    Rectangle,
    code_lights,
    dither_codes,
    dither_thresholds,
    load_mask,
    mask_shifts_px,
)
from devices.compensation.dither import adjacent_codes, dither_tables, tabled_dither_codes
from devices.compensation.dither_mask import main, make_mask
from devices.display import DisplayModel, EyeModels, GainMap, ToneCurve, read_display
from devices.display.gain_map import Normalise, Positions
from devices.errors import DeviceError

# Dithering: the mean light is kept, from the closed form and from the tables, and the mask is blue noise.

ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"
# Green has all its light by code 243.9: Table 3.6's gain is above 1.
FULL = 243
PERIOD = dither_thresholds(64, 64)
CURVES = st.builds(
    ToneCurve,
    gain=st.floats(0.8, 1.2),
    offset=st.floats(-0.08, 0.08),
    gamma=st.floats(1.0, 3.0),
    lift=st.floats(-0.01, 0.05),
)


@pytest.fixture(scope="module")
def thesis() -> DisplayModel:
    return read_display(ASUS).models("side-by-side").left


def _grey(curve: ToneCurve) -> DisplayModel:
    return DisplayModel(np.zeros(3), np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]), (curve, curve, curve))


def _asked_codes() -> NDArray[np.float64]:
    """Every quarter of a code up to 8, greys up to full, and random colours; in codes of 8 bits."""
    rng = np.random.default_rng(6)
    greys = np.concatenate([np.arange(0, 8, 0.25), np.geomspace(8, FULL, 20)])
    return np.concatenate(
        [np.repeat(greys[:, None], 3, axis=1), rng.uniform(0, 30, (20, 3)), rng.uniform(0, FULL, (20, 3))]
    )


@pytest.mark.parametrize(
    ("way", "levels"),
    [
        ("closed form", 255),
        ("tables in float32", 1023),
        pytest.param("tables in float64", 255, marks=pytest.mark.nightly),
        pytest.param("closed form", 1023, marks=pytest.mark.stress),
        pytest.param("tables in float32", 255, marks=pytest.mark.stress),
        pytest.param("tables in float64", 1023, marks=pytest.mark.stress),
    ],
)
def test_the_mean_over_a_mask_period_is_the_light_that_was_asked(thesis: DisplayModel, way: str, levels: int) -> None:
    codes = _asked_codes()
    asked = thesis.xyz(codes / 255)
    tables = dither_tables(thesis, levels)
    shown = np.empty_like(asked)
    for index, xyz in enumerate(asked):
        patch = np.broadcast_to(xyz, (64, 64, 3))
        if way == "closed form":
            dithered = dither_codes(thesis, patch, PERIOD, levels)
        else:
            dtype = np.float32 if way.endswith("float32") else np.float64
            dithered = tabled_dither_codes(thesis, patch, PERIOD, tables, dtype)
        shown[index] = thesis.xyz(dithered / levels).reshape(-1, 3).mean(axis=0)
    white = thesis.white_XYZ_cd_m2
    assert delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(shown, white)).max() <= 0.05
    bias = np.abs(shown[:, 1] / asked[:, 1] - 1)
    lowest = codes.min(axis=1)
    assert bias[lowest >= 4].max() <= 0.001
    assert bias[lowest >= 1.5].max() <= 0.005


@settings(deadline=None, max_examples=20)
@given(CURVES, st.integers(0, 255), st.sampled_from([np.float32, np.float64]))
def test_an_exact_code_is_that_code_at_every_pixel(
    curve: ToneCurve, code: int, dtype: type[np.float32] | type[np.float64]
) -> None:
    model = _grey(curve)
    light = float(curve.linear(code / 255))
    if not 0.0 <= light <= 1.0:
        return
    xyz = np.broadcast_to(model.xyz(np.full(3, code / 255)), (64, 64, 3))
    for codes in (
        dither_codes(model, xyz, PERIOD),
        tabled_dither_codes(model, xyz, PERIOD, dither_tables(model), dtype),
    ):
        assert len(np.unique(codes)) == 1
        # Codes below the curve's foot all give the same light; any of them is right.
        assert float(curve.linear(codes[0, 0, 0] / 255)) == pytest.approx(light, rel=1e-12, abs=1e-15)


@settings(deadline=None)
@given(CURVES, st.floats(0, 1), st.floats(0.0001, 0.9999), st.sampled_from([255, 1023]))
def test_the_fast_way_is_the_plain_one(curve: ToneCurve, light: float, threshold: float, levels: int) -> None:
    lights = [float(curve.linear(code / levels)) for code in range(levels + 1)]
    lower = min(bisect_right(lights, max(light, lights[0])) - 1, levels - 1)
    step = lights[lower + 1] - lights[lower]
    share = min(max((light - lights[lower]) / step, 0.0), 1.0) if step > 0 else 0.0
    found, found_share = adjacent_codes(light, code_lights(curve, levels))
    assert int(found) == lower
    assert float(found_share) == pytest.approx(share, abs=1e-12)
    model = _grey(curve)
    xyz = np.repeat(light, 3) @ model.primaries_XYZ_cd_m2.T
    if abs(share - threshold) > 1e-6:
        assert dither_codes(model, xyz, np.full(3, threshold), levels)[1] == lower + (threshold < share)


@settings(deadline=None, max_examples=20)
@given(CURVES, st.sampled_from([255, 1023]), st.integers(0, 2**32 - 1))
def test_the_tables_pick_the_closed_form_s_codes(curve: ToneCurve, levels: int, seed: int) -> None:
    """Near the boundary between two codes they may differ by one, where both are as likely as not; elsewhere never."""
    model = _grey(curve)
    rng = np.random.default_rng(seed)
    light = np.concatenate([rng.uniform(0, 1, (1000, 3)), np.geomspace(1e-12, 1, 3000).reshape(-1, 3)])
    xyz = light @ model.primaries_XYZ_cd_m2.T
    thresholds = rng.uniform(0.0002, 0.9998, xyz.shape)
    closed = dither_codes(model, xyz, thresholds, levels)
    tabled = tabled_dither_codes(model, xyz, thresholds, dither_tables(model, levels))
    _, share = adjacent_codes(np.clip(model.linear(xyz), 0, 1), code_lights(curve, levels))
    clear = np.abs(share - thresholds) > 2e-4
    assert np.array_equal(closed[clear], tabled[clear])
    assert np.abs(closed - tabled).max() <= 1


@pytest.mark.parametrize("gamma", [1.8, 2.9])
def test_a_code_table_too_coarse_for_codes_still_gives_the_right_neighbours(gamma: float) -> None:
    """The code that the table gives may lie across a boundary; the light of the codes decides."""
    model = _grey(ToneCurve(gamma=gamma))
    rng = np.random.default_rng(11)
    xyz = rng.uniform(0, 1, (20_000, 3)) ** 2 @ model.primaries_XYZ_cd_m2.T
    thresholds = rng.uniform(0.0002, 0.9998, xyz.shape)
    coarse = dither_tables(model, entries=48)
    assert np.array_equal(coarse.lights, dither_tables(model).lights)
    _, share = adjacent_codes(np.clip(model.linear(xyz), 0, 1), code_lights(model.curves[0]))
    clear = np.abs(share - thresholds) > 2e-4
    tabled = tabled_dither_codes(model, xyz, thresholds, coarse)
    assert np.array_equal(tabled[clear], dither_codes(model, xyz, thresholds)[clear])


def test_light_beyond_the_ends_takes_the_end(thesis: DisplayModel) -> None:
    beyond = np.array([[[0.0, 0, 0], [1e6, 1e6, 1e6]]])
    codes = dither_codes(thesis, beyond, np.full(3, 0.5))
    assert codes[0, 0].tolist() == [0, 0, 0]
    # All reach full drive, also green, which gives more than the light that its model calls 1 there.
    assert codes[0, 1].tolist() == [255, 255, 255]


def test_what_is_not_finite_is_refused(thesis: DisplayModel) -> None:
    for bad in (np.nan, np.inf):
        with pytest.raises(DeviceError, match="not finite"):
            dither_codes(thesis, np.array([1.0, bad, 1.0]), np.full(3, 0.5))
    with pytest.raises(DeviceError, match="the highest code is 0"):
        dither_tables(thesis, 0)


def test_the_mask_is_a_permutation_that_regenerates_bit_for_bit() -> None:
    mask = load_mask()
    assert np.array_equal(np.sort(mask, axis=None), np.arange(4096))
    assert np.array_equal(make_mask(), mask)
    assert not np.array_equal(make_mask(seed=1), mask)


def _low_frequency_power(picture: NDArray[np.float64]) -> float:
    """Power below 0.1 cycles per pixel, relative to the same variance as white noise."""
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(64), np.fft.fftfreq(64)))
    power = np.abs(np.fft.fft2(picture - picture.mean())) ** 2
    return float(power[(frequency > 0) & (frequency < 0.1)].mean() / power[frequency > 0].mean())


def test_the_mask_is_blue_noise() -> None:
    mask = load_mask().astype(np.float64)
    assert _low_frequency_power(mask) < 1 / 5000
    for share, factor in ((0.1, 15), (0.25, 30), (0.5, 50), (0.75, 30), (0.9, 15)):
        assert _low_frequency_power((mask < share * 4096).astype(np.float64)) < 1 / factor
    white = np.random.default_rng(0).permutation(4096).reshape(64, 64).astype(np.float64)
    assert _low_frequency_power(white) > 0.7


def test_shared_masks_are_the_same_for_both_eyes_and_independent_ones_unrelated() -> None:
    assert np.array_equal(dither_thresholds(64, 64, "left"), dither_thresholds(64, 64, "right"))
    left, right = (dither_thresholds(64, 64, eye, "independent") for eye in ("left", "right"))
    six = np.concatenate([left.reshape(-1, 3), right.reshape(-1, 3)], axis=1)
    related = np.corrcoef(six.T) - np.eye(6)
    assert np.abs(related).max() < 0.05
    assert np.array_equal(np.sort(six, axis=0), np.repeat(((np.arange(4096) + 0.5) / 4096)[:, None], 6, axis=1))


def test_a_threshold_is_the_mask_read_at_the_shifted_place() -> None:
    mask = load_mask()
    for eye in ("left", "right"):
        thresholds = dither_thresholds(70, 130, eye, "independent")
        for channel, (x_px, y_px) in enumerate(mask_shifts_px(eye, "independent")):
            for row, column in ((0, 0), (69, 129), (63, 64), (31, 7)):
                rank = mask[(row + y_px) % 64, (column + x_px) % 64]
                assert thresholds[row, column, channel] == (rank + 0.5) / 4096


@pytest.mark.nightly
def test_the_command_writes_and_checks_the_mask(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "masks" / "mask.npy"
    assert main([str(file), "--check"]) == 1
    assert main([str(file)]) == 0
    assert main([str(file), "--check"]) == 0
    assert "as generated" in capsys.readouterr().out
    np.save(file, load_mask().T, allow_pickle=False)
    assert main([str(file), "--check"]) == 1


def test_masks_of_silly_sizes_are_refused() -> None:
    with pytest.raises(DeviceError, match=r"in 4\.\.256"):
        make_mask(2)


# Gain maps: the thesis's nine readings, bilinear between them, and an even picture behind the uneven panel.

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


def test_a_flat_picture_that_both_eyes_get_alike_is_one_array() -> None:
    """Both views at one place of the panel, as in a mixture: what is sent to one eye is kept once, if models agree."""
    model = read_display(ASUS).models("side-by-side").left
    picture = np.full((4, 6, 3), 0.3 * model.white_XYZ_cd_m2, np.float32)
    view = EyeView(Rectangle(0, 0, 1920, 1080))
    for other, alike in ((model, True), (replace(model), False)):
        both = Compensation(EyeModels(model, other), {"left": view, "right": view}, None, Correction(None, _thesis()))
        left, right = both.evened((picture, picture), (40, 30))
        assert (left is right) == alike
        assert np.array_equal(left, right)


def test_what_lies_in_neither_of_two_rectangles_is_empty() -> None:
    above, below, beside = Rectangle(0, 0, 10, 10), Rectangle(0, 20, 10, 10), Rectangle(30, 0, 10, 10)
    assert above.intersection(below) == Rectangle(0, 20, 10, 0)
    assert above.intersection(beside) == Rectangle(30, 0, 0, 10)


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
