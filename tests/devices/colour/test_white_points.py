"""Whites by name: the ICC's from its own fractions, the CIE's beside colour-science's chromaticities."""

from __future__ import annotations

import colour
import numpy as np
import pytest

from devices.colour import WHITE_POINTS_XYZ, white_point, xyY_from_XYZ
from devices.errors import DeviceError


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
