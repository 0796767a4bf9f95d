"""Numbers on the page of a fitted camera."""

from __future__ import annotations

import math

import pytest

from runner.reports.camera.page import _with_error


@pytest.mark.parametrize(
    ("value", "error", "told"),
    [
        (220.0271, 0.0394, ("220.027", "0.039")),
        (-45.988, 0.31, ("−45.99", "0.31")),
        (-0.0010071, 0.00297, ("−0.0010", "0.0030")),
        (1234.5, 25.0, ("1234", "25")),
        (3.0, 1e-14, ("3.000000", "0.000000")),
        (3.0, 0.0, ("3.000000", "0.000000")),
        (220.0271, math.nan, ("220.03", None)),
    ],
)
def test_a_number_is_told_as_far_as_it_is_known(value: float, error: float, told: tuple[str, str | None]) -> None:
    assert _with_error(value, error) == told
