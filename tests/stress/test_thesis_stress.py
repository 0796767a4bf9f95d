"""The thesis's own methods swept: curves from ramps, camera RGB of any sensor, contrast of large pictures."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from devices.characterise import table_c1_codes
from devices.characterise.thesis import thesis_fits
from devices.display import DisplayModel, ToneCurve
from stimuli.luminance import contrast_over_exposure
from stimuli.pictures import StereoImage

pytestmark = pytest.mark.stress


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
    for time in (0.1, 0.5, 1.0):
        light = np.full((3000, 4000, 3), 2.0, np.float32)
        light[rows, columns] = min(100.0, 10.0 / time)
        pictures.append((f"{time} s", time, StereoImage.flat(light)))
    tracemalloc.start()
    found = contrast_over_exposure(pictures)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    contrasts = [row.as_photographed.contrast.value for row in found.rows]
    assert contrasts == pytest.approx([49, 9, 4], rel=1e-6)
    assert most < 5e8
