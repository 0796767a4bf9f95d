"""ΔE00 and what the eye resolves, at the edges: 36 megapixels, lone pixels, any light, any distance."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from stimuli.comparison import summarise
from stimuli.measures import SeenPicture, difference_map
from tests.stress.sheet import WHITE, Sheet

pytestmark = pytest.mark.stress


def test_thirty_six_megapixels_in_a_gigabyte() -> None:
    tracemalloc.start()
    plain = difference_map(Sheet(1.0), Sheet(1.03), WHITE)
    seen = difference_map(
        SeenPicture(Sheet(1.0), 178, WHITE), SeenPicture(Sheet(1.03), 178, WHITE), WHITE, filtered=True
    )
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1e9
    assert summarise(plain, 1.4).pixels == 4912 * 7360
    # The stripes are finer than the eye resolves: what is left is the luminance factor, everywhere alike.
    assert seen[200:-200, 200:-200].std() < 0.02 < plain.std()


@pytest.mark.parametrize("pixels_per_degree", [0.01, 1.0, 10.0, 100.0, 1e4, 1e5])
@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (2, 3), (31, 64)])
def test_any_size_at_any_distance(shape: tuple[int, int], pixels_per_degree: float) -> None:
    xyz = np.random.default_rng(1).gamma(0.5, 10.0, (*shape, 3))
    seen = SeenPicture(xyz, pixels_per_degree, WHITE)[:]
    assert seen.shape == xyz.shape
    assert np.isfinite(seen).all()
    assert seen.max() <= 1.5 * xyz.max()
    np.testing.assert_allclose(
        SeenPicture(np.ones_like(xyz), pixels_per_degree, WHITE)[:], np.ones_like(xyz), rtol=0, atol=1e-4
    )
