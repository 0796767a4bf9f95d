"""The fast terms of CIEDE2000 against their slow twin, the paper's equations in whole arrays."""

from __future__ import annotations

import numpy as np
import pytest

from devices.colour import delta_e_2000, delta_e_2000_of_xyz, delta_e_2000_parts, xyz_to_lab
from devices.colour.ciede2000 import GAUSSIAN_16TH, plain_terms
from documents.arrays import Floats
from tests.compiled_loops import compiled_if_there, not_in_numpy
from tests.devices.colour.plain import plain_delta_e

NAMES = ("delta_L", "delta_C", "delta_H", "S_L", "S_C", "S_H", "R_T")


def assert_like_the_twin(first: Floats, second: Floats) -> None:
    """Every term, and ΔE00, to 1e-11, or to that share of it where chroma is beyond all colours."""
    terms = plain_terms(tuple(first.T), tuple(second.T))
    fast = delta_e_2000_parts(first, second)
    for name, expected in zip(NAMES, terms, strict=True):
        np.testing.assert_allclose(getattr(fast, name), expected, rtol=1e-11, atol=1e-11, err_msg=name)
    plain = plain_delta_e(*terms)
    np.testing.assert_allclose(fast.delta_e, plain, rtol=1e-11, atol=1e-11)
    with compiled_if_there():
        np.testing.assert_allclose(delta_e_2000(first, second), plain, rtol=1e-11, atol=1e-11)


def colours(rng: np.random.Generator, hue: Floats, chroma: Floats) -> Floats:
    return np.column_stack([rng.uniform(0, 100, len(hue)), chroma * np.cos(hue), chroma * np.sin(hue)])


def test_random_pairs_and_pairs_close_together() -> None:
    rng = np.random.default_rng(0)
    first, second = rng.uniform([0, -120, -120], [100, 120, 120], (2, 4000, 3))
    assert_like_the_twin(first, second)
    assert_like_the_twin(first, first + rng.normal(0, 0.5, first.shape))


@pytest.mark.parametrize("away", [0.0, 1e-15, 1e-12, 1e-9, 1e-4, 0.2, 0.44, 0.46])
def test_hues_that_are_nearly_opposite(away: float) -> None:
    rng = np.random.default_rng(1)
    hue, chroma = rng.uniform(-np.pi, np.pi, 2000), rng.uniform(0.1, 100, (2, 2000))
    # Below the chroma where the paper stretches a*, to keep opposite hues opposite, both have the same stretch anyway.
    first = colours(rng, hue, chroma[0])
    second = colours(rng, hue, -chroma[1])
    turned = colours(rng, hue + away, -chroma[1])
    assert_like_the_twin(first, turned if away else second)


def test_neutral_colours_and_mean_hues_of_zero() -> None:
    rng = np.random.default_rng(2)
    hue, chroma = rng.uniform(-np.pi, np.pi, 2000), rng.uniform(0, 90, 2000)
    some, mirrored = colours(rng, hue, chroma), colours(rng, hue, chroma)
    mirrored[:, 1:] = some[:, 1:] * [1.0, -1.0]
    neutral = some * [1.0, 0.0, -0.0]
    assert_like_the_twin(some, neutral)
    assert_like_the_twin(neutral, some)
    assert_like_the_twin(neutral, neutral[::-1])
    # Mean hues of exactly 0° and 180°: the paper's Gaussian has a step at 0°.
    assert_like_the_twin(some, mirrored)


@pytest.mark.parametrize("chroma", [1e-60, 1e-20, 1e-9, 1e9, 1e59, 1e61, 1e120])
def test_chroma_so_small_or_large_that_its_powers_are_no_numbers(chroma: float) -> None:
    rng = np.random.default_rng(3)
    first, second = (colours(rng, rng.uniform(-3, 3, 500), chroma * rng.uniform(0.5, 2, 500)) for _ in range(2))
    assert_like_the_twin(first, second)
    plain = colours(rng, rng.uniform(-3, 3, 500), rng.uniform(1, 100, 500))
    assert_like_the_twin(first, plain)
    assert_like_the_twin(plain, second)


@pytest.mark.parametrize("chroma", [5e-324, 1e-300, 1e-200, 1e-150, 1e-110])
def test_chroma_as_good_as_none_has_no_hue(chroma: float) -> None:
    rng = np.random.default_rng(3)
    faint = colours(rng, rng.uniform(-3, 3, 500), chroma * rng.uniform(0.5, 2, 500))
    neutral, some = faint * [1.0, 0.0, 0.0], colours(rng, rng.uniform(-3, 3, 500), rng.uniform(1, 100, 500))
    for one, other in ((neutral, some), (some, neutral), (neutral, neutral)):
        expected = plain_terms(tuple(one.T), tuple(other.T))
        found = delta_e_2000_parts(faint if one is neutral else one, faint if other is neutral else other)
        for name, values in zip(NAMES, expected, strict=True):
            np.testing.assert_allclose(getattr(found, name), values, rtol=0.0, atol=1e-11, err_msg=name)


def test_a_broken_pixel_changes_no_other_colour_of_its_block() -> None:
    first, second = np.random.default_rng(4).uniform([0, -90, -90], [100, 90, 90], (2, 1000, 3))
    alone = delta_e_2000(first, second)
    first[10], first[20, 1] = [50.0, 1e200, 1e-200], np.nan
    kept = np.setdiff1d(np.arange(1000), [10, 20])
    with np.errstate(over="ignore", invalid="ignore"):
        found = delta_e_2000(first, second)
    np.testing.assert_array_equal(found[kept], alone[kept])
    assert np.isnan(found[20])


def test_the_polynomial_is_the_gaussian() -> None:
    angle = np.linspace(0.0, 180.0, 20_001)
    square = np.sin(np.radians(angle) / 4.0) ** 2
    power = np.polynomial.Polynomial(GAUSSIAN_16TH)(square) ** 16
    np.testing.assert_allclose(power, np.exp(-((angle / 25.0) ** 2)), rtol=0.0, atol=5e-14)


def test_compiled_differences_of_xyz_are_those_of_numpy() -> None:
    """Also of dark and negative light, of the same colours, and of light beyond what single precision holds."""
    rng = np.random.default_rng(5)
    white = np.array([96.4, 100.0, 82.5])
    first = rng.uniform(0, 100, (50_000, 3))
    second = first * rng.uniform(0.5, 1.5, first.shape)
    first[::11] *= 1e-4
    second[::7] = first[::7]
    first[::13], second[1::13] = 0.0, -3.0
    first[5], second[6], first[7], second[8] = 1e40, 1e120, -1e120, 1e-300
    first[9, 1] = np.nan
    slow = delta_e_2000_of_xyz(first, second, white)
    with not_in_numpy("devices.colour.ciede2000_loops"):
        fast = delta_e_2000_of_xyz(first, second, white)
    np.testing.assert_allclose(fast, slow, rtol=1e-11, atol=1e-11)
    assert np.isnan(fast[9])
    np.testing.assert_allclose(slow[20:], delta_e_2000(*xyz_to_lab([first[20:], second[20:]], white)), atol=1e-11)


def test_parts_of_a_large_picture_are_done_as_the_whole_is() -> None:
    """Without this, the last bits of a pixel would depend on how the picture was cut."""
    rng = np.random.default_rng(6)
    first, second = rng.uniform(0, 100, (2, 1000, 3))
    white = np.array([96.4, 100.0, 82.5])
    with not_in_numpy("devices.colour.ciede2000_loops", from_pixels=1000):
        whole = delta_e_2000_of_xyz(first, second, white)
        parts = [
            delta_e_2000_of_xyz(first[k : k + 100], second[k : k + 100], white, of=1000) for k in range(0, 1000, 100)
        ]
    assert np.array_equal(np.concatenate(parts), whole)
