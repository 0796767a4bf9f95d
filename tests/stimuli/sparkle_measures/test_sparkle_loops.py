"""Compiled loops find, fit and sum up the same sparkles as their slow twins in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from stimuli.sparkle import SparkleMeasures, Threshold, measure_sparkles
from tests.compiled_loops import not_in_numpy
from tests.stimuli.sparkle_measures.test_sparkle_measures import planted


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


def both(picture: NDArray[np.float32], threshold: Threshold | None = None) -> tuple[SparkleMeasures, SparkleMeasures]:
    slow = measure_sparkles(picture, threshold, window_px=32)
    with not_in_numpy(LOOPS):
        return slow, measure_sparkles(picture, threshold, window_px=32)


LOOPS = "stimuli.sparkle.measures.sparkle_loops"


def test_a_picture_that_is_not_contiguous_and_one_without_sparkles() -> None:
    places = np.random.default_rng(10).uniform(10, 110, (30, 2))
    picture = planted((120, 120), places, 300.0, 0.8)
    wide = np.zeros((120, 240), np.float32)
    wide[:, ::2] = picture
    assert_like_the_twin(*both(wide[:, ::2]))
    slow, fast = both(np.full((64, 64), 5.0, np.float32))
    assert len(slow.peaks) == len(fast.peaks) == 0
