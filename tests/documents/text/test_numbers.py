"""Numbers for people: no exponent where digits do, and a value to the place of its error."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from documents.text import significant, with_error

_MATCHED = re.compile(r"\(?(-?\d+(?:\.(\d+))?) ± (\d+(?:\.(\d+))?)\)?(?: × 10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")


@pytest.mark.parametrize(
    ("value", "figures", "text"),
    [
        (113.7, 2, "110"),
        (11623.0, 4, "11620"),
        (0.3, 3, "0.3"),
        (0.0, 3, "0"),
        (99.96, 3, "100"),
        (-0.0123, 2, "-0.012"),
        (0.00012345, 3, "0.000123"),
        (2.5e9, 3, "2.5 × 10⁹"),
        (1e-12, 2, "1 × 10⁻¹²"),
        (math.nan, 3, "unknown"),
        (math.inf, 3, "infinite"),
        (-math.inf, 3, "minus infinite"),
    ],
)
def test_figures_of_a_number(value: float, figures: int, text: str) -> None:
    assert significant(value, figures) == text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (132.6, 113.2, "130 ± 110"),
        (7632.4, 258.0, "7630 ± 260"),
        (2.28812, 0.00742, "2.2881 ± 0.0074"),
        (9.042, 8.99, "9.0 ± 9.0"),
        (99.922, 0.0781, "99.922 ± 0.078"),
        (0.5, 0.0996, "0.50 ± 0.10"),
        (-0.003, 0.5, "0.00 ± 0.50"),
        (0.0, 1.9, "0.0 ± 1.9"),
        (20.0, 0.0, "20 ± 0"),
        (7.1, math.inf, "7.1"),
        (7.1, math.nan, "7.1"),
        (7.1, None, "7.1"),
        (math.nan, 1.0, "unknown"),
        (1.234e12, 5.6e10, "(1.234 ± 0.056) × 10¹²"),
        (2.5, 1e-13, "2.5"),
    ],
)
def test_a_value_and_its_error_end_at_one_place(value: float, error: float | None, text: str) -> None:
    assert with_error(value, error) == text


@given(st.floats(), st.floats(min_value=0.0))
def test_no_number_has_an_exponent_or_other_decimals_than_its_error(value: float, error: float) -> None:
    text = with_error(value, error)
    assert not re.search(r"nan|inf\b|\de[+-]?\d", text)
    if " ± " in text and not text.endswith(" ± 0"):
        matched = _MATCHED.fullmatch(text)
        assert matched is not None, text
        assert len(matched[2] or "") == len(matched[4] or "")
