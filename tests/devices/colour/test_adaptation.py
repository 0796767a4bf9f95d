"""Chromatic adaptation: against colour-science, and what must be true of any."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from colour.adaptation import chromatic_adaptation_Zhai2018, matrix_chromatic_adaptation_VonKries
from hypothesis import given
from hypothesis import strategies as st

from devices.colour import WHITE_POINTS_XYZ, adaptation_matrix
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
