"""Measures of pictures at the edges: any size, any light, any distance, noise of any strength, large pictures."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from numpy.typing import NDArray

from stimuli.errors import StimulusError
from stimuli.measures import (
    PicturePair,
    ViewingConditions,
    measure_named,
    measure_names,
    measure_pairs,
    measure_pictures,
    pu21_decoded,
    pu21_encoded,
)
from stimuli.pictures import rows

pytestmark = pytest.mark.stress

WHITE = np.array([95.0, 100.0, 108.9])
# What ends with the package `vdp` is tested by itself.
NAMES = tuple(name for name in measure_names(installed_only=True) if name != "cvvdp")


def grain(shape: tuple[int, int], seed: int = 1) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    return np.asarray(rng.gamma(2.0, 10.0, (*shape, 1)) * rng.uniform(0.7, 1.3, (*shape, 3)) * WHITE / 100, np.float32)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("shape", [(1, 1), (1, 60), (60, 1), (11, 11), (12, 200), (131, 67)])
def test_any_size(name: str, shape: tuple[int, int]) -> None:
    picture = grain(shape)
    viewing = ViewingConditions(45.0, WHITE)
    if name == "pu-ssim" and min(shape) < 11:
        with pytest.raises(StimulusError, match="the window of SSIM is 11 × 11"):
            measure_pictures(picture, picture, [name], viewing)
        return
    measure = measure_named(name)
    assert measure_pictures(picture, picture, [name], viewing)[name].eyes["both"].value == measure.identical
    other = measure_pictures(picture, 1.2 * picture, [name], viewing)[name].eyes["both"].value
    assert np.isfinite(other)
    assert (other < measure.identical) == (measure.better == "higher")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("pixels_per_degree", [0.05, 1.0, 10.0, 60.0, 300.0, 2000.0])
def test_any_distance(name: str, pixels_per_degree: float) -> None:
    picture = grain((64, 48))
    value = measure_pictures(picture, 1.1 * picture, [name], ViewingConditions(pixels_per_degree, WHITE))[name]
    assert np.isfinite(value.eyes["both"].value)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("luminance", [1e-30, 1e-6, 1e-3, 1.0, 1e4, 1e8])
def test_any_light(name: str, luminance: float) -> None:
    reference, test = (np.asarray(grain((40, 40), seed) * np.float32(luminance / 20)) for seed in (1, 2))
    viewing = ViewingConditions(45.0, WHITE)
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
def test_more_noise_is_farther(name: str) -> None:
    reference = grain((96, 96))
    noise = np.random.default_rng(5).standard_normal(reference.shape).astype(np.float32)
    viewing = ViewingConditions(45.0, WHITE)
    values = [
        measure_pictures(reference, reference * np.exp(strength * noise), [name], viewing)[name].eyes["both"].value
        for strength in (0.0, 0.005, 0.02, 0.08, 0.3)
    ]
    assert values == sorted(values, reverse=measure_named(name).better == "higher")
    assert len(set(values)) == len(values)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("band_rows", [1, 3, 17, 64])
def test_bands_of_any_height_make_the_map_of_the_whole(
    monkeypatch: pytest.MonkeyPatch, name: str, band_rows: int
) -> None:
    reference, test = grain((97, 53)), grain((97, 53), 2)
    viewing = ViewingConditions(120.0, WHITE)
    whole = measure_named(name).measure(reference, test, viewing).error_map
    monkeypatch.setattr(rows, "BAND_PIXELS", 53 * band_rows)
    banded = measure_named(name).measure(reference, test, viewing).error_map
    assert whole is not None
    assert banded is not None
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
            return np.asarray((20 + 15 * waves)[..., None] * (self.factor * WHITE / 100).astype(np.float32))

    tracemalloc.start()
    pair = {"both": PicturePair(Stripes(1.0), Stripes(1.03))}
    table = measure_pairs(pair, [name], ViewingConditions(45.0, WHITE), map_longest_px=900)  # type: ignore[arg-type]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # Twenty-four of the map in single precision; the packages' own memory is not traced.
    assert peak < 250e6
    small = table[name].eyes["both"].error_map
    assert small is not None
    assert max(small.shape) <= 900


def test_pu21_is_monotonic_and_undone_over_its_range() -> None:
    light = np.geomspace(0.005, 10_000.0, 100_001)
    values = pu21_encoded(light)
    assert (np.diff(values) > 0).all()
    np.testing.assert_allclose(pu21_decoded(values), light, rtol=1e-6)
