"""Luminance, measures of pictures and what the eye resolves, at any size, light and distance."""

from __future__ import annotations

import math
import time
import tracemalloc

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.characterise import table_c1_codes
from devices.characterise.thesis import thesis_fits
from devices.display import DisplayModel, ToneCurve
from extensions.measures import pu21_decoded, pu21_encoded
from extensions.sparkle import contrast_over_exposure
from stimuli.comparison import summarise
from stimuli.errors import StimulusError
from stimuli.luminance import picture_statistics
from stimuli.luminance.saturation import largest_factor, measure_saturation
from stimuli.measures import (
    PicturePair,
    SeenPicture,
    ViewingConditions,
    difference_map,
    measure_named,
    measure_names,
    measure_pairs,
    measure_pictures,
)
from stimuli.pictures import StereoImage, resample_picture, rows
from stimuli.pictures.resampling import Filter, axis_weights
from stimuli.sparkles import SparkleMeasures, measure_sparkles
from tests.kept import known
from tests.stress.sheet import WHITE, Sheet

pytestmark = pytest.mark.stress


# Factors, statistics, sparkle measures and resampling at their edges.

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
            assert measure_saturation(xyz, shown, 1e9).any_channel <= allowed
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


# Measures of pictures at the edges: any size, any light, any distance, noise of any strength, large pictures.

MEASURES_WHITE = np.array([95.0, 100.0, 108.9])
# What ends with the package `vdp` is tested by itself.
NAMES = tuple(name for name in measure_names(installed_only=True) if name != "cvvdp")


def grain(shape: tuple[int, int], seed: int = 1) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    return np.asarray(
        rng.gamma(2.0, 10.0, (*shape, 1)) * rng.uniform(0.7, 1.3, (*shape, 3)) * MEASURES_WHITE / 100, np.float32
    )


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("pixels_per_degree", [0.05, 1.0, 10.0, 60.0, 300.0, 2000.0])
def test_any_distance(name: str, pixels_per_degree: float) -> None:
    picture = grain((64, 48))
    value = measure_pictures(picture, 1.1 * picture, [name], ViewingConditions(pixels_per_degree, MEASURES_WHITE))[name]
    assert np.isfinite(value.eyes["both"].value)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("luminance", [1e-30, 1e-6, 1e-3, 1.0, 1e4, 1e8])
def test_any_light(name: str, luminance: float) -> None:
    reference, test = (np.asarray(grain((40, 40), seed) * np.float32(luminance / 20)) for seed in (1, 2))
    viewing = ViewingConditions(45.0, MEASURES_WHITE)
    if name == "hdr-flip" and luminance < 1e-4:
        # Nothing but light that the exposures of HDR-ꟻLIP cannot lift is refused.
        with pytest.raises(StimulusError, match="the reference is black"):
            measure_pictures(reference, test, [name], viewing)
        return
    table = measure_pictures(reference, test, [name], viewing)
    value = table[name].eyes["both"].value
    assert not np.isnan(value)
    if luminance == 1.0:
        assert value != measure_named(name).identical


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("band_rows", [1, 3, 17, 64])
def test_bands_of_any_height_make_the_map_of_the_whole(
    monkeypatch: pytest.MonkeyPatch, name: str, band_rows: int
) -> None:
    reference, test = grain((97, 53)), grain((97, 53), 2)
    viewing = ViewingConditions(120.0, MEASURES_WHITE)
    whole = known(measure_named(name).measure(reference, test, viewing).error_map)
    monkeypatch.setattr(rows, "BAND_PIXELS", 53 * band_rows)
    banded = known(measure_named(name).measure(reference, test, viewing).error_map)
    # Sums of S-CIELAB's wide Gaussians, in single precision, are added up in another order.
    np.testing.assert_allclose(banded, whole, rtol=0, atol=2e-3 if name.startswith("s-cielab") else 1e-6)


@pytest.mark.parametrize("name", [name for name in NAMES if name in ("hdr-flip", "pu-ssim")])
def test_six_megapixels_in_little_memory(name: str) -> None:
    class Stripes:
        shape = (2000, 3000, 3)

        def __init__(self, factor: float) -> None:
            self.factor = factor

        def __getitem__(self, part: slice) -> NDArray[np.float32]:
            start, stop, _ = part.indices(self.shape[0])
            waves = np.sin(np.arange(start, stop)[:, None] * 0.7 + np.arange(self.shape[1]) * 1.3, dtype=np.float32)
            return np.asarray((20 + 15 * waves)[..., None] * (self.factor * MEASURES_WHITE / 100).astype(np.float32))

    tracemalloc.start()
    pair = {"both": PicturePair(Stripes(1.0), Stripes(1.03))}
    table = measure_pairs(pair, [name], ViewingConditions(45.0, MEASURES_WHITE), map_longest_px=900)  # type: ignore[arg-type]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # Twenty-four of the map in single precision; the packages' own memory is not traced.
    assert peak < 250e6
    small = known(table[name].eyes["both"].error_map)
    assert max(small.shape) <= 900


def test_pu21_is_monotonic_and_undone_over_its_range() -> None:
    light = np.geomspace(0.005, 10_000.0, 100_001)
    values = pu21_encoded(light)
    assert (np.diff(values) > 0).all()
    np.testing.assert_allclose(pu21_decoded(values), light, rtol=1e-6)


# ΔE00 and what the eye resolves, at the edges: 36 megapixels, lone pixels, any light, any distance.
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


# The thesis's own methods swept: curves from ramps, camera RGB of any sensor, contrast of large pictures.
def test_every_gog_display_s_curves_come_back_from_its_ramps() -> None:
    """Channels with offsets up to 0.08, which give light at code 0, gammas of 1.2 to 3 and any mixing primaries."""
    random = np.random.default_rng(4)
    codes = table_c1_codes()
    worst = np.zeros(3)
    for _ in range(60):
        offsets = random.uniform(0, 0.08, 3) * (random.random(3) < 0.5)
        curves = [
            ToneCurve(float(random.uniform(0.8, 1.2)), float(offset), float(random.uniform(1.2, 3)))
            for offset in offsets
        ]
        primaries = np.diag(random.uniform(5, 60, 3)) + random.uniform(0, 4, (3, 3))
        XYZ = DisplayModel(np.zeros(3), primaries, (curves[0], curves[1], curves[2])).xyz(codes)
        for fit, curve in zip(thesis_fits(codes, XYZ, primaries).forward["gog"], curves, strict=True):
            true = np.array([curve.gain, curve.offset, curve.gamma])
            worst = np.maximum(worst, np.abs(fit.coefficients[:3] - true))
    assert worst.max() < 1e-6


def test_contrast_of_twelve_megapixels_takes_little_more_than_the_pictures() -> None:
    """Three exposures of 4000 × 3000 pixels with 10,000 sparkles: the contrast is exact, memory 0.5 GB beside them."""
    random = np.random.default_rng(6)
    rows, columns = (random.choice(np.arange(8, size - 8, 16), 10_000) for size in (3000, 4000))
    pictures = []
    for exposure_s in (0.1, 0.5, 1.0):
        light = np.full((3000, 4000, 3), 2.0, np.float32)
        light[rows, columns] = min(100.0, 10.0 / exposure_s)
        pictures.append((f"{exposure_s} s", exposure_s, StereoImage.flat(light)))
    tracemalloc.start()
    found = contrast_over_exposure(pictures)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    contrasts = [row.as_photographed.contrast.value for row in found.rows]
    assert contrasts == pytest.approx([49, 9, 4], rel=1e-6)
    assert most < 5e8
