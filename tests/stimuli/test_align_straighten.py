"""Roll and scale between the cameras of a pair: measured from vertical disparities, and undone."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from documents.arrays import Floats32
from stimuli.align import align_pair, measure_disparity, straighten
from stimuli.align.roll_scale import fit_roll_scale
from stimuli.errors import StimulusError

SIDE = 288
# What interpolating between the rounds adds to noise: a hundredth of a pixel at the edge.
ROUNDS_DEG = float(np.degrees(0.01 / (SIDE / 2)))


@cache
def view(
    roll_deg: float = 0.0,
    scale: float = 1.0,
    shift: tuple[float, float] = (0.0, 0.0),
    *,
    depth_px: float = 0.0,
    noise: float = 0.0,
    seed: int = 0,
) -> Floats32:
    """Return sparkles as a camera sees them that is turned clockwise, enlarges and is shifted, about the middle.

    ``depth_px`` scatters their places across, as flakes at several depths would; each is integrated over pixels.
    """
    rng = np.random.default_rng(7)
    count = SIDE**2 // 80
    places = rng.uniform(-60, SIDE + 60, (2, count)) - (SIDE - 1) / 2
    light = rng.lognormal(0.0, 0.7, count) * 20.0
    angle = np.radians(roll_deg)
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x, y = turn @ places + (SIDE - 1) / 2 + np.array(shift)[:, None]
    x = x + depth_px * np.random.default_rng(8).normal(size=count)
    edges = np.arange(SIDE + 1) - 0.5
    across, down = (np.diff(ndtr((edges - place[:, None]) / 0.9), axis=1) for place in (x, y))
    plane = 3.6 + (down * light[:, None]).T @ across
    plane += noise * plane.max() * np.random.default_rng(seed).normal(size=plane.shape)
    picture = np.repeat(plane[:, :, None], 3, axis=2).astype(np.float32)
    picture.setflags(write=False)
    return picture


@pytest.mark.parametrize(
    ("roll_deg", "scale", "shift"),
    [
        (-0.5, 0.998, (25.2, 1.2)),
        pytest.param(1.5, 1.01, (40.0, 3.0), marks=pytest.mark.nightly),
    ],
)
def test_a_known_roll_and_scale_come_back_and_are_undone(
    roll_deg: float, scale: float, shift: tuple[float, float]
) -> None:
    left, right = view(noise=0.01, seed=1), view(roll_deg, scale, shift, noise=0.01, seed=2)
    made = straighten(left, right)
    assert made.applied
    assert made.roll_scale.roll_deg == pytest.approx(roll_deg, abs=max(4 * made.roll_scale.roll_se_deg, ROUNDS_DEG))
    assert made.roll_scale.scale == pytest.approx(scale, abs=max(4 * made.roll_scale.scale_se, 3e-5))
    assert made.roll_scale.roll_se_deg < 0.01
    aligned = align_pair(made.left, made.right)
    assert aligned.shift_px == pytest.approx(shift[0], abs=0.4)  # each view is turned about its own middle by half
    left_over = aligned.disparity.vertical["px"]
    assert max(abs(left_over.low), abs(left_over.high)) < 0.1
    assert json.loads(json.dumps(made.steps)) == [dict(one) for one in made.steps]


def test_depth_and_noise_are_taken_for_no_roll() -> None:
    left, right = view(noise=0.01, seed=3), view(depth_px=0.5, noise=0.01, seed=4)
    made = straighten(left, right)
    assert not made.applied
    np.testing.assert_array_equal(made.left, left)
    np.testing.assert_array_equal(made.right, right)
    assert made.crop == (0, 0, SIDE, SIDE)
    assert made.roll_scale.roll_deg == pytest.approx(0.0, abs=4 * made.roll_scale.roll_se_deg)


@settings(max_examples=40, deadline=None)
@given(
    roll=st.floats(-0.01, 0.01), growth=st.floats(-0.01, 0.01), middle=st.floats(-3, 3), seed=st.integers(0, 2**32 - 1)
)
def test_a_few_blocks_that_are_wrong_draw_nothing(roll: float, growth: float, middle: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(0, [600, 400], (60, 2))
    from_middle = places - (299.5, 199.5)
    vertical = middle + roll * from_middle[:, 0] + growth * from_middle[:, 1]
    vertical[:6] += rng.uniform(-16, 16, 6)
    found = fit_roll_scale(places, vertical, (600, 400))
    assert found is not None
    assert np.radians(found.roll_deg) == pytest.approx(np.arctan2(roll, 1 + growth), abs=2e-4)
    assert found.scale == pytest.approx(np.hypot(1 + growth, roll), abs=2e-4)


def test_a_shift_can_be_given() -> None:
    left, right = view(), view(0.4, shift=(45.0, 0.5))
    made = straighten(left, right, offset_px=(43.0, 1.0))
    assert made.roll_scale.roll_deg == pytest.approx(0.4, abs=ROUNDS_DEG)
    with pytest.raises(StimulusError, match="too little in common"):
        straighten(left, right, offset_px=(280.0, 0.0))


def test_what_tells_nothing_is_none() -> None:
    row = np.column_stack([np.arange(32.0, 700, 64), np.full(11, 100.0)])
    assert fit_roll_scale(row, np.zeros(11), (704, 200)) is None
    assert fit_roll_scale(row[:5], np.zeros(5), (704, 200)) is None
    assert measure_disparity(view()[:64], view()[:64]).roll_scale is None


def test_what_cannot_be_straightened_is_refused() -> None:
    noise = np.random.default_rng(1)
    left, right = (noise.normal(10, 1, (SIDE, SIDE, 3)).astype(np.float32) for _ in range(2))
    with pytest.raises(StimulusError, match=r"nothing in common|agree in too few"):
        straighten(left, right)
    strip = slice(100, 180)
    with pytest.raises(StimulusError, match="blocks have a vertical disparity") as caught:
        straighten(view()[strip], view(0.1)[strip])
    assert caught.value.findings[0].remedy
    with pytest.raises(StimulusError, match=r"differ|size"):
        straighten(view(), view()[1:])
    with pytest.raises(StimulusError, match="one channel"):
        straighten(view()[..., 0], view()[..., 0])


def test_the_report_of_an_aligned_pair_tells_roll_and_scale() -> None:
    found = align_pair(view(), view(0.2, 1.001)).disparity.roll_scale
    assert found is not None
    assert found.certain
    assert found.roll_deg == pytest.approx(0.2, abs=4 * found.roll_se_deg)
    assert found.scale == pytest.approx(1.001, abs=4 * found.scale_se)
    assert found.roll_se_deg < 0.02
    assert found.corner_px == pytest.approx(np.radians(0.2) * (SIDE - 1) / 2 + 0.001 * (SIDE - 1) / 2, rel=0.1)


@pytest.mark.nightly
def test_swapping_the_eyes_turns_the_roll_round() -> None:
    left, right = view(), view(0.4, 1.003, (5.0, 0.5))
    one, other = straighten(left, right), straighten(right, left)
    assert one.roll_scale.roll_deg == pytest.approx(-other.roll_scale.roll_deg, abs=1e-3)
    assert one.roll_scale.scale == pytest.approx(1 / other.roll_scale.scale, abs=1e-5)
    assert np.abs(one.left - other.right).max() < 0.02 * left.max()


@pytest.mark.nightly
def test_large_views_are_averaged_to_measure(monkeypatch: pytest.MonkeyPatch) -> None:
    left, right = view(), view(0.4, 1.002, (6.0, 1.0))
    whole = straighten(left, right).roll_scale
    monkeypatch.setattr("stimuli.align.straightening.MOST_PIXELS", SIDE**2 // 4)
    monkeypatch.setattr("stimuli.align.straightening.BLOCK_PX", 36)
    halved = straighten(left, right, offset_px=(6.0, 1.0), region=(0, 0, SIDE, SIDE))
    assert halved.roll_scale.blocks <= 16  # of 36 averaged pixels
    assert halved.roll_scale.roll_deg == pytest.approx(0.4, abs=5 * ROUNDS_DEG)
    assert halved.roll_scale.corner_px == pytest.approx(whole.corner_px, rel=0.05)
    assert halved.left.shape == straighten(left, right).left.shape


def test_views_that_agree_to_the_last_bit_are_level_and_one_wrong_block_is_not_believed() -> None:
    places = np.stack(np.meshgrid(np.arange(32.0, 600, 64), np.arange(32.0, 400, 64)), axis=-1).reshape(-1, 2)
    vertical = np.full(len(places), 2.0)
    level = fit_roll_scale(places, vertical, (600, 400))
    assert level is not None
    assert (level.roll_deg, level.scale, level.middle_px) == pytest.approx((0, 1, 2), abs=1e-9)
    vertical[3] += 5
    one_wrong = fit_roll_scale(places, vertical, (600, 400))
    assert one_wrong is not None
    assert (one_wrong.roll_deg, one_wrong.scale, one_wrong.middle_px) == pytest.approx((0, 1, 2), abs=1e-6)
