"""Colour spaces and chromatic adaptation against colour-science."""

from __future__ import annotations

from typing import get_args

import colour
import numpy as np
import pytest
from colour.adaptation import chromatic_adaptation_Zhai2018, matrix_chromatic_adaptation_VonKries
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from devices.colour import (
    WHITE_POINTS_XYZ,
    XYZ_from_xyY,
    adaptation_matrix,
    lab_to_xyz,
    rgb_to_xyz_matrix,
    white_point,
    xyY_from_XYZ,
    xyz_to_lab,
)
from devices.colour.adaptation import AdaptationMethod
from devices.colour.spaces import cube_roots
from devices.errors import DeviceError

# Colour spaces against colour-science.

D65 = np.array([95.047, 100.0, 108.883])


@given(hnp.arrays(np.float64, (6, 3), elements=st.floats(0, 500)))
def test_lab_equals_colour_science_and_comes_back(xyz: NDArray[np.float64]) -> None:
    lab = xyz_to_lab(xyz, D65)
    expected = colour.XYZ_to_Lab(xyz / 100, colour.XYZ_to_xy(D65 / 100))
    np.testing.assert_allclose(lab, expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(lab_to_xyz(lab, D65), xyz, rtol=1e-9, atol=1e-9)


@given(hnp.arrays(np.float64, (6, 3), elements=st.floats(1e-6, 1e6)))
def test_chromaticity_and_luminance_come_back(xyz: NDArray[np.float64]) -> None:
    xyY = xyY_from_XYZ(xyz)
    np.testing.assert_allclose(xyY, colour.XYZ_to_xyY(xyz), rtol=1e-9, atol=1e-12)
    # The third component is 1 - x - y: what cancels there is bounded by the largest of the three.
    np.testing.assert_allclose(
        XYZ_from_xyY(xyY) / xyz.max(), xyz / xyz.max(), rtol=0, atol=1e-8 * (1 + xyz.max() / xyz[:, 1].min())
    )


def test_black_has_no_chromaticity() -> None:
    np.testing.assert_array_equal(xyY_from_XYZ([0, 0, 0]), [0, 0, 0])
    np.testing.assert_array_equal(XYZ_from_xyY([0, 0, 0]), [0, 0, 0])
    with pytest.raises(DeviceError, match="y = 0"):
        XYZ_from_xyY([0.5, 0, 1])


def test_the_matrix_of_srgb_and_of_xyz_itself() -> None:
    matrix = rgb_to_xyz_matrix((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))
    srgb = colour.RGB_COLOURSPACES["sRGB"]
    np.testing.assert_allclose(
        matrix, colour.normalised_primary_matrix(srgb.primaries, srgb.whitepoint), rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(rgb_to_xyz_matrix((1, 0), (0, 1), (0, 0), (1 / 3, 1 / 3)), np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    "chromaticities",
    [
        ((0.1, 0.1), (0.2, 0.2), (0.3, 0.3), (0.3127, 0.329)),
        ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3, 0.0)),
        ((np.nan, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.329)),
    ],
)
def test_primaries_that_make_no_colours_are_refused(chromaticities: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(DeviceError):
        rgb_to_xyz_matrix(*chromaticities)


@pytest.mark.parametrize("white", [[0, 1, 1], [np.nan, 1, 1], [1, 1], [-1, 1, 1]])
def test_a_white_that_cannot_be_is_refused(white: list[float]) -> None:
    with pytest.raises(DeviceError, match="white"):
        xyz_to_lab([1, 1, 1], white)
    with pytest.raises(DeviceError, match="white"):
        lab_to_xyz([1, 1, 1], white)


def test_cube_roots_are_those_of_numpy_to_a_few_last_places() -> None:
    random = np.random.default_rng(7)
    values = 10.0 ** random.uniform(-2.9, 29.9, (3, 20_001))
    roots = cube_roots(values)
    assert roots.shape == values.shape
    np.testing.assert_allclose(roots, np.cbrt(values), rtol=4 * np.finfo(np.float64).eps, atol=0.0)
    # Every other one, and few, are no contiguous block of memory.
    np.testing.assert_array_equal(cube_roots(values[:, ::2]), roots[:, ::2])
    np.testing.assert_allclose(cube_roots(values[:, 5]), roots[:, 5], rtol=4 * np.finfo(np.float64).eps)


@pytest.mark.parametrize("odd", [np.nan, np.inf, 1e200])
def test_lab_of_light_that_single_precision_does_not_hold(odd: float) -> None:
    xyz = np.random.default_rng(8).uniform(0.0, 100.0, (3000, 3))
    alone = xyz_to_lab(xyz, [95.0, 100.0, 109.0])
    xyz[7, 1] = odd
    found = xyz_to_lab(xyz, [95.0, 100.0, 109.0])
    np.testing.assert_allclose(np.delete(found, 7, axis=0), np.delete(alone, 7, axis=0), rtol=0.0, atol=1e-12)
    assert found[7, 0] == pytest.approx(116.0 * np.cbrt(odd / 100.0) - 16.0, nan_ok=True)


def test_lab_of_light_down_to_none_and_below_against_the_definition() -> None:
    share = np.concatenate([10.0 ** np.random.default_rng(9).uniform(-12, 1, 2000), [0.0, (6 / 29) ** 3, -0.1, -5.0]])
    expected = np.where(share > (6 / 29) ** 3, np.cbrt(share), share * (29 / 6) ** 2 / 3 + 4 / 29)
    found = xyz_to_lab(np.outer(share, [95.0, 100.0, 109.0]), [95.0, 100.0, 109.0])
    np.testing.assert_allclose(found[:, 0], 116.0 * expected - 16.0, rtol=0.0, atol=1e-12)


# Chromatic adaptation: against colour-science, and what must be true of any.
#
# Whites by name: the ICC's from its own fractions, the CIE's beside colour-science's chromaticities.

THEIRS = {"cat16": "CAT16", "von-kries": "Von Kries", "bradford": "Bradford"}
METHODS = get_args(AdaptationMethod)


@pytest.mark.parametrize("method", METHODS)
def test_against_colour_science(method: AdaptationMethod) -> None:
    for before in WHITE_POINTS_XYZ.values():
        for after in WHITE_POINTS_XYZ.values():
            theirs = matrix_chromatic_adaptation_VonKries(before, after, THEIRS[method])
            np.testing.assert_allclose(adaptation_matrix(before, after, method), theirs, rtol=0, atol=1e-12)


@pytest.mark.parametrize("degree", [0.0, 0.3, 0.85, 1.0])
def test_incomplete_adaptation_against_colour_science(degree: float) -> None:
    """The one step of Zhai and Luo's two that is left where the baseline is the second white; their XYZ are of 100."""
    before, after = 100 * np.array(WHITE_POINTS_XYZ["a"]), 100 * np.array(WHITE_POINTS_XYZ["d65"])
    XYZ = np.random.default_rng(1).uniform(5, 90, (20, 3))
    theirs = chromatic_adaptation_Zhai2018(XYZ, before, after, degree, 1.0, after, transform="CAT16")
    np.testing.assert_allclose(XYZ @ adaptation_matrix(before, after, "cat16", degree).T, theirs, rtol=0, atol=1e-9)


def test_wrong_input() -> None:
    white = WHITE_POINTS_XYZ["d65"]
    with pytest.raises(DeviceError, match=r"degree of adaptation is 1\.2"):
        adaptation_matrix(white, white, degree=1.2)
    with pytest.raises(DeviceError, match="there is no adaptation 'cat02'"):
        adaptation_matrix(white, white, "cat02")  # type: ignore[arg-type]
    with pytest.raises(DeviceError, match="Y above 0"):
        adaptation_matrix([0.9, 0.0, 0.8], white)
    with pytest.raises(DeviceError, match="too saturated"):
        adaptation_matrix([0.2, 1.0, 9.0], white, "bradford")


def test_the_icc_white_is_in_fractions_of_sixteen_bits() -> None:
    np.testing.assert_array_equal(np.array(WHITE_POINTS_XYZ["icc-d50"]) * 65536, [63190.0, 65536.0, 54061.0])


@pytest.mark.parametrize("name", ["d50", "d65", "a", "e"])
def test_the_whites_are_those_of_the_cie(name: str) -> None:
    expected = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"][name.upper()]
    np.testing.assert_allclose(xyY_from_XYZ(white_point(name, 26.5)), [*expected, 26.5], atol=6e-5)


def test_what_is_no_white_is_refused() -> None:
    with pytest.raises(DeviceError, match="no white 'd51'"):
        white_point("d51", 1.0)
    for luminance in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(DeviceError, match="above 0"):
            white_point("d50", luminance)
