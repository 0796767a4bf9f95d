"""CIEDE2000 and its terms against published pairs, colour-science, and slow twins."""

from __future__ import annotations

from collections.abc import Callable

import colour
import numpy as np
import pytest
from colour.difference.delta_e import intermediate_attributes_CIE2000
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from devices.colour import delta_e_2000, delta_e_2000_of_xyz, delta_e_2000_parts, xyz_to_lab
from devices.colour.ciede2000 import GAUSSIAN_16TH, plain_terms
from devices.errors import DeviceError
from documents.arrays import Floats
from tests.compiled_loops import compiled_if_there, not_in_numpy
from tests.devices.colour.plain import plain_delta_e

# CIEDE2000 against every pair that its authors published, colour-science, and a slow twin; its terms likewise.

# Sharma, Wu & Dalal 2005, Table 1: L, a, b of the pair, and ΔE00 to four decimals.
SHARMA = np.array(
    [
        [50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425],
        [50, 3.1571, -77.2803, 50, 0, -82.7485, 2.8615],
        [50, 2.8361, -74.0200, 50, 0, -82.7485, 3.4412],
        [50, -1.3802, -84.2814, 50, 0, -82.7485, 1.0000],
        [50, -1.1848, -84.8006, 50, 0, -82.7485, 1.0000],
        [50, -0.9009, -85.5211, 50, 0, -82.7485, 1.0000],
        [50, 0, 0, 50, -1, 2, 2.3669],
        [50, -1, 2, 50, 0, 0, 2.3669],
        [50, 2.4900, -0.0010, 50, -2.4900, 0.0009, 7.1792],
        [50, 2.4900, -0.0010, 50, -2.4900, 0.0010, 7.1792],
        [50, 2.4900, -0.0010, 50, -2.4900, 0.0011, 7.2195],
        [50, 2.4900, -0.0010, 50, -2.4900, 0.0012, 7.2195],
        [50, -0.0010, 2.4900, 50, 0.0009, -2.4900, 4.8045],
        [50, -0.0010, 2.4900, 50, 0.0010, -2.4900, 4.8045],
        [50, -0.0010, 2.4900, 50, 0.0011, -2.4900, 4.7461],
        [50, 2.5, 0, 50, 0, -2.5, 4.3065],
        [50, 2.5, 0, 73, 25, -18, 27.1492],
        [50, 2.5, 0, 61, -5, 29, 22.8977],
        [50, 2.5, 0, 56, -27, -3, 31.9030],
        [50, 2.5, 0, 58, 24, 15, 19.4535],
        [50, 2.5, 0, 50, 3.1736, 0.5854, 1.0000],
        [50, 2.5, 0, 50, 3.2972, 0, 1.0000],
        [50, 2.5, 0, 50, 1.8634, 0.5757, 1.0000],
        [50, 2.5, 0, 50, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ]
)

finite = st.floats(-128, 128)
lab_pairs = hnp.arrays(np.float64, st.tuples(st.integers(1, 20), st.just(6)), elements=finite)


def _plain(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """The slow twin: the paper's equations in whole arrays."""
    return plain_delta_e(*plain_terms(tuple(first.T), tuple(second.T)))


@pytest.mark.parametrize("way", [delta_e_2000, _plain])
def test_all_pairs_of_sharma_wu_and_dalal(way: Callable[..., NDArray[np.float64]]) -> None:
    np.testing.assert_allclose(way(SHARMA[:, :3], SHARMA[:, 3:6]), SHARMA[:, 6], rtol=0, atol=1e-4)
    np.testing.assert_allclose(way(SHARMA[:, 3:6], SHARMA[:, :3]), SHARMA[:, 6], rtol=0, atol=1e-4)


def test_against_colour_science_in_more_than_a_block() -> None:
    random = np.random.default_rng(3)
    low, high = [0, -120, -120], [100, 120, 120]
    first, second = random.uniform(low, high, (2, 50_001, 3))
    second[::2] = first[::2] + random.normal(0, 1, first[::2].shape)
    expected = colour.delta_E(first, second, method="CIE 2000")
    np.testing.assert_allclose(delta_e_2000(first, second), expected, rtol=0, atol=1e-9)


def test_shapes_broadcast_and_nan_stays_nan() -> None:
    assert delta_e_2000(np.zeros((4, 5, 3)), [50, 0, 0]).shape == (4, 5)
    assert delta_e_2000([1, 2, 3], [3, 2, 1]).shape == ()
    assert delta_e_2000([1, 2, 3], [1, 2, 3]) == 0
    assert delta_e_2000(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    assert np.isnan(delta_e_2000([np.nan, 0, 0], [50, 0, 0]))
    with pytest.raises(DeviceError, match="three numbers"):
        delta_e_2000(np.zeros((2, 4)), np.zeros((2, 4)))


def test_terms_equal_those_of_colour_science() -> None:
    random = np.random.default_rng(5)
    first, second = random.uniform([0, -120, -120], [100, 120, 120], (2, 20_001, 3))
    second[::2] = first[::2] + random.normal(0, 1, first[::2].shape)
    parts = delta_e_2000_parts(first, second)
    theirs = intermediate_attributes_CIE2000(first, second)
    # Their hue difference has the sign of the second hue minus the first, ours too.
    for ours, name in (
        (parts.delta_L, "delta_L_p"),
        (parts.delta_C, "delta_C_p"),
        (parts.delta_H, "delta_H_p"),
        (parts.S_L, "S_L"),
        (parts.S_C, "S_C"),
        (parts.S_H, "S_H"),
        (parts.R_T, "R_T"),
    ):
        np.testing.assert_allclose(ours, getattr(theirs, name), rtol=0, atol=1e-9, err_msg=name)


@given(lab_pairs)
def test_terms_make_up_the_difference(pairs: NDArray[np.float64]) -> None:
    parts = delta_e_2000_parts(pairs[:, :3], pairs[:, 3:])
    lightness, chroma, hue = parts.delta_L / parts.S_L, parts.delta_C / parts.S_C, parts.delta_H / parts.S_H
    square = lightness**2 + chroma**2 + hue**2 + parts.R_T * chroma * hue
    np.testing.assert_allclose(parts.delta_e, np.sqrt(np.maximum(square, 0.0)), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(parts.delta_e, delta_e_2000(pairs[:, :3], pairs[:, 3:]))


def test_colours_stored_as_float32_are_reckoned_in_float64() -> None:
    first, second = np.random.default_rng(6).uniform([0, -90, -90], [100, 90, 90], (2, 500, 3)).astype(np.float32)
    exact = delta_e_2000(first.astype(np.float64), second.astype(np.float64))
    np.testing.assert_array_equal(delta_e_2000(first, second), exact)
    assert delta_e_2000_parts(first[0], second[0]).delta_e.shape == ()


@pytest.mark.parametrize("count", [1, 1000, 70_001])
def test_the_way_from_xyz_in_blocks_equals_the_way_by_whole_arrays(count: int) -> None:
    rng = np.random.default_rng(count)
    white = np.array([95.0, 100.0, 109.0])
    first = rng.uniform(0.0, 1.2, (count, 3)) * white
    first[: count // 3] *= 1e-3  # CIELAB's straight part
    second = np.where(rng.random((count, 1)) < 0.1, first, rng.uniform(-0.01, 1.2, (count, 3)) * white)
    plain = delta_e_2000(xyz_to_lab(first, white), xyz_to_lab(second, white))
    np.testing.assert_allclose(delta_e_2000_of_xyz(first, second, white), plain, rtol=0.0, atol=1e-9)


# The fast terms of CIEDE2000 against their slow twin, the paper's equations in whole arrays.

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
