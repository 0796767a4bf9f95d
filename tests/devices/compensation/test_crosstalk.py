"""Crosstalk: fitted from readings, undone by the six equations, cancelled within what a display can show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation import (
    Compensation,
    Correction,
    CrosstalkReading,
    EyeView,
    Rectangle,
    cancel_crosstalk,
    channel_crosstalk,
    fit_crosstalk,
    needed_lift,
)
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.display import (
    EYES,
    Crosstalk,
    DisplayModel,
    Eye,
    EyeModels,
    GainMap,
    ToneCurve,
    check_leakage,
    read_display,
)
from devices.display.gain_map import Normalise
from devices.errors import DeviceError
from documents.arrays import Floats

ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"

LEFT_PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
RIGHT_PRIMARIES = LEFT_PRIMARIES * np.array([0.95, 1.02, 0.9]) + 0.1
BLACKS: dict[Eye, Floats] = {"left": np.array([0.021, 0.022, 0.031]), "right": np.array([0.019, 0.02, 0.034])}
# A shutter that leaks each channel by its own share, more blue than red; as K = M · diag(share) · M⁻¹.
LEAK = Crosstalk(
    LEFT_PRIMARIES @ np.diag([0.02, 0.03, 0.06]) @ np.linalg.inv(RIGHT_PRIMARIES),
    RIGHT_PRIMARIES @ np.diag([0.025, 0.03, 0.05]) @ np.linalg.inv(LEFT_PRIMARIES),
)
NONE = Crosstalk(np.zeros((3, 3)), np.zeros((3, 3)))
COLOURS = {"black": [0, 0, 0], "red": [1, 0, 0], "green": [0, 1, 0], "blue": [0, 0, 1], "white": [1, 1, 1]}
LEAKED = ("left", "black", "white")

matrices = st.lists(st.floats(-0.02, 0.12), min_size=9, max_size=9).map(lambda v: np.array(v).reshape(3, 3))
crosstalks = st.builds(Crosstalk, matrices, matrices)


def _models() -> EyeModels:
    curves = (ToneCurve(gamma=2.1), ToneCurve(gamma=2.2), ToneCurve(gamma=2.3))
    return EyeModels(
        DisplayModel(BLACKS["left"], LEFT_PRIMARIES, curves), DisplayModel(BLACKS["right"], RIGHT_PRIMARIES, curves)
    )


def _reading(eye: Eye, left: str, right: str, noise: Floats | None = None) -> CrosstalkReading:
    seen = LEAK.seen(LEFT_PRIMARIES @ COLOURS[left], RIGHT_PRIMARIES @ COLOURS[right])[0 if eye == "left" else 1]
    x, y, z = (seen + BLACKS[eye] + (0 if noise is None else noise)).tolist()
    return CrosstalkReading(eye, left, right, (x, y, z))


def _readings(*colours: str) -> list[CrosstalkReading]:
    """Black, and for each eye every colour alone and every colour leaking into its black."""
    found = [_reading("left", "black", "black"), _reading("right", "black", "black")]
    for colour in colours:
        found += [_reading("left", colour, "black"), _reading("right", "black", colour)]
        found += [_reading("left", "black", colour), _reading("right", colour, "black")]
    return found


# The six equations


@settings(max_examples=15)
@given(crosstalks, st.integers(0, 2**32 - 1))
def test_the_fast_way_is_the_plain_one(crosstalk: Crosstalk, seed: int) -> None:
    left, right = np.random.default_rng(seed).uniform(0, 100, (2, 6, 3))
    seen, sent = crosstalk.seen(left, right), crosstalk.solve(left, right)
    for i in range(6):
        assert seen[0][i] == pytest.approx(left[i] + crosstalk.left @ right[i], rel=1e-12)
        assert seen[1][i] == pytest.approx(right[i] + crosstalk.right @ left[i], rel=1e-12)
        system = np.block([[np.eye(3), crosstalk.left], [crosstalk.right, np.eye(3)]])
        both = np.linalg.solve(system, np.concatenate([left[i], right[i]]))
        assert np.concatenate([sent[0][i], sent[1][i]]) == pytest.approx(both, abs=1e-10)


@settings(max_examples=15)
@given(crosstalks, st.integers(0, 2**32 - 1))
def test_exchanging_the_eyes_exchanges_the_answers(crosstalk: Crosstalk, seed: int) -> None:
    left, right = np.random.default_rng(seed).uniform(0, 26, (2, 4, 3))
    sent = crosstalk.solve(left, right)
    swapped = crosstalk.swapped().solve(right, left)
    assert np.abs(swapped[1] - sent[0]).max() < 1e-10
    assert np.abs(swapped[0] - sent[1]).max() < 1e-10
    models = _models()
    ours = cancel_crosstalk(models, LEAK, left, right)
    theirs = cancel_crosstalk(EyeModels(models.right, models.left), LEAK.swapped(), right, left)
    assert ours.left_linear == pytest.approx(theirs.right_linear, abs=1e-12)
    assert ours.right.delta_e_00_mean == pytest.approx(theirs.left.delta_e_00_mean, abs=1e-9)
    assert (ours.left.negative, ours.right.negative) == (theirs.right.negative, theirs.left.negative)


@pytest.mark.parametrize("bad", [np.zeros((2, 3)), np.full((3, 3), np.nan), np.eye(3)])
def test_matrices_that_cannot_be_undone_are_refused(bad: Floats) -> None:
    with pytest.raises(DeviceError, match=r"3 × 3 finite numbers|cannot be undone"):
        Crosstalk(bad, bad if bad.shape == (3, 3) else np.zeros((3, 3)))


def test_light_that_is_not_finite_or_of_other_shape_is_refused() -> None:
    with pytest.raises(DeviceError, match="2 values of the right eye"):
        LEAK.solve(np.zeros((2, 3)), [[0, np.nan, 0], [np.inf, 0, 0]])
    with pytest.raises(DeviceError, match="expected one"):
        LEAK.seen(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(DeviceError, match="expected one"):
        LEAK.seen(np.zeros((2, 4)), np.zeros((2, 4)))


# The fit


def test_coloured_readings_give_the_matrices_back() -> None:
    for colours in (("red", "green", "blue"), ("red", "green", "blue", "white")):
        fit = fit_crosstalk(_readings(*colours))
        assert (fit.left.kind, fit.right.kind) == ("full", "full")
        assert fit.left.readings == len(colours)
        assert np.abs(fit.crosstalk.left - LEAK.left).max() < 1e-12
        assert np.abs(fit.crosstalk.right - LEAK.right).max() < 1e-12
        assert fit.left.residual_max_cd_m2 < 1e-12


def test_white_alone_gives_a_diagonal_that_explains_white() -> None:
    fit = fit_crosstalk(_readings("white"))
    assert (fit.left.kind, fit.right.kind) == ("diagonal", "diagonal")
    for found, true, white in (
        (fit.crosstalk.left, LEAK.left, RIGHT_PRIMARIES.sum(axis=1)),
        (fit.crosstalk.right, LEAK.right, LEFT_PRIMARIES.sum(axis=1)),
    ):
        assert np.count_nonzero(found - np.diag(np.diag(found))) == 0
        assert found @ white == pytest.approx(true @ white, rel=1e-12)
    assert fit.left.residual_max_cd_m2 < 1e-12


def test_two_colours_do_not_determine_a_matrix_and_leave_a_residual() -> None:
    fit = fit_crosstalk(_readings("red", "white"))
    assert fit.left.kind == "diagonal"
    assert fit.left.residual_max_cd_m2 > 0.01


def test_the_least_squares_fit_is_that_of_the_normal_equations() -> None:
    rng = np.random.default_rng(3)
    readings = [
        replace(r, XYZ_cd_m2=tuple((np.array(r.XYZ_cd_m2) + rng.normal(0, 0.003, 3)).tolist()))
        for r in _readings("red", "green", "blue", "white")
    ]
    fit = fit_crosstalk(readings)
    value = {(r.eye, r.left, r.right): np.array(r.XYZ_cd_m2) for r in readings}
    black = {eye: value[eye, "black", "black"] for eye in ("left", "right")}
    names = ("red", "green", "blue", "white")
    sent = np.array([value["right", "black", name] - black["right"] for name in names])
    leaked = np.array([value["left", "black", name] - black["left"] for name in names])
    expected = np.linalg.inv(sent.T @ sent) @ sent.T @ leaked
    assert fit.crosstalk.left == pytest.approx(expected.T, abs=1e-12)
    assert fit.left.residual_rms_cd_m2 == pytest.approx(np.sqrt(np.mean((leaked - sent @ expected) ** 2)))
    assert 0 < fit.left.residual_max_cd_m2 < 0.02


def test_a_leak_over_a_lit_picture_counts_as_well() -> None:
    readings = _readings("red", "green", "blue")
    mixed = [_reading("left", "red", "green"), _reading("right", "blue", "red")]
    fit = fit_crosstalk([*readings, *mixed])
    assert (fit.left.readings, fit.right.readings) == (4, 4)
    assert np.abs(fit.crosstalk.left - LEAK.left).max() < 1e-12


def test_four_readings_suffice_where_black_is_given() -> None:
    readings = [r for r in _readings("white") if (r.left, r.right) != ("black", "black")]
    assert len(readings) == 4
    given_black = fit_crosstalk(readings, BLACKS)
    assert given_black.crosstalk.left == pytest.approx(fit_crosstalk(_readings("white")).crosstalk.left, abs=1e-12)
    above_black = [replace(r, XYZ_cd_m2=tuple((np.array(r.XYZ_cd_m2) - BLACKS[r.eye]).tolist())) for r in readings]
    subtracted = fit_crosstalk(above_black, {"left": np.zeros(3), "right": np.zeros(3)})
    assert subtracted.crosstalk.left == pytest.approx(given_black.crosstalk.left, abs=1e-12)


def test_equal_readings_are_averaged() -> None:
    noise = np.array([0.01, -0.02, 0.03])
    readings = [*_readings("red", "green", "blue")]
    twice = [r for r in readings if (r.eye, r.right) != ("left", "red")]
    twice += [_reading("left", "black", "red", noise), _reading("left", "black", "red", -noise)]
    assert np.abs(fit_crosstalk(twice).crosstalk.left - LEAK.left).max() < 1e-12


@pytest.mark.parametrize(
    ("drop", "read", "part"),
    [
        (("left", "black", "black"), None, "the left eye's black was not measured"),
        (("right", "white", "black"), None, "nothing was measured of what leaks into the right eye"),
        (("right", "black", "white"), None, "a leak into the left eye needs a reading of the right eye's white alone"),
        (LEAKED, (0.0, -0.5, 0.0), r"left eye's reading of black with white .* is -0.5 cd/m², less than none"),
        (LEAKED, (60.0, 60.0, 60.0), "put the left eye's lens before the instrument"),
        (LEAKED, (float("nan"), 1.0, 1.0), "needs three finite numbers"),
    ],
)
def test_a_missing_reading_and_an_impossible_leak_are_refused(
    drop: tuple[Eye, str, str], read: tuple[float, float, float] | None, part: str
) -> None:
    readings = [r for r in _readings("white") if (r.eye, r.left, r.right) != drop]
    with pytest.raises(DeviceError, match=part):
        fit_crosstalk([*readings, *([CrosstalkReading(*drop, read)] if read else [])])


def test_leaks_are_judged_on_the_display_s_colours() -> None:
    check_leakage(LEAK, LEFT_PRIMARIES, RIGHT_PRIMARIES)
    check_leakage(Crosstalk(-0.05 * np.eye(3), LEAK.right), LEFT_PRIMARIES, RIGHT_PRIMARIES)
    with pytest.raises(DeviceError, match=r"left eye loses .*red .*more than all"):
        check_leakage(Crosstalk(-1.2 * np.eye(3), 0.1 * np.eye(3)), LEFT_PRIMARIES, RIGHT_PRIMARIES)
    with pytest.raises(DeviceError, match=r"right eye sees .*red .*more than all"):
        check_leakage(Crosstalk(LEAK.left, 1.5 * np.eye(3)), LEFT_PRIMARIES, RIGHT_PRIMARIES)


def _with_grey(
    leaks: Crosstalk, seed: int = 0, noise: float = 0.0, repeats: int = 1, taken_over_black: bool = False
) -> list[CrosstalkReading]:
    """Readings as `display measure --set crosstalk` takes them: each colour over black and over a grey, and alone.

    Over black a negative leak has nothing to take, unless ``taken_over_black``.
    """
    rng = np.random.default_rng(seed)
    grey = {"black": [0, 0, 0], "grey": [0.46, 0.46, 0.46]}
    found = []
    for eye in EYES:
        primaries = LEFT_PRIMARIES if eye == "left" else RIGHT_PRIMARIES
        others, matrix = (RIGHT_PRIMARIES, leaks.left) if eye == "left" else (LEFT_PRIMARIES, leaks.right)
        pairs = [(own, other) for own in grey for other in COLOURS] + [(c, "black") for c in COLOURS if c != "black"]
        for own, other in dict.fromkeys(pairs):
            leaked = matrix @ (others @ COLOURS[other])
            if own == "black" and not taken_over_black:
                leaked = np.maximum(leaked, 0.0)
            light = BLACKS[eye] + primaries @ {**COLOURS, **grey}[own] + leaked
            for _ in range(repeats):
                x, y, z = (light * (1 + noise * rng.standard_normal(3)) + 1e-4 * rng.standard_normal(3)).tolist()
                left, right = (own, other) if eye == "left" else (other, own)
                found.append(CrosstalkReading(eye, left, right, (x, y, z)))
    return found


NEGATIVE = Crosstalk(
    LEFT_PRIMARIES @ np.diag([-0.02, -0.03, -0.04]) @ np.linalg.inv(RIGHT_PRIMARIES),
    RIGHT_PRIMARIES @ np.diag([0.02, 0.02, 0.03]) @ np.linalg.inv(LEFT_PRIMARIES),
)


def test_a_negative_leak_is_fitted_over_grey_where_black_has_no_light_to_take() -> None:
    fit = fit_crosstalk(_with_grey(NEGATIVE))
    assert fit.is_negative
    assert {leak.eye for leak in fit.shares if leak.negative} == {"left"}
    assert {leak.own for leak in fit.shares if leak.negative} == {"grey"}
    assert (fit.left.over_black_left_out, fit.right.over_black_left_out) == (4, 0)
    assert np.abs((fit.crosstalk.left - NEGATIVE.left) @ RIGHT_PRIMARIES).max() < 2e-3
    assert np.abs((fit.crosstalk.right - NEGATIVE.right) @ LEFT_PRIMARIES).max() < 2e-3
    check_leakage(fit.crosstalk, LEFT_PRIMARIES, RIGHT_PRIMARIES)
    white = next(leak for leak in fit.shares if (leak.eye, leak.own, leak.other) == ("left", "grey", "white"))
    assert white.share == pytest.approx(
        (NEGATIVE.left @ RIGHT_PRIMARIES.sum(axis=1))[1] / RIGHT_PRIMARIES[1].sum(), abs=1e-4
    )


def test_a_negative_leak_that_black_shows_too_is_fitted_by_all_readings() -> None:
    """Where black is bright enough to be dimmed, and black was subtracted, nothing is left out of an exact fit."""
    above = [
        replace(r, XYZ_cd_m2=tuple((np.array(r.XYZ_cd_m2) - BLACKS[r.eye]).tolist()))
        for r in _with_grey(NEGATIVE, taken_over_black=True)
    ]
    fit = fit_crosstalk(above, {"left": np.zeros(3), "right": np.zeros(3)})
    assert fit.is_negative
    assert np.abs((fit.crosstalk.left - NEGATIVE.left) @ RIGHT_PRIMARIES).max() < 2e-3


def test_the_error_of_a_leak_is_of_the_scatter_of_repeats() -> None:
    fit = fit_crosstalk(_with_grey(LEAK, noise=0.004, repeats=8))
    (leak,) = (one for one in fit.shares if (one.eye, one.own, one.other) == ("left", "grey", "white"))
    grey = 0.46 * LEFT_PRIMARIES[1].sum() / RIGHT_PRIMARIES[1].sum()
    assert leak.standard_error == pytest.approx(0.004 * np.sqrt((grey**2 + (grey + leak.share) ** 2) / 8), rel=0.2)


@pytest.mark.parametrize("repeats", [1, pytest.param(3, marks=pytest.mark.stress)])
def test_noise_around_no_crosstalk_is_not_called_negative(repeats: int) -> None:
    """At most 1 measurement in 100 is, where none leaks or all leaks are positive; noise as its check allows it."""
    found = [
        fit_crosstalk(_with_grey(leaks, seed, 0.005, repeats)).is_negative
        for seed in range(40)
        for leaks in (NONE, LEAK)
    ]
    # 80 measurements at 1 %: more than 4 have a chance of 2 in 1000.
    assert sum(found) <= 4


@pytest.mark.parametrize(
    ("noise", "repeats", "share"),
    [
        (0.002, 1, 0.02),
        pytest.param(0.001, 3, 0.01, marks=pytest.mark.nightly),
        pytest.param(0.005, 3, 0.02, marks=pytest.mark.nightly),
    ],
)
def test_a_planted_negative_leak_is_found(noise: float, repeats: int, share: float) -> None:
    planted = Crosstalk(-share * np.eye(3), np.zeros((3, 3)))
    found = [fit_crosstalk(_with_grey(planted, seed, noise, repeats)) for seed in range(40)]
    assert sum(fit.is_negative for fit in found) >= 38
    assert all(leak.eye == "left" for fit in found for leak in fit.shares if leak.negative)
    shares = [(fit.crosstalk.left @ RIGHT_PRIMARIES.sum(axis=1))[1] / RIGHT_PRIMARIES[1].sum() for fit in found]
    assert np.mean(shares) == pytest.approx(-share, abs=0.1 * share)


# Cancelling


def _pictures(models: EyeModels, low: float, high: float) -> tuple[Floats, Floats]:
    """Random colours in gamut, channels' linear light in low..high."""
    linear = np.random.default_rng(8).uniform(low, high, (2, 40, 30, 3))
    left, right = (
        model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T
        for model, light in zip((models.left, models.right), linear, strict=True)
    )
    return left, right


def _codes(models: EyeModels, linear: tuple[Floats, Floats]) -> list[Floats]:
    pairs = zip((models.left, models.right), linear, strict=True)
    return [
        np.stack([curve.code(light[..., i]) for i, curve in enumerate(model.curves)], axis=-1) for model, light in pairs
    ]


def _delta_e(model: DisplayModel, asked: Floats, seen: Floats) -> Floats:
    white = model.white_XYZ_cd_m2
    return delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(seen, white))


@pytest.mark.promise("crosstalk")
def test_the_loop_closes_where_there_is_light_to_subtract_from() -> None:
    """Asked, solved, as codes, sent, leaked, seen: exact without rounding, within rounding with it."""
    models = _models()
    asked = _pictures(models, 0.08, 0.9)
    cancelled = cancel_crosstalk(models, LEAK, *asked)
    for cost in (cancelled.left, cancelled.right):
        assert (cost.negative, cost.above_full) == (0, 0)
        assert cost.worst_residual_cd_m2 < 1e-12
        assert cost.delta_e_00_max < 1e-6
    exact = _codes(models, (cancelled.left_linear, cancelled.right_linear))
    rounded = [np.round(codes * 255) / 255 for codes in exact]
    plain = [
        np.round(model.code(xyz) * 255) / 255 for model, xyz in zip((models.left, models.right), asked, strict=True)
    ]
    for eye in (0, 1):
        model = (models.left, models.right)[eye]
        assert _delta_e(model, asked[eye], seen_XYZ(models, LEAK, *exact)[eye]).max() < 1e-6
        with_rounding = _delta_e(model, asked[eye], seen_XYZ(models, LEAK, *rounded)[eye])
        assert with_rounding.mean() < 0.15
        assert with_rounding.max() < 1.0
        assert _delta_e(model, asked[eye], seen_XYZ(models, LEAK, *plain)[eye]).mean() > 5 * with_rounding.mean()


@pytest.mark.parametrize("normalise", ["minimum", "centre"])
def test_the_loop_closes_on_an_uneven_panel(normalise: Normalise) -> None:
    """Divide by the gain, cancel, send: the panel dims what both eyes get, black included."""
    models = _models()
    gain_map = GainMap(np.array([[0.7, 0.9], [0.8, 1.1]]), (30, 40), "corners", normalise)
    gain = gain_map.over(np.arange(30) + 0.5, np.arange(40) + 0.5)
    asked = _pictures(models, 0.2, 0.5)
    left, right = (gain_map.corrected(xyz, gain) for xyz in asked)
    cancelled = cancel_crosstalk(models, LEAK, left, right)
    assert (cancelled.left.negative, cancelled.right.above_full) == (0, 0)
    seen = seen_XYZ(models, LEAK, *_codes(models, (cancelled.left_linear, cancelled.right_linear)))
    for xyz, found in zip(asked, seen, strict=True):
        assert np.abs(gain[..., None] * found - gain_map.delivered_share * xyz).max() < 1e-9


@pytest.mark.promise("crosstalk")
def test_a_ghost_on_black_is_clipped_counted_and_costed() -> None:
    models = _models()
    black, white = models.left.black_XYZ_cd_m2, models.right.white_XYZ_cd_m2
    left = np.broadcast_to(black, (10, 3)).copy()
    right = np.broadcast_to(models.right.black_XYZ_cd_m2, (10, 3)).copy()
    right[:3] = white
    cancelled = cancel_crosstalk(models, LEAK, left, right)
    assert (cancelled.left.pixels, cancelled.left.negative, cancelled.right.negative) == (10, 3, 0)
    assert cancelled.left.percent_negative == pytest.approx(30.0)
    # Nothing can be taken away, so the whole leak of white stays; the right eye gets exactly its white.
    ghost = LEAK.left @ RIGHT_PRIMARIES.sum(axis=1)
    assert cancelled.left.worst_residual_cd_m2 == pytest.approx(ghost.max(), rel=1e-9)
    expected = float(_delta_e(models.left, black, black + ghost))
    assert cancelled.left.delta_e_00_max == pytest.approx(expected, rel=1e-9)
    assert cancelled.left.delta_e_00_mean == pytest.approx(0.3 * expected, rel=1e-9)
    assert cancelled.right_linear[:3] == pytest.approx(1.0, abs=1e-12)
    assert cancelled.right.worst_residual_cd_m2 < 1e-12
    assert cancelled.left.to_json()["percent_negative"] == 30.0


def test_an_eye_that_loses_light_to_the_other_gets_it_back_as_far_as_full_drive() -> None:
    """What is asked for is seen wherever light can be added; the brightest it can have is white less the leak."""
    models = _models()
    left, right = _pictures(models, 0.0, 0.9)
    cancelled = cancel_crosstalk(models, NEGATIVE, left, right)
    assert cancelled.left.negative == 0
    for cost in (cancelled.left, cancelled.right):
        assert cost.worst_residual_cd_m2 < 1e-2 or cost.negative > 0
    codes = _codes(models, (cancelled.left_linear, cancelled.right_linear))
    seen = seen_XYZ(models, NEGATIVE, *codes)
    assert np.abs(seen[0] - left).max() < 1e-2 * models.left.white_XYZ_cd_m2[1]
    # Without it the left eye would see so much less.
    plain = seen_XYZ(models, NEGATIVE, models.left.code(left), models.right.code(right))
    assert (left - plain[0])[..., 1].max() > 0.02 * models.left.white_XYZ_cd_m2[1]
    # White in both eyes: the left eye cannot have it, and that is counted as above full, at what it costs.
    whites = models.left.white_XYZ_cd_m2[np.newaxis], models.right.white_XYZ_cd_m2[np.newaxis]
    full = cancel_crosstalk(models, NEGATIVE, *whites)
    assert (full.left.above_full, full.left.negative, full.right.above_full) == (1, 0, 0)
    assert full.left_linear == pytest.approx(1.0)
    loss = -(NEGATIVE.left @ (RIGHT_PRIMARIES @ full.right_linear[0]))
    assert full.left.worst_residual_cd_m2 == pytest.approx(loss.max(), rel=1e-9)
    assert full.left.delta_e_00_max > 0.5
    reach = models.left.white_XYZ_cd_m2 - loss
    held = cancel_crosstalk(models, NEGATIVE, reach[np.newaxis], whites[1])
    assert held.left.above_full == 0
    assert held.left.worst_residual_cd_m2 < 1e-9


def test_what_could_not_be_cancelled_is_what_applying_reports() -> None:
    models, view = _models(), EyeView(Rectangle(0, 0, 40, 30))
    left, right = _pictures(models, 0.0, 0.9)
    pictures = left.astype(np.float32), right.astype(np.float32)
    plain = Compensation(models, {"left": view, "right": view})
    assert (plain.uncancelled(pictures), plain.apply(pictures)) == ({}, (pictures, {}))
    cancelling = replace(plain, correction=Correction(LEAK))
    sent, report = cancelling.apply(pictures)
    assert cancelling.uncancelled(pictures) == report
    done = cancel_crosstalk(models, LEAK, *pictures)
    for eye, light, linear, cost in zip(
        EYES, sent, (done.left_linear, done.right_linear), (done.left, done.right), strict=True
    ):
        assert models.eye(eye).linear(light) == pytest.approx(linear, abs=1e-5)
        assert report[eye] == cost.to_json()
    assert report["left"]["percent_negative"] > 0


def test_channels_that_act_on_each_other_are_not_lifted(monkeypatch: pytest.MonkeyPatch) -> None:
    models = _models()
    left, right = _pictures(models, 0.2, 0.8)
    monkeypatch.setattr(DisplayModel, "additive", False)
    with pytest.raises(DeviceError, match="cannot be lifted"):
        cancel_crosstalk(models, LEAK, left, right, 0.1)
    cancel_crosstalk(models, LEAK, left, right)
    for lift in (-0.1, 1.1):
        with pytest.raises(DeviceError):
            cancel_crosstalk(_models(), LEAK, left, right, lift)


def test_a_negative_leak_needs_no_lift() -> None:
    models = _models()
    only = Crosstalk(NEGATIVE.left, np.zeros((3, 3)))
    left, right = _pictures(models, -0.05, 0.8)
    assert needed_lift(models, only, left, right) == pytest.approx(0.0, abs=1e-12)
    assert cancel_crosstalk(models, only, left, right).left.negative == 0


def test_the_second_look_at_the_clipped_eye_leaves_less() -> None:
    models = _models()
    left, right = _pictures(models, -0.2, 1.0)
    cancelled = cancel_crosstalk(models, LEAK, left, right)
    mix = channel_crosstalk(models, LEAK)
    wanted = [np.clip(m.linear(xyz), 0, 1) for m, xyz in ((models.left, left), (models.right, right))]
    once = [np.clip(light, 0, 1) for light in mix.solve(*wanted)]
    seen_once, seen_twice = mix.seen(*once), mix.seen(cancelled.left_linear, cancelled.right_linear)
    for eye in (0, 1):
        error = [np.abs(seen[eye] - wanted[eye]) for seen in (seen_once, seen_twice)]
        untouched = (cancelled.left_linear, cancelled.right_linear)[eye] > 0
        assert error[1].mean() < error[0].mean()
        assert error[1][untouched].max() < 0.06**2 * 0.2
        assert error[0][untouched].max() > 0.06**2 * 0.2


def test_lifting_by_just_what_is_needed_leaves_nothing_to_clip() -> None:
    models = _models()
    left, right = _pictures(models, -0.05, 0.8)
    lift = needed_lift(models, LEAK, left, right)
    assert 0 < lift < 0.08
    lifted = cancel_crosstalk(models, LEAK, left, right, lift)
    assert (lifted.left.negative, lifted.right.negative, lifted.left.above_full) == (0, 0, 0)
    assert max(lifted.left.worst_residual_cd_m2, lifted.right.worst_residual_cd_m2) < 1e-12
    less = cancel_crosstalk(models, LEAK, left, right, 0.999 * lift)
    assert less.left.negative + less.right.negative >= 1
    # What is seen is what was asked, in gamut, plus that share of each eye's white.
    seen = seen_XYZ(models, LEAK, *_codes(models, (lifted.left_linear, lifted.right_linear)))
    for model, asked, found in ((models.left, left, seen[0]), (models.right, right, seen[1])):
        in_gamut = np.clip(model.linear(asked), 0, 1) + lift
        assert found == pytest.approx(model.black_XYZ_cd_m2 + in_gamut @ model.primaries_XYZ_cd_m2.T, abs=1e-9)


def test_what_the_lift_pushes_beyond_white_is_counted() -> None:
    models = _models()
    left = np.linspace(0.5, 1.0, 11)[:, None] * (models.left.white_XYZ_cd_m2 - BLACKS["left"]) + BLACKS["left"]
    right = np.linspace(0.5, 1.0, 11)[:, None] * (models.right.white_XYZ_cd_m2 - BLACKS["right"]) + BLACKS["right"]
    assert cancel_crosstalk(models, LEAK, left, right).left.above_full == 0
    lifted = cancel_crosstalk(models, LEAK, left, right, 0.12)
    assert (lifted.left.above_full, lifted.right.above_full) == (3, 3)  # 0.9, 0.95 and 1
    assert lifted.left.to_json()["percent_above_full"] == pytest.approx(27.2727)


def test_pictures_that_need_no_lift_get_none() -> None:
    models = _models()
    assert needed_lift(models, LEAK, *_pictures(models, 0.1, 0.9)) == 0.0
    assert needed_lift(models, NONE, *_pictures(models, -0.1, 0.9)) == 0.0


def test_without_crosstalk_cancelling_is_the_plain_model() -> None:
    model = read_display(ASUS).models("side-by-side").left
    models = EyeModels(model, model)
    left, right = _pictures(models, -0.1, 1.1)
    cancelled = cancel_crosstalk(models, NONE, left, right)
    for xyz, linear in ((left, cancelled.left_linear), (right, cancelled.right_linear)):
        assert np.abs(_codes(models, (linear, linear))[0] - model.code(xyz)).max() < 1e-12
    assert (cancelled.left.negative, cancelled.left.worst_residual_cd_m2) == (0, 0.0)


def test_what_is_wrong_with_the_pictures_or_the_lift_is_said() -> None:
    models = _models()
    good = np.ones((2, 3))
    with pytest.raises(DeviceError, match="1 values of the picture are not finite"):
        cancel_crosstalk(models, LEAK, good, np.array([[np.nan, 1, 1], [1, 1, 1]]))
    with pytest.raises(DeviceError, match="expected one"):
        cancel_crosstalk(models, LEAK, good, np.ones((3, 3)))
    with pytest.raises(DeviceError, match=r"the lift is 1.5"):
        cancel_crosstalk(models, LEAK, good, good, 1.5)


def test_half_floats_make_no_light_that_cannot_be_taken_off() -> None:
    """A left picture of just the light that leaks needs channels to give none: half floats round half of it below."""
    models = _models()
    mix = channel_crosstalk(models, LEAK)
    right = np.random.default_rng(8).uniform(0.2, 0.9, (2_000, 3))
    left = right @ mix.left.T
    dark, bright = (
        models.left.xyz_of_linear(left).astype(np.float16),
        models.right.xyz_of_linear(right).astype(np.float16),
    )
    assert cancel_crosstalk(models, LEAK, dark, bright).left.negative > 500
    assert cancel_crosstalk(models, LEAK, dark, bright, half=True).left.negative == 0
    # What is darker than the leak by more than rounding is missed with half floats too.
    darker = models.left.xyz_of_linear(0.8 * left).astype(np.float16)
    assert cancel_crosstalk(models, LEAK, darker, bright, half=True).left.negative == 2_000


@pytest.mark.parametrize(("left_own", "right_own", "wrong"), [(2, 98, "left"), (98, 2, "right"), (98, 98, "")])
def test_a_wrong_lens_is_no_crosstalk(left_own: float, right_own: float, wrong: str) -> None:
    """One eye was read through the other's lens: it passes all of the other eye's white, and a little of its own."""
    colours = np.array([95.0, 100.0, 109.0]) / 100
    rows = []
    for eye, own in (("left", left_own), ("right", right_own)):
        for mine, light in (("white", own), ("black", 100 - own)):
            left, right = (mine, "black" if mine == "white" else "white")[:: 1 if eye == "left" else -1]
            rows.append(CrosstalkReading(eye, left, right, tuple(light * colours)))  # type: ignore[arg-type]  # three
    none: dict[Eye, Floats] = {"left": np.zeros(3), "right": np.zeros(3)}
    if not wrong:
        assert fit_crosstalk(rows, none).crosstalk.left[1, 1] == pytest.approx(2 / 98)
        return
    with pytest.raises(DeviceError, match=f"put the {wrong} eye's lens before the instrument"):
        fit_crosstalk(rows, none)
