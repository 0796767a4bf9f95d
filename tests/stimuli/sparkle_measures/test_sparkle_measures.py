"""Sparkles planted at known places, of known light and width, come back."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from scipy.special import ndtr

from documents.arrays import Floats
from stimuli.errors import StimulusError
from stimuli.sparkles import PixelScale, SparkleMeasures, SparkleThreshold, measure_sparkles, moments, shared_sparkles
from stimuli.sparkles.background import local_background
from stimuli.sparkles.find import find_peaks
from stimuli.sparkles.moments import FWHM_PER_SD, sparkle_moments
from tests.compiled_loops import not_in_numpy
from tests.kept import known

BASE = 10.0


def planted(
    shape: tuple[int, int], places: Floats, flux: ArrayLike, sd_px: ArrayLike, *, noise: float = 0.0, base: float = BASE
) -> NDArray[np.float32]:
    """A plane of ``base`` cd/m² with Gaussians integrated over each pixel's area, and Gaussian noise."""
    picture = np.full(shape, base)
    each = np.broadcast_to(flux, len(places)), np.broadcast_to(sd_px, len(places))
    for (row, column), light, sd in zip(places, *each, strict=True):
        down = np.diff(ndtr((np.arange(shape[0] + 1) - 0.5 - row) / sd))
        across = np.diff(ndtr((np.arange(shape[1] + 1) - 0.5 - column) / sd))
        rows, columns = np.flatnonzero(down > 1e-12), np.flatnonzero(across > 1e-12)
        picture[np.ix_(rows, columns)] += light * np.outer(down[rows], across[columns])
    return np.asarray(picture + np.random.default_rng(99).normal(0, noise, shape), dtype=np.float32)


def apart(seed: int, size: int = 400, step: float = 24.0) -> Floats:
    """Places about ``step`` px apart, each at random within its pixel."""
    line = np.arange(20.0, size - 20, step)
    places = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(places + np.random.default_rng(seed).uniform(-0.5, 0.5, places.shape))


def on_pixels(sd_px: float) -> float:
    return math.sqrt(sd_px**2 + 1 / 12)


def offsets(measures: SparkleMeasures, places: Floats) -> Floats:
    """Each planted sparkle's distance to the nearest that was found."""
    found = np.stack([measures.moments.row_px, measures.moments.column_px], axis=-1)
    return np.asarray(cKDTree(found).query(places)[0])


@pytest.mark.parametrize("noise", [0.0, 0.2])
@pytest.mark.parametrize("sd_px", [0.5, 1.0, 2.0])
def test_planted_sparkles_come_back(sd_px: float, noise: float) -> None:
    """Noise of 2 % of the background, 0.4 % of the peak."""
    places = apart(1)
    flux = 50 * 2 * math.pi * sd_px**2
    picture = planted((400, 400), places, flux, sd_px, noise=noise)
    measures = measure_sparkles(picture)
    assert len(measures.peaks) == len(places)
    assert measures.count.se == math.sqrt(len(places))
    assert measures.overlapping == measures.unfit == 0
    assert offsets(measures, places).max() < (0.05 if noise else 0.03)
    assert measures.width_px.value == pytest.approx(FWHM_PER_SD * on_pixels(sd_px), rel=0.01)
    assert np.median(measures.moments.flux_cd_m2_px) == pytest.approx(flux, rel=0.01)
    # The contrast of the brightest pixel follows from the picture without noise.
    clean = planted((400, 400), places, flux, sd_px)
    row, column = np.round(places).astype(int).T
    peaks = [clean[r - 1 : r + 2, c - 1 : c + 2].max() for r, c in zip(row, column, strict=True)]
    assert measures.contrast.value == pytest.approx(np.mean(np.array(peaks) / BASE - 1), rel=0.01)
    # Rings half a pixel wide take the corners off a profile that is hardly wider than a pixel.
    half = 0.5 * FWHM_PER_SD * on_pixels(sd_px)
    assert measures.half_width_px.value == pytest.approx(half, rel=0.1 if sd_px < 0.7 else 0.04)


def test_standard_errors_cover_the_truth() -> None:
    """Widths that scatter: the mean lies within its errors as often as it should."""
    inside = 0
    for seed in range(12):
        random = np.random.default_rng(seed)
        places = apart(seed, 200)
        sd = random.uniform(0.8, 1.6, len(places))
        measures = measure_sparkles(planted((200, 200), places, 60 * 2 * np.pi * sd**2, sd))
        truth = FWHM_PER_SD * np.sqrt(1.2**2 + 0.8**2 / 12 + 1 / 12)  # about the mean of the law
        inside += abs(measures.width_px.value - truth) < 2 * measures.width_px.se
    assert inside >= 9


def test_density_and_size_in_the_units_of_the_plate_and_of_the_eye() -> None:
    places = apart(3)
    scale = PixelScale(pixels_per_mm=14.6, pixels_per_degree=44.0)
    measures = measure_sparkles(planted((400, 400), places, 300.0, 1.0), SparkleThreshold(times=1.5), scale)
    plate_cm2 = (400 / 146) ** 2
    assert known(measures.density_per_cm2).value == pytest.approx(len(places) / plate_cm2)
    assert known(measures.density_per_cm2).se == pytest.approx(math.sqrt(len(places)) / plate_cm2)
    assert known(measures.density_per_deg2).value == pytest.approx(len(places) / (400 / 44) ** 2)
    told = json.loads(json.dumps(measures.to_json(), allow_nan=False))
    assert told["half_width_um"]["value"] == pytest.approx(measures.half_width_px.value / 14.6 * 1000)
    assert told["half_width_arcmin"]["value"] == pytest.approx(measures.half_width_px.value / 44 * 60)
    assert told["area_um2"]["value"] == pytest.approx(measures.area_px.value / 14.6**2 * 1e6)


def test_area_is_what_lies_above_the_threshold() -> None:
    picture = np.full((64, 64), 10.0, np.float32)
    picture[20:23, 30:34] = 25.0
    picture[21, 31] = 40.0
    picture[40, 40] = picture[41, 41] = 21.0  # touch at a corner
    measures = measure_sparkles(picture)
    assert list(measures.peaks.area_px) == [12, 2]
    assert list(measures.peaks.luminance_cd_m2) == [40.0, 21.0]
    assert measures.peaks.pixels_above == 14


def test_overlapping_sparkles_are_said() -> None:
    places = np.array([[50.0, 50.0], [50.0, 54.0], [50.3, 100.0], [100.0, 60.0], [100.9, 60.9]])
    measures = measure_sparkles(planted((160, 160), places, 300.0, 1.0))
    # The last two are one peak.
    assert len(measures.peaks) == 4
    assert measures.overlapping == 2
    assert offsets(measures, places[:3]).max() < 0.02


@pytest.mark.parametrize("distance", [4.0, 6.5])
def test_a_neighbour_does_not_draw_or_widen(distance: float) -> None:
    """Pairs of unequal light: places and widths as if each were alone."""
    first = apart(8)
    turn = np.random.default_rng(9).uniform(0, 2 * np.pi, len(first))
    places = np.concatenate([first, first + distance * np.stack([np.sin(turn), np.cos(turn)], axis=-1)])
    light = np.repeat([600.0, 400.0], len(first))
    measures = measure_sparkles(planted((400, 400), places, light, 1.0, noise=0.1))
    assert len(measures.peaks) == len(places)
    assert offsets(measures, places).max() < 0.1
    assert measures.unfit == 0
    np.testing.assert_allclose(measures.moments.sd_px, on_pixels(1.0), rtol=0.05)


@pytest.mark.parametrize("seeds", [2, pytest.param(6, marks=pytest.mark.stress)])
@pytest.mark.parametrize("sd_px", [0.6, 1.5])
def test_sparkles_at_random_places_are_counted_and_the_merged_foretold(sd_px: float, seeds: int) -> None:
    lost, foretold = 0.0, 0.0
    for seed in range(seeds):
        random = np.random.default_rng(seed)
        places = random.uniform(4, 396, (600, 2))
        light = 300 * random.uniform(0.7, 1.5, len(places)) * sd_px**2
        measures = measure_sparkles(planted((400, 400), places, light, sd_px))
        lost += len(places) - len(measures.peaks)
        foretold += measures.merged_expected
    assert lost > 0
    # Three standard errors of the number lost, and what a rule of one radius for all cannot know.
    assert lost == pytest.approx(foretold, abs=3 * math.sqrt(foretold) + 0.1 * foretold)


def test_nothing_is_found_in_noise_or_on_an_even_plane() -> None:
    for noise in (0.0, 1.0):
        measures = measure_sparkles(planted((300, 300), np.empty((0, 2)), 0.0, 1.0, noise=noise))
        assert measures.count.value == 0
        assert measures.to_json()["weber_contrast"] == {"value": None, "se": None}
        assert measures.peaks.background.noise_cd_m2 == pytest.approx(noise, rel=0.02)


# Background


def test_background_is_the_median_in_the_middle_of_each_window() -> None:
    """Against the slow twin: the median of the pixels about a place."""
    random = np.random.default_rng(0)
    smooth = np.linspace(5, 15, 130)[:, None] * np.linspace(1, 2, 190)
    picture = (smooth + random.normal(0, 0.3, smooth.shape)).astype(np.float32)
    background = local_background(picture, 60)
    lines = background.lines(0, 130, 190)
    assert lines.dtype == np.float32
    assert background.windows_cd_m2.shape == (2, 3)
    for row in (0, 1):
        for column in (0, 1, 2):
            edges = np.linspace(0, 190, 4).round().astype(int)[column : column + 2]
            plain = np.median(picture[65 * row : 65 * row + 65, edges[0] : edges[1]])
            assert background.windows_cd_m2[row, column] == plain
    place = np.random.default_rng(1).uniform(0, 129, 50), np.random.default_rng(2).uniform(0, 189, 50)
    whole = np.round(place[0]), np.round(place[1])
    at = background.at(*whole)
    np.testing.assert_allclose(at, lines[whole[0].astype(int), whole[1].astype(int)], rtol=1e-6)
    assert np.abs(lines / smooth - 1)[20:110, 40:150].max() < 0.05


# Both eyes


def test_sparkles_that_both_eyes_see() -> None:
    places = apart(5)
    random = np.random.default_rng(6)
    common, mine, others = places[:100], places[100:150], places[150:180]
    left = measure_sparkles(planted((400, 400), np.concatenate([common, mine]), 300.0, 1.0, noise=0.1))
    moved = np.concatenate([common + random.normal(0, 0.05, common.shape), others]) + (0.0, 0.6)
    right = measure_sparkles(planted((400, 400), moved, 300.0, 1.0, noise=0.2))
    found = shared_sparkles(left, right, tolerance_px=0.5, parallax_px=0.6)
    assert (found.left, found.right, found.both) == (150, 130, 100)
    assert found.share.value == pytest.approx(100 / 180)
    assert found.share.se == pytest.approx(math.sqrt(100 * 80 / 180**3))
    assert shared_sparkles(left, right, tolerance_px=0.3).both < 20
    swapped = shared_sparkles(right, left, tolerance_px=0.5, parallax_px=-0.6)
    assert (swapped.left, swapped.right, swapped.both) == (130, 150, 100)


def test_one_sparkle_is_the_partner_of_one_only() -> None:
    left = measure_sparkles(planted((100, 100), np.array([[50.0, 46.0], [50.0, 53.0]]), 300.0, 1.0))
    right = measure_sparkles(planted((100, 100), np.array([[50.0, 50.0]]), 300.0, 1.0))
    for one, other in ((left, right), (right, left)):
        assert shared_sparkles(one, other, tolerance_px=6.0).both == 1


# What must always hold, and what cannot be


def pictures_that_cannot_be() -> Sequence[tuple[NDArray[np.float32], str]]:
    even = np.full((50, 50), 3.0, np.float32)
    hole = even.copy()
    hole[3, 4] = np.nan
    return (
        (hole, "1 pixel is NaN"),
        (np.zeros((50, 50, 3), np.float32), "shape"),
        (np.zeros((3, 50), np.float32), "at least 8"),
    )


@pytest.mark.parametrize(("picture", "message"), pictures_that_cannot_be())
def test_pictures_that_cannot_be(picture: NDArray[np.float32], message: str) -> None:
    with pytest.raises(StimulusError, match=message):
        measure_sparkles(picture)


def test_thresholds_that_cannot_be() -> None:
    with pytest.raises(StimulusError, match="above the threshold of its sparkles"):
        measure_sparkles(np.full((50, 50), 3.0, np.float32), SparkleThreshold(times=0.5))
    for times, above in ((0.0, 0.0), (-1.0, 1.0), (math.nan, 1.0)):
        with pytest.raises(StimulusError, match="threshold"):
            SparkleThreshold(times, above)
    with pytest.raises(StimulusError, match="pixels_per_mm"):
        PixelScale(pixels_per_mm=0)


LOOPS = "stimuli.sparkles.sparkle_loops"


def both(
    picture: NDArray[np.float32], threshold: SparkleThreshold | None = None
) -> tuple[SparkleMeasures, SparkleMeasures]:
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
    slow, fast = both(picture, SparkleThreshold(times=0, above_cd_m2=3.5))
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


def test_absolute_threshold_and_dark_background() -> None:
    picture = planted((100, 100), np.array([[30.2, 40.1], [70.0, 70.4]]), [50.0, 500.0], 1.0, base=0.0)
    assert measure_sparkles(picture, SparkleThreshold(times=0, above_cd_m2=20)).count.value == 1
    both = measure_sparkles(picture, SparkleThreshold(times=0, above_cd_m2=2))
    assert both.count.value == 2
    assert math.isnan(both.contrast.value)


def test_light_that_falls_off_over_the_picture() -> None:
    places = apart(4)
    slope = np.linspace(0.4, 2.0, 400, dtype=np.float32)
    even = planted((400, 400), places, 150.0, 1.0)
    measures = measure_sparkles(even * slope)
    assert len(measures.peaks) == len(places)
    expected = measure_sparkles(even)
    assert measures.contrast.value == pytest.approx(expected.contrast.value, rel=0.02)
    # One absolute threshold for all would miss the sparkles of the dark side.
    assert len(find_peaks(even * slope, SparkleThreshold(times=0, above_cd_m2=25))) < 0.9 * len(places)


def test_fits_that_go_on_from_where_they_were_end_where_full_ones_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against the slow twin: every round, however often it is made again, goes on until nothing moves."""
    random = np.random.default_rng(3)
    places = random.uniform(10, 290, (700, 2))
    picture = planted((300, 300), places, random.uniform(100, 900, 700), random.uniform(0.6, 1.2, 700), noise=0.3)
    peaks = find_peaks(picture, SparkleThreshold())
    fast = sparkle_moments(picture, peaks)
    monkeypatch.setattr(moments, "_ROUGH_REST_PX", moments._REST_PX)
    slow = sparkle_moments(picture, peaks)
    both = fast.fits & slow.fits
    assert both.sum() > 0.99 * max(fast.fits.sum(), slow.fits.sum()) > 300
    for name in ("row_px", "column_px", "sd_px"):
        apart = np.abs(getattr(fast, name) - getattr(slow, name))[both]
        assert np.median(apart) < 1e-4
        assert np.quantile(apart, 0.95) < 5e-3


def test_a_window_full_of_sparkle_does_not_lift_its_neighbours() -> None:
    picture = np.full((300, 300), 10.0, np.float32)
    picture[120:180, 120:180] = 300.0
    assert local_background(picture, 60).lines(0, 300, 300).max() == 10.0


def test_random_places_meet_as_often_as_foretold() -> None:
    met, foretold = [], []
    for seed in range(4):
        two = [
            measure_sparkles(
                planted((300, 300), np.random.default_rng([seed, eye]).uniform(5, 295, (250, 2)), 300.0, 0.7)
            )
            for eye in (0, 1)
        ]
        found = shared_sparkles(two[0], two[1], tolerance_px=3.0)
        met.append(found.both)
        foretold.append(found.by_chance)
    assert np.mean(met) == pytest.approx(np.mean(foretold), rel=0.3)
    assert shared_sparkles(two[0], two[0]).share.value == 1.0


def test_the_profile_of_one_sparkle_between_four_pixels() -> None:
    """No pixel lies in its innermost ring: the centre follows from the next ones."""
    measures = measure_sparkles(planted((64, 64), np.array([[30.5, 30.5]]), 400.0, 1.0))
    assert measures.profile.sparkles == 1
    assert math.isnan(measures.profile.share[0])
    assert measures.half_width_px.value == pytest.approx(FWHM_PER_SD / 2 * on_pixels(1.0), rel=0.05)
