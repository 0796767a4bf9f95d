"""Curves of a profile against their formulas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from devices.errors import DeviceError
from devices.profiles.curves import curve_at, curves_at
from devices.profiles.tag_table import Tag
from documents.arrays import Floats
from tests.devices.profiles.profile_bytes import curv, para

X = np.linspace(0, 1, 301)


def _curve(data: bytes) -> Floats:
    return curve_at(Tag("display.icc", "rTRC", data))[0](X)


@pytest.mark.parametrize(
    ("data", "formula"),
    [
        (curv(), lambda x: x),
        (curv(0x0233), lambda x: x ** (0x233 / 256)),
        (curv(0, 10000, 65535), lambda x: np.interp(x, [0, 0.5, 1], [0, 10000 / 65535, 1])),
        (para(0, 2.5), lambda x: x**2.5),
        (para(1, 2.0, 1.25, -0.25), lambda x: np.where(x >= 0.2, np.maximum(1.25 * x - 0.25, 0) ** 2, 0)),
        (para(2, 2.0, 0.5, 0.25, 0.125), lambda x: (0.5 * x + 0.25) ** 2 + 0.125),
        (para(2, 2.0, 1.0, -0.25, 0.125), lambda x: np.where(x >= 0.25, np.maximum(x - 0.25, 0) ** 2, 0) + 0.125),
        (para(3, 2.0, 0.75, 0.25, 0.125, 0.5), lambda x: np.where(x >= 0.5, (0.75 * x + 0.25) ** 2, x / 8)),
        (
            para(4, 2.0, 0.75, 0.125, 0.25, 0.5, 0.0625, 0.03125),
            lambda x: np.where(x >= 0.5, (0.75 * x + 0.125) ** 2 + 0.0625, x / 4 + 0.03125),
        ),
    ],
)
def test_a_curve_is_its_formula(data: bytes, formula: Callable[[Floats], Floats]) -> None:
    np.testing.assert_allclose(_curve(data), formula(X), rtol=0, atol=1e-12)


def test_what_leaves_the_range_is_clipped() -> None:
    assert _curve(para(1, 30000.0, 2.0, 0.0))[-1] == 1.0
    assert _curve(para(4, 1.0, 1.0, -0.5, 0.0, 0.0, 0.0, 0.0))[0] == 0.0


def test_curves_follow_each_other_at_multiples_of_four_bytes() -> None:
    data = curv(0x0200) + b"\0\0" + curv(0, 1, 65535) + b"\0\0" + para(0, 3.0)
    first, second, third = curves_at(Tag("display.icc", "A2B0", data), 0, 3)
    assert float(first(0.5)) == 0.25
    assert float(third(0.5)) == 0.125
    assert second(0.5) == pytest.approx(1 / 65535)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (curv(0), "gamma of 0"),
        (para(0, -1.0), "gamma -1"),
        (para(1, 2.0, 0.0, 0.5), "a 0"),
        (b"para\0\0\0\0\0\x09\0\0", "parametric function 9"),
        (para(3, 2.0), "needs"),
        (b"curv\0\0\0\0\xff\xff\xff\xff", "needs 8589934602 bytes and has 12"),
        (b"XYZ \0\0\0\0", "type 'XYZ '"),
        (b"cur", "needs 4 bytes"),
    ],
)
def test_a_damaged_curve_is_refused(data: bytes, words: str) -> None:
    with pytest.raises(DeviceError) as caught:
        _curve(data)
    assert words in str(caught.value)
    assert "'rTRC'" in str(caught.value)
