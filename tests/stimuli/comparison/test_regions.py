"""Which pixels lie in an outline, and outlines that cross themselves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stimuli.comparison.areas import crosses_itself, inside, window

Corner = tuple[float, float]
# Not on pixel centres, where rounding decides; sides that pass through one are left out of the comparison.
places = st.floats(-3, 23).map(lambda x: round(x, 3) + 0.0001)


def plain_inside(outline: np.ndarray, x: float, y: float) -> bool | None:
    """The textbook's ray: the sides crossed on the way to the left; None on a side."""
    crossed = False
    for (x1, y1), (x2, y2) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if (y1 <= y) != (y2 <= y):
            side = x1 + (y - y1) * (x2 - x1) / (y2 - y1)
            if abs(side - x) < 1e-9:
                return None
            crossed ^= bool(side <= x)
    return crossed


@given(st.lists(st.tuples(places, places), min_size=3, max_size=8))
@settings(max_examples=12, deadline=None)
def test_every_pixel_is_told_as_by_the_plain_ray(points: list[Corner]) -> None:
    outline = np.array(points)
    got = inside(outline, slice(0, 20), slice(0, 20))
    for y in range(20):
        for x in range(20):
            assert plain_inside(outline, x + 0.5, y + 0.5) in (got[y, x], None)


@given(st.floats(0.1, 19.9), st.floats(0.1, 19.9), st.floats(0.1, 19.9))
@settings(max_examples=60, deadline=None)
def test_areas_that_share_an_edge_share_no_pixel(top: float, bottom: float, across: float) -> None:
    whole = slice(0, 20), slice(0, 20)
    left = inside(np.array([[0, 0], [top, 0], [bottom, 20], [0, 20.0]]), *whole)
    right = inside(np.array([[top, 0], [20, 0], [20, 20], [bottom, 20.0]]), *whole)
    assert np.all(left ^ right)
    upper = inside(np.array([[0, 0], [20, 0], [20, across], [0, across]]), *whole)
    lower = inside(np.array([[0, across], [20, across], [20, 20], [0, 20.0]]), *whole)
    assert np.all(upper ^ lower)


@pytest.mark.parametrize(
    ("points", "crosses"),
    [
        ([(0, 0), (4, 0), (4, 4), (0, 4)], False),
        ([(0, 0), (4, 4), (4, 0), (0, 4)], True),
        ([(0, 0), (4, 0), (2, 1), (0, 4)], False),  # dented
        ([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)], True),  # touches a side with a corner
        ([(0, 0), (4, 0), (2, 0), (0, 4)], True),  # goes back on itself
        ([(0, 0), (4, 0), (2, 0)], True),
        ([(0, 0), (4, 0), (4, 4), (1, 4), (1, -1), (0, 3)], True),
    ],
)
def test_outlines_that_cross_themselves_are_told(points: list[Corner], crosses: bool) -> None:
    outline = np.array(points, dtype=np.float64)
    assert crosses_itself(outline) is crosses
    assert crosses_itself(outline[::-1].copy()) is crosses
    assert crosses_itself(np.roll(outline, 1, axis=0)) is crosses


@given(
    st.tuples(st.integers(0, 20), st.integers(0, 20), st.integers(1, 9)),
    st.tuples(st.integers(0, 20), st.integers(0, 20)),
)
@settings(max_examples=60, deadline=None)
def test_a_side_through_centres_is_rounded_alike_by_both(one: tuple[int, int, int], other: tuple[int, int]) -> None:
    whole = slice(0, 20), slice(0, 20)
    top, bottom = one[0] + one[1] / one[2] / 2, other[0] + other[1] / 20
    left = inside(np.array([[-1, 0], [top, 0], [bottom, 20], [-1, 20.0]]), *whole)
    right = inside(np.array([[top, 0], [41, 0], [41, 20], [bottom, 20.0]]), *whole)
    assert np.all(left ^ right)


def test_a_pixel_belongs_if_its_centre_does() -> None:
    square = np.array([[0.4, 0.6], [2.5, 0.6], [2.5, 2.6], [0.4, 2.6]])
    rows, columns = window(square, (10, 10, 3))
    assert (rows, columns) == (slice(0, 3), slice(0, 3))
    np.testing.assert_array_equal(inside(square, rows, columns), [[0, 0, 0], [1, 1, 0], [1, 1, 0]])
