"""Landolt rings have the size that they should, at any size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from stimuli.vision_tests import SIDES, Side, landolt
from stimuli.vision_tests.optotypes import in_ring, ring_coverage

# Of a ring with gap 1: from radius 1.5 to 2.5, less what a strip of width 1 cuts out of it on one side.
_CHORD = [0.5 * (0.5 * np.sqrt(radius**2 - 0.25) + radius**2 * np.arcsin(0.5 / radius)) * 2 for radius in (1.5, 2.5)]
AREA = np.pi * (2.5**2 - 1.5**2) - (_CHORD[1] - _CHORD[0])


@settings(max_examples=5, deadline=None)
@given(st.floats(1.0, 30.0), st.sampled_from(SIDES))
def test_it_covers_the_area_that_it_should(gap_px: float, side: Side) -> None:
    assert ring_coverage(gap_px, side).sum() == pytest.approx(AREA * gap_px**2, rel=0.005)


def test_a_pixel_is_covered_as_a_finer_count_says() -> None:
    covered = ring_coverage(2.3, "down")
    count, fine = len(covered), 100
    places = (np.arange(count * fine) + 0.5) / fine - count / 2
    slow = np.array(
        [
            [
                in_ring(
                    places[None, column * fine : (column + 1) * fine],
                    places[row * fine : (row + 1) * fine, None],
                    2.3,
                    "down",
                ).mean()
                for column in range(count)
            ]
            for row in range(count)
        ]
    )
    assert np.abs(covered - slow).max() < 0.02


def test_the_picture_is_dark_on_light_and_alike_for_both_eyes() -> None:
    ground, ring = np.array([19.0, 20.0, 23.0]), np.array([0.4, 0.5, 0.6])
    image = landolt(3.0, "up", 60, ground, ring)
    assert image.is_flat
    assert image.left.shape == (61, 61, 3)
    assert image.left[0, 0] == pytest.approx(ground, rel=1e-6)
    assert image.left.min(axis=(0, 1)) == pytest.approx(ring, rel=1e-5)
    dark = (ground - image.left.astype(np.float64)).sum(axis=(0, 1)) / (ground - ring)
    assert dark == pytest.approx([AREA * 9] * 3, rel=0.005)


@pytest.mark.nightly
@settings(max_examples=10, deadline=None)
@given(st.floats(1.0, 12.0))
@example(3.2)  # places of a finer grid lie on the ring's edges
def test_the_four_are_one_turned(gap_px: float) -> None:
    up, down, left, right = (ring_coverage(gap_px, side) for side in SIDES)
    assert np.array_equal(np.flipud(up), down)
    assert np.array_equal(np.fliplr(left), right)
    assert np.array_equal(up.T, left)


def test_at_the_smallest_size_the_gap_is_a_pixel() -> None:
    covered = ring_coverage(1.0, "right")
    middle = len(covered) // 2
    assert covered[middle, middle + 2] < 0.05
    for other in ((0, -2), (2, 0), (-2, 0)):
        assert covered[middle + other[0], middle + other[1]] > 0.95
