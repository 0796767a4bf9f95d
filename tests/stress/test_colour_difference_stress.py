"""CIEDE2000 over millions of pairs of every kind, the fast terms against the paper's equations in whole arrays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import delta_e_2000
from devices.colour.ciede2000_plain import plain_delta_e, plain_terms

pytestmark = pytest.mark.stress

Floats = NDArray[np.float64]
COUNT = 400_000


def by_hue(rng: np.random.Generator, hue: Floats, chroma: Floats) -> Floats:
    return np.column_stack([rng.uniform(0, 100, len(hue)), chroma * np.cos(hue), chroma * np.sin(hue)])


def kinds() -> Iterator[tuple[str, Floats, Floats]]:
    rng = np.random.default_rng(0)
    first, second = rng.uniform([0, -150, -150], [100, 150, 150], (2, COUNT, 3))
    yield "random", first, second
    for step in (1e-9, 1e-6, 1e-3, 1.0):
        yield f"{step} apart", first, first + rng.normal(0, step, first.shape)
    hue = rng.uniform(-np.pi, np.pi, COUNT)
    chroma, other = 10.0 ** rng.uniform(-8, 2.2, (2, COUNT))
    away = rng.choice([-1, 1], COUNT) * 10.0 ** rng.uniform(-17, 0, COUNT)
    yield "nearly opposite hues", by_hue(rng, hue, chroma), by_hue(rng, hue + away, -other)
    ratio = -rng.choice([0.125, 0.5, 1.0, 2.0], (COUNT, 1))
    yield "opposite hues", first, np.column_stack([second[:, 0], first[:, 1:] * ratio])
    yield "neutral beside colours", first * [1, 0, -0.0], second
    yield "mean hues of 0 and 180 degrees", first, first * [1, 1, -1]
    for size in (1e-300, 1e-170, 1e-110, 1e-60, 1e-30, 1e-10):
        yield f"chroma of {size}", first * [1, size, size], second * [1, size, size]
        yield f"chroma of {size} beside colours", first * [1, size, size], second


def test_colours_of_every_kind() -> None:
    # Rounding of the polynomial for R_T, 2e-14, is multiplied by differences in chroma and hue of up to 60.
    for kind, first, second in kinds():
        expected = plain_delta_e(*plain_terms(tuple(first.T), tuple(second.T)))
        np.testing.assert_allclose(delta_e_2000(first, second), expected, rtol=0.0, atol=2e-12, err_msg=kind)


@pytest.mark.parametrize("size", [1e3, 1e9, 1e30, 1e57, 1e62, 1e120])
def test_light_beyond_all_colours_keeps_its_share(size: float) -> None:
    first, second = np.random.default_rng(1).uniform([0, -1, -1], [100, 1, 1], (2, COUNT, 3)) * [1, size, size]
    expected = plain_delta_e(*plain_terms(tuple(first.T), tuple(second.T)))
    np.testing.assert_allclose(delta_e_2000(first, second), expected, rtol=1e-11, atol=0.0)
