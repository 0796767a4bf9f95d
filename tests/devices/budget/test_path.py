"""Each step of the error budget by itself: planting a fault in one raises its own row and no other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.budget import (
    Encoding,
    ErrorBudget,
    Mixed,
    OwnPixels,
    Pair,
    PathStep,
    SmoothScene,
    StepCost,
    joined_differences,
)
from devices.budget.path import half_floats
from devices.compensation import Correction, channel_split, dither_codes, dither_thresholds
from devices.compensation.eye_costs import mixed_costs
from devices.display import (
    ENTRIES,
    EYES,
    Crosstalk,
    DisplayModel,
    EyeModels,
    GainMap,
    ToneCurve,
    code_tables,
    read_display,
    table_codes,
)
from tests.displays import corrections, eye_models

MODELS = read_display(Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml").models("side-by-side")
EIGHT_BITS = Encoding(255, ENTRIES, dithered=False)
SIZE_PX = (96, 64)
PANEL = GainMap(np.array([[100.0, 90.0, 80.0]]), (96, 64), "cells", "centre")
GAINS = PANEL.over(np.arange(96) + 0.5, np.arange(64) + 0.5).ravel()
LEAKS = Crosstalk(0.02 * np.eye(3), 0.02 * np.eye(3))


def _scene(models: EyeModels = MODELS) -> Pair:
    return {eye: SmoothScene(models, SIZE_PX).view(eye, SIZE_PX).reshape(-1, 3) for eye in EYES}


def _means(path: OwnPixels | Mixed, asked: Pair | None = None) -> dict[PathStep, float]:
    """Return the mean ΔE00 of each step, of both eyes."""
    found = path.differences(_scene() if asked is None else asked)
    return {step: float(np.mean([eyes[eye].mean() for eye in EYES])) for step, eyes in found.items()}


def _raised(before: Mapping[PathStep, float], after: Mapping[PathStep, float]) -> set[PathStep]:
    """Return the steps that cost more than before, all together left out; none may cost less."""
    assert all(after[step] >= before[step] - 1e-9 for step in before if step is not PathStep.TOGETHER)
    return {step for step in after if step is not PathStep.TOGETHER and after[step] > before.get(step, 0.0) + 1e-9}


def test_what_is_planted_in_a_step_raises_its_own_row_alone_and_all_together() -> None:
    whole = OwnPixels(MODELS, EIGHT_BITS, Correction(LEAKS, PANEL), GAINS)
    before = _means(whole)
    planted = {
        PathStep.LOOK_UP_TABLE: replace(whole, encoding=Encoding(255, 24, dithered=False)),
        PathStep.CODES: replace(whole, encoding=Encoding(63, ENTRIES, dithered=False)),
        PathStep.CROSSTALK: replace(whole, correction=Correction(Crosstalk(0.08 * np.eye(3), 0.08 * np.eye(3)), PANEL)),
    }
    for step, path in planted.items():
        after = _means(path)
        assert _raised(before, after) == {step}
        assert after[step] > 2.0 * before[step]
        assert after[PathStep.TOGETHER] > before[PathStep.TOGETHER]
    dim = OwnPixels(MODELS, EIGHT_BITS, Correction(LEAKS, PANEL), 0.5 * GAINS)
    assert _raised(before, _means(dim)) == {PathStep.GAIN_MAP}


def test_a_step_that_has_nothing_to_undo_is_left_out_or_costs_nothing() -> None:
    plain = _means(OwnPixels(MODELS, EIGHT_BITS))
    assert not {PathStep.CROSSTALK, PathStep.GAIN_MAP, PathStep.AMBIENT_LIGHT, PathStep.RESAMPLING} & plain.keys()
    none, even = Crosstalk(np.zeros((3, 3)), np.zeros((3, 3))), GainMap(np.ones((1, 1)), (96, 64), "cells", "centre")
    nothing = _means(OwnPixels(MODELS, EIGHT_BITS, Correction(none, even), np.ones(96 * 64)))
    assert nothing[PathStep.CROSSTALK] < 1e-9
    assert nothing[PathStep.GAIN_MAP] < 1e-9
    assert nothing[PathStep.GAMUT_CLIP] < 1e-9
    assert nothing[PathStep.TOGETHER] == pytest.approx(plain[PathStep.TOGETHER], abs=1e-9)


def test_what_lies_beyond_the_gamut_raises_the_clip_alone() -> None:
    path = OwnPixels(MODELS, EIGHT_BITS)
    asked = _scene()
    bright = {eye: np.concatenate([xyz, 1.5 * MODELS.left.white_XYZ_cd_m2[np.newaxis]]) for eye, xyz in asked.items()}
    before, after = path.differences(asked), path.differences(bright)
    for step in (PathStep.LOOK_UP_TABLE, PathStep.CODES):
        np.testing.assert_allclose(after[step]["left"][:-1], before[step]["left"], atol=1e-12)
    assert after[PathStep.GAMUT_CLIP]["left"][-1] > 5.0
    assert after[PathStep.TOGETHER]["left"][-1] > 5.0


def test_the_rooms_light_costs_what_is_darker_than_it() -> None:
    costs = []
    for cd_m2 in (0.01, 0.1, 1.0):
        lit = EyeModels(MODELS.left.in_room(cd_m2 * np.array([0.95, 1.0, 1.1])), MODELS.right)
        found = OwnPixels(lit, EIGHT_BITS).differences(_scene(lit))
        costs.append(float(found[PathStep.AMBIENT_LIGHT]["left"].mean()))
        assert found[PathStep.AMBIENT_LIGHT]["right"].max() == 0.0
        assert found[PathStep.GAMUT_CLIP]["left"].max() < 1e-6
    assert 0.0 < costs[0] < costs[1] < costs[2]


@given(models=eye_models(), data=st.data())
@settings(max_examples=3)
def test_with_no_step_on_each_eye_sees_what_was_asked(models: EyeModels, data: st.DataObject) -> None:
    lifts = models.left.additive and models.right.additive
    correction = data.draw(corrections((96, 64), lifts=lifts))
    gains = None if correction.gain_map is None else np.linspace(0.7, 1.0, 500)
    rng = np.random.default_rng(3)
    asked = {eye: models.eye(eye).xyz(rng.uniform(0.05, 1.0, (500, 3))) for eye in EYES}
    path = OwnPixels(models, EIGHT_BITS, correction, gains)
    for eye in EYES:
        np.testing.assert_allclose(path.seen(asked, ())[eye], asked[eye], rtol=1e-7, atol=1e-7)
    # What is in the gamut of a display in its room is not clipped, with the room's light or without.
    clipped = path.seen(asked, {PathStep.AMBIENT_LIGHT})
    for eye in EYES:
        np.testing.assert_allclose(clipped[eye], asked[eye], rtol=1e-6, atol=1e-6)


def test_evened_out_by_the_dimmest_place_nothing_is_lost_but_luminance() -> None:
    dimmest = replace(PANEL, normalise="minimum")
    curve = ToneCurve(gamma=2.2)
    without_black = DisplayModel(np.zeros(3), MODELS.left.primaries_XYZ_cd_m2, (curve, curve, curve))
    for model, costs in ((without_black, False), (MODELS.left, True)):  # the latter's red has light at code 0
        models = EyeModels(model, model)
        found = _means(OwnPixels(models, EIGHT_BITS, Correction(None, dimmest), GAINS), _scene(models))
        assert (found[PathStep.GAIN_MAP] > 1e-6) == costs


def test_dithered_light_is_the_mean_over_the_mask() -> None:
    curve = MODELS.left.normalised.curves[0]
    dithered = Encoding(255, ENTRIES, dithered=True)
    model = MODELS.left.normalised
    thresholds = dither_thresholds(64, 64)
    for light in (3e-4, 0.0123, 0.31, 0.9):
        xyz = np.broadcast_to(model.xyz_of_linear(light * np.ones(3)), (64, 64, 3))
        codes = dither_codes(model, xyz, thresholds)[..., 0]
        shown = dithered.light(curve, np.array([light]), look_up=False, codes=True)
        np.testing.assert_allclose(shown, curve.linear(codes / 255.0).mean(), rtol=1e-12)
        exact = dithered.light(curve, np.array([light]), look_up=False, codes=False)
        assert exact[0] == light


def test_looked_up_light_is_that_of_the_colour_passs_twin() -> None:
    asked = _scene()["left"]
    codes = table_codes(MODELS.left, asked, code_tables(MODELS.left))
    seen = OwnPixels(MODELS, EIGHT_BITS).seen({"left": asked, "right": asked}, {PathStep.LOOK_UP_TABLE})["left"]
    np.testing.assert_allclose(seen, MODELS.left.xyz(codes), rtol=1e-12)


def test_in_an_anaglyph_the_filters_cost_what_the_clipping_report_says() -> None:
    mixture = channel_split(MODELS, (True, False, False), (1, 0, 0), (0, 1, 1))
    path = Mixed(MODELS, mixture, EIGHT_BITS)
    asked = _scene()
    found = path.differences(asked)
    stated = mixed_costs(mixture, MODELS, asked["left"], asked["right"])
    for eye in EYES:
        assert found[PathStep.FILTERS][eye].mean() == pytest.approx(stated[eye]["projection_delta_e_00_mean"], abs=1e-4)
        assert found[PathStep.GAMUT_CLIP][eye].mean() == pytest.approx(stated[eye]["delta_e_00_mean"], abs=1e-4)
    coarse = _means(Mixed(MODELS, mixture, Encoding(63, ENTRIES, dithered=False)))
    assert _raised(_means(path), coarse) == {PathStep.CODES}


def test_half_floats_are_off_by_half_of_their_last_place() -> None:
    asked = _scene()
    kept = half_floats(asked)["left"]
    share = np.abs(kept - asked["left"]) / asked["left"]
    assert 0.0 < share.max() <= 2.0**-11


def test_the_scene_holds_the_mean_light_of_each_pixel() -> None:
    """Against the midpoint rule on pixels 32 times as fine; its error falls with the square of their width."""
    scene = SmoothScene(MODELS, (24, 16))
    fine = scene.view("right", (24 * 32, 16 * 32)).reshape(16, 32, 24, 32, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(scene.view("right", (24, 16)), fine, rtol=1e-12)
    edge = scene.view("left", (24 * 999, 16))[0, 500]
    middle = scene.view("left", (24, 16))[0, 0]
    assert np.abs(edge / middle - 1).max() < 0.05


def test_pictures_together_and_rows_in_words() -> None:
    part = OwnPixels(MODELS, EIGHT_BITS).differences(_scene())
    both = joined_differences([part, part])
    assert both[PathStep.CODES]["left"].shape == (2 * 96 * 64,)
    words = {PathStep.CODES: "rounded", PathStep.CROSSTALK: "not measured", PathStep.CHARACTERISATION: "held out"}
    stated = {PathStep.CHARACTERISATION: dict.fromkeys(EYES, StepCost(0.1, 0.2, 0.3))}
    budget = ErrorBudget.of("colours", both, words, stated)
    assert [row.step for row in budget.rows] == [PathStep.CROSSTALK, PathStep.CODES, PathStep.CHARACTERISATION]
    assert budget.row(PathStep.CROSSTALK).eyes is None
    assert budget.to_json()["steps"][2]["left"] == {"mean": 0.1, "p95": 0.2, "max": 0.3}


def test_a_curve_with_a_lift_is_looked_up_and_dithered_from_its_lift() -> None:
    curve = ToneCurve(1.0 - 2.0**-9, 0.0, 2.2, 2.0**-9).normalised()
    light = np.linspace(0.0, 1.0, 2001)
    for encoding in (EIGHT_BITS, Encoding(255, ENTRIES, dithered=True)):
        shown = encoding.light(curve, light, look_up=True, codes=False)
        np.testing.assert_allclose(shown, light, atol=2e-5)
