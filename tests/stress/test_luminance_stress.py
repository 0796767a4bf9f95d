"""Factors, statistics, sparkle measures and resampling at their edges."""

from __future__ import annotations

import math
import time
import tracemalloc

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import DisplayModel, ToneCurve
from stimuli.luminance import picture_statistics
from stimuli.luminance.saturation import largest_factor, measure_saturation, saturation_factors
from stimuli.pictures import StereoImage, resample_picture
from stimuli.pictures.resampling import Filter, axis_weights
from stimuli.sparkle import SparkleMeasures, measure_sparkles

pytestmark = pytest.mark.stress
CURVES = (ToneCurve(gamma=2.2),) * 3
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def model(random: np.random.Generator) -> DisplayModel:
    """A display of any brightness, with a black of up to a tenth of white, its colour any."""
    primaries = PRIMARIES * random.uniform(0.8, 1.25, 3) * 10 ** random.uniform(-2, 3)
    return DisplayModel(primaries.sum(axis=1) * random.uniform(0, 0.1, 3), primaries, CURVES)


def test_order_statistics_equal_bisection_on_any_display() -> None:
    worst = 0.0
    for seed in range(300):
        random = np.random.default_rng(seed)
        shown = model(random)
        pixels = int(random.integers(1, 5000))
        light = random.lognormal(0, random.uniform(0.1, 3), (1, pixels, 1)) * random.uniform(0, 1.5, (1, pixels, 3))
        xyz = light.astype(np.float32)
        limit = float(random.choice([0.0, 0.3, 5.0, 50.0, 99.0]))
        found = largest_factor(xyz, shown, limit)
        allowed = math.floor(limit / 100 * pixels * (1 + 1e-12))
        assert found.allowed_pixels == allowed
        if math.isinf(found.factor):
            assert np.isfinite(saturation_factors(xyz, shown)).sum() <= allowed
            continue
        low, high = found.factor * 0.5, found.factor * 1.7
        while high - low > 1e-13 * high:
            middle = 0.5 * (low + high)
            full = int((shown.linear(xyz.astype(np.float64) * middle) > 1.0).any(axis=-1).sum())
            low, high = (middle, high) if full <= allowed else (low, middle)
        worst = max(worst, abs(low / found.factor - 1))
    print(f"largest relative difference {worst:.1e}")
    assert worst < 1e-9


def planted(
    random: np.random.Generator, shape: tuple[int, int], places: NDArray[np.float64], noise: float, sd: float = 1.0
) -> NDArray[np.float32]:
    picture = random.normal(10, noise, shape).astype(np.float32) if noise else np.full(shape, 10, np.float32)
    offsets = np.arange(-7, 8)
    for row, column in places:
        i, j = round(row), round(column)
        down = np.exp(-0.5 * ((i + offsets - row) / sd) ** 2)
        across = np.exp(-0.5 * ((j + offsets - column) / sd) ** 2)
        picture[i - 7 : i + 8, j - 7 : j + 8] += (60 * np.outer(down, across)).astype(np.float32)
    return picture


def test_thirty_six_megapixels() -> None:
    """A D800's picture: time, memory beside the picture, and nothing lost."""
    shape = (4912, 7360)
    random = np.random.default_rng(0)
    rows, columns = np.meshgrid(np.arange(30.0, 4880, 40), np.arange(30.0, 7330, 40), indexing="ij")
    places = np.stack([rows.ravel(), columns.ravel()], axis=-1) + random.uniform(-0.5, 0.5, (rows.size, 2))
    luminance = planted(random, shape, places, 0.3)
    tracemalloc.start()
    start = time.process_time()
    measures = measure_sparkles(luminance)
    spent, (_, most) = time.process_time() - start, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    print(f"{len(measures.peaks)} sparkles of {len(places)} in {spent:.1f} s, {most / 1e6:.0f} MB beside the picture")
    assert len(measures.peaks) == len(places)
    assert most < 400e6
    xyz = np.repeat(luminance[..., None], 3, axis=2)
    tracemalloc.start()
    start = time.process_time()
    shown = DisplayModel(np.zeros(3), PRIMARIES, CURVES)
    found = largest_factor(xyz, shown, 0.3)
    print(f"largest factor in {time.process_time() - start:.1f} s")
    start = time.process_time()
    small = resample_picture(StereoImage.flat(xyz), (504.0, 336.4), 0.2768)
    spent, (_, most) = time.process_time() - start, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    print(f"resampled to {small.left.shape} in {spent:.1f} s, {most / 1e6:.0f} MB beside the picture")
    assert most < 400e6
    counted = measure_saturation(xyz, shown, found.factor * (1 - 1e-12)).any_channel
    assert counted <= 0.003 * luminance.size
    assert measure_saturation(xyz, shown, found.factor * (1 + 1e-5)).any_channel > 0.003 * luminance.size
    told = picture_statistics(StereoImage.flat(xyz)).eyes["left"]
    assert told.mean_cd_m2 == pytest.approx(luminance.mean(dtype=np.float64))


def measured(seed: int, count: float, noise: float) -> SparkleMeasures:
    random = np.random.default_rng(seed)
    places = random.uniform(10, 290, (random.poisson(count), 2))
    return measure_sparkles(planted(random, (300, 300), places, noise))


def test_counts_scatter_as_their_standard_errors_say() -> None:
    """Two plates of one law differ by more than 1.96 standard errors in 5 % of pairs."""
    plates = [measured(seed, 60, 0.3) for seed in range(600)]
    apart = {"count": 0, "contrast": 0, "width": 0}
    for one, two in zip(plates[::2], plates[1::2], strict=True):
        for name, a, b in (
            ("count", one.count, two.count),
            ("contrast", one.contrast, two.contrast),
            ("width", one.width_px, two.width_px),
        ):
            apart[name] += abs(a.value - b.value) > 1.96 * math.hypot(a.se, b.se)
    shares = {name: number / 300 for name, number in apart.items()}
    print({name: f"{100 * share:.1f} %" for name, share in shares.items()})
    for share in shares.values():
        assert 0.01 < share < 0.10


@pytest.mark.parametrize("noise", [0.1, 0.5, 1.0, 2.0])
def test_places_under_noise(noise: float) -> None:
    """Noise of 1 to 20 % of the background; sparkles seven times as bright as it."""
    random = np.random.default_rng(7)
    rows, columns = np.meshgrid(np.arange(20.0, 780, 25), np.arange(20.0, 780, 25), indexing="ij")
    places = np.stack([rows.ravel(), columns.ravel()], axis=-1) + random.uniform(-0.5, 0.5, (rows.size, 2))
    measures = measure_sparkles(planted(random, (800, 800), places, noise))
    from scipy.spatial import cKDTree

    found = np.stack([measures.moments.row_px, measures.moments.column_px], axis=-1)
    distance = np.asarray(cKDTree(found).query(places)[0])
    rms = math.sqrt(float((distance**2).mean()))
    print(f"noise {noise}: {len(found)} of {len(places)}, rms {rms:.4f} px, at most {distance.max():.3f} px")
    assert len(found) == len(places)
    assert rms < 0.1


def test_resampling_over_all_ratios_keeps_light() -> None:
    worst = 0.0
    filters: tuple[Filter, ...] = ("area", "linear", "cubic")
    for seed in range(3000):
        random = np.random.default_rng(seed)
        pixels = int(10 ** random.uniform(0, 3.7))
        length = 10 ** random.uniform(-1, 3.5)
        pitch = length / 10 ** random.uniform(-1, 3.5)
        weights = axis_weights(pixels, length, pitch, filters[seed % 3])
        covered = min(length, weights.shape[0] * pitch)
        worst = max(worst, abs(weights.sum() * pitch / covered - 1))
        assert weights.data.min() >= 0
    print(f"largest relative loss of light {worst:.1e}")
    assert worst < 1e-9
