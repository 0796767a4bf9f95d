"""Compiled loops against their twins in NumPy: five million pairs of colours, sparkles of every density, shifts."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import delta_e_2000, delta_e_2000_of_xyz
from stimuli.align import warp
from tests.compiled_loops import not_in_numpy
from tests.stimuli.sparkle_measures.test_sparkle_measures import assert_like_the_twin, both, planted

pytestmark = pytest.mark.stress

COLOURS = 1_000_000
WHITE = np.array([96.4, 100.0, 82.5])


def lab_pairs(kind: str, rng: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pairs of CIELAB: anywhere, near each other, opposite in hue, or with chroma from nothing to beyond colours."""
    first = rng.uniform([0, -130, -130], [110, 130, 130], (COLOURS, 3))
    if kind == "anywhere":
        return first, rng.permutation(first)
    if kind == "near":
        return first, first + rng.normal(0, 10.0 ** rng.uniform(-9, 1, (COLOURS, 1)), first.shape)
    if kind == "opposite":
        second = first * rng.uniform([0.9, -2, -2], [1.1, 0, 0], (COLOURS, 3))
        second[:, 2] = second[:, 1] * first[:, 2] / first[:, 1] * (1 + rng.normal(0, 1e-3, COLOURS))
        return first, second
    wide = 10.0 ** rng.uniform(-90, 55, (2, COLOURS, 1)) * [0, 1, 1] + [1, 0, 0]
    return first * wide[0], rng.permutation(first) * wide[1]


@pytest.mark.parametrize("kind", ["anywhere", "near", "opposite", "wide"])
def test_differences_of_lab(kind: str) -> None:
    first, second = lab_pairs(kind, np.random.default_rng(1))
    slow = delta_e_2000(first, second)
    with not_in_numpy("devices.colour.ciede2000_loops"):
        fast = delta_e_2000(first, second)
    np.testing.assert_allclose(fast, slow, rtol=1e-10, atol=1e-10)


def test_differences_of_xyz_from_the_dark_to_the_sun() -> None:
    rng = np.random.default_rng(2)
    first = 10.0 ** rng.uniform(-9, 9, (COLOURS, 1)) * rng.uniform(0.2, 1.0, (COLOURS, 3))
    second = first * (1 + rng.normal(0, 0.2, first.shape))
    slow = delta_e_2000_of_xyz(first, second, WHITE)
    with not_in_numpy("devices.colour.ciede2000_loops"):
        fast = delta_e_2000_of_xyz(first, second, WHITE)
    np.testing.assert_allclose(fast, slow, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("seed", range(12))
def test_sparkles_of_every_density_and_width(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, size = int(10.0 ** rng.uniform(1, 3.5)), tuple(int(side) for side in rng.integers(150, 420, 2))
    places = rng.uniform(-3, np.array(size) + 3, (count, 2))
    light, width = 10.0 ** rng.uniform(1.5, 3.5, count), rng.uniform(0.4, 1.0 + 1.5 * rng.random(), count)
    assert_like_the_twin(*both(planted((size[0], size[1]), places, light, width, noise=rng.choice([0.0, 0.2, 1.0]))))


@pytest.mark.parametrize("seed", range(20))
def test_shifts_by_any_amount(seed: int) -> None:
    rng = np.random.default_rng(seed)
    light = rng.exponential(5.0, (*rng.integers(5, 200, 2), 3)).astype(np.float32)
    x, y = rng.uniform(-250, 250, 2) * rng.choice([1e-3, 0.1, 1.0], 2)
    matrix, size = np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]]), (int(rng.integers(1, 250)), 120)
    slow = warp(light, matrix, size)
    with not_in_numpy("stimuli.align.warping_loops"):
        fast = warp(light, matrix, size)
    np.testing.assert_allclose(fast.picture, slow.picture, rtol=0, atol=2e-6 * float(light.max()))
