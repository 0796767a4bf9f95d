"""Compiled loops find, fit and sum up the same sparkles as their slow twins in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from stimuli.sparkle import SparkleMeasures, Threshold, measure_sparkles
from tests.compiled_loops import not_in_numpy
from tests.stimuli.sparkle_measures.test_sparkle_measures import planted

LOOPS = "stimuli.sparkle.measures.sparkle_loops"


def both(picture: NDArray[np.float32], threshold: Threshold | None = None) -> tuple[SparkleMeasures, SparkleMeasures]:
    slow = measure_sparkles(picture, threshold, window_px=32)
    with not_in_numpy(LOOPS):
        return slow, measure_sparkles(picture, threshold, window_px=32)


def assert_like_the_twin(slow: SparkleMeasures, fast: SparkleMeasures) -> None:
    """Peaks and areas exactly; the moments and rings as near as sums in single precision are."""
    for name in ("row", "column", "area_px", "peaks_in_area"):
        assert np.array_equal(getattr(slow.peaks, name), getattr(fast.peaks, name)), name
    # Where a fit ends just within its bounds, rounding may decide.
    assert (slow.moments.fits != fast.moments.fits).mean() <= 0.002
    fits = slow.moments.fits & fast.moments.fits
    for name in ("row_px", "column_px", "sd_px"):
        apart = np.abs(getattr(slow.moments, name) - getattr(fast.moments, name))
        assert np.quantile(apart[fits], 0.99, method="higher") < 2e-5, name
        assert apart[fits].max() < 2e-3, name
    np.testing.assert_allclose(fast.moments.flux_cd_m2_px[fits], slow.moments.flux_cd_m2_px[fits], rtol=5e-3)
    unfit = ~slow.moments.fits & ~fast.moments.fits
    np.testing.assert_allclose(fast.moments.row_px[unfit], slow.moments.row_px[unfit], atol=1e-3)
    np.testing.assert_allclose(fast.moments.column_px[unfit], slow.moments.column_px[unfit], atol=1e-3)
    assert np.isnan(fast.moments.sd_px[~fast.moments.fits]).all()
    for name in ("radius_px", "share", "share_se"):
        one, other = getattr(fast.profile, name), getattr(slow.profile, name)
        np.testing.assert_allclose(one, other, rtol=1e-3, atol=1e-5)
    assert fast.profile.sparkles == pytest.approx(slow.profile.sparkles, abs=2)


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_sparkles_near_each_other_and_at_the_edges(noise: float) -> None:
    random = np.random.default_rng(8)
    places = random.uniform(-1, 301, (900, 2))
    light, width = random.uniform(100, 900, 900), random.uniform(0.5, 1.4, 900)
    slow, fast = both(planted((300, 300), places, light, width, noise=noise))
    assert len(slow.peaks) > 500
    assert (slow.peaks.peaks_in_area > 1).sum() > 50
    assert_like_the_twin(slow, fast)


def test_areas_of_any_form_and_equal_neighbours() -> None:
    """Snakes, rings and flat tops: noise above a low threshold, in few steps, so that many pixels are equal."""
    random = np.random.default_rng(9)
    picture = np.floor(random.uniform(1, 6, (120, 97))).astype(np.float32)
    picture[30:40, 20:60] = 9.0
    slow, fast = both(picture, Threshold(times=0, above_cd_m2=3.5))
    assert slow.peaks.area_px.max() > 100
    for name in ("row", "column", "area_px", "peaks_in_area"):
        assert np.array_equal(getattr(slow.peaks, name), getattr(fast.peaks, name)), name


def test_a_picture_that_is_not_contiguous_and_one_without_sparkles() -> None:
    places = np.random.default_rng(10).uniform(10, 110, (30, 2))
    picture = planted((120, 120), places, 300.0, 0.8)
    wide = np.zeros((120, 240), np.float32)
    wide[:, ::2] = picture
    assert_like_the_twin(*both(wide[:, ::2]))
    slow, fast = both(np.full((64, 64), 5.0, np.float32))
    assert len(slow.peaks) == len(fast.peaks) == 0
