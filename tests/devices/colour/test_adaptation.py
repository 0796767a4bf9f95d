"""Chromatic adaptation: against colour-science, and what must be true of any.

Whites by name: the ICC's from its own fractions, the CIE's beside colour-science's chromaticities.
"""

from __future__ import annotations

from typing import get_args

import colour
import numpy as np
import pytest
from colour.adaptation import chromatic_adaptation_Zhai2018, matrix_chromatic_adaptation_VonKries
from hypothesis import given
from hypothesis import strategies as st

from devices.colour import WHITE_POINTS_XYZ, adaptation_matrix, white_point, xyY_from_XYZ
from devices.colour.adaptation import AdaptationMethod
from devices.errors import DeviceError

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


@given(st.sampled_from(METHODS), st.sampled_from(list(WHITE_POINTS_XYZ)), st.sampled_from(list(WHITE_POINTS_XYZ)))
def test_there_and_back(method: AdaptationMethod, one: str, other: str) -> None:
    there = adaptation_matrix(WHITE_POINTS_XYZ[one], WHITE_POINTS_XYZ[other], method)
    back = adaptation_matrix(WHITE_POINTS_XYZ[other], WHITE_POINTS_XYZ[one], method)
    np.testing.assert_allclose(back @ there, np.eye(3), rtol=0, atol=1e-12)
    np.testing.assert_allclose(there @ WHITE_POINTS_XYZ[one], WHITE_POINTS_XYZ[other], rtol=0, atol=1e-12)


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
