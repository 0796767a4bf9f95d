"""ꟻLIP against NVIDIA's implementation on the same input, by bands, and what it cannot take."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import linear_srgb_matrix
from stimuli.errors import StimulusError
from stimuli.measures import ViewingConditions, measure_named, measure_pictures
from stimuli.pictures import rows
from tests.kept import known

evaluate = pytest.importorskip("flip_evaluator").evaluate

WHITE = np.array([90.0, 100.0, 120.0])
VIEWING = ViewingConditions(45.0, WHITE)
KINDS = [("flip", "LDR"), ("hdr-flip", "HDR")]


def pair(level: float = 1.0, seed: int = 1) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Blocks of colour with grain, and the same with other grain; some of it above the display's white."""
    rng = np.random.default_rng(seed)
    blocks = np.kron(rng.uniform(1.0, 110.0, (12, 16, 3)), np.ones((8, 8, 1))) * rng.uniform(0.9, 1.1, (96, 128, 1))
    reference = (level * blocks).astype(np.float32)
    return reference, (reference * rng.normal(1.0, 0.04, reference.shape)).clip(0).astype(np.float32)


def by_the_reference(
    reference: NDArray[np.float32], test: NDArray[np.float32], kind: str
) -> tuple[NDArray[np.float32], float]:
    """The implementation's own call: linear sRGB of the display's white, by the definition of sRGB and Bradford."""
    linear = [np.maximum(picture @ linear_srgb_matrix(WHITE).T, 0).astype(np.float32) for picture in (reference, test)]
    errors, mean, _ = evaluate(*linear, kind, inputsRGB=False, applyMagma=False, parameters={"ppd": 45.0})
    return errors[..., 0], mean


@pytest.mark.parametrize(("name", "kind"), KINDS)
@pytest.mark.parametrize("level", [1e-3, 20.0])
def test_map_and_mean_are_those_of_the_implementation(name: str, kind: str, level: float) -> None:
    reference, test = pair(level)
    expected, mean = by_the_reference(reference, test, kind)
    got = measure_named(name).measure(reference, test, VIEWING)
    np.testing.assert_allclose(known(got.error_map), expected, rtol=0, atol=1e-6)
    # The implementation adds up in single precision: 12,288 terms are off by some 1e-6 of their mean.
    assert got.value == pytest.approx(mean, rel=2e-5)
    assert got.value == pytest.approx(float(expected.mean(dtype=np.float64)), abs=1e-9)
    assert got.value > 0.001


@pytest.mark.parametrize("name", ["flip", "hdr-flip"])
@pytest.mark.parametrize("band_pixels", [128 * 30])
def test_bands_make_the_map_of_the_whole(monkeypatch: pytest.MonkeyPatch, name: str, band_pixels: int) -> None:
    reference, test = pair()
    whole = known(measure_named(name).measure(reference, test, VIEWING).error_map)
    monkeypatch.setattr(rows, "BAND_PIXELS", band_pixels)
    banded = known(measure_named(name).measure(reference, test, VIEWING).error_map)
    np.testing.assert_allclose(banded, whole, rtol=0, atol=1e-7)


def test_ldr_clips_and_says_so_and_hdr_does_not() -> None:
    reference = np.broadcast_to(1.5 * WHITE, (40, 40, 3)).astype(np.float32)
    table = measure_pictures(reference, 2.0 * reference, ["flip", "hdr-flip"], VIEWING)
    clipped, whole = table["flip"].eyes["both"], table["hdr-flip"].eyes["both"]
    assert clipped.value == 0.0
    assert len(clipped.remarks) == 1
    assert "100 %" in clipped.remarks[0]
    assert whole.value > 0.05
    assert whole.remarks == ()
    within = measure_pictures(0.5 * reference, 0.6 * reference, ["flip"], VIEWING)["flip"].eyes["both"]
    assert within.remarks == ()
    assert within.value > 0.05


def test_a_black_reference_is_refused_and_the_program_stays() -> None:
    black, grey = np.zeros((20, 20, 3), np.float32), np.full((20, 20, 3), 10.0, np.float32)
    with pytest.raises(StimulusError, match="the reference is black"):
        measure_pictures(black, grey, ["hdr-flip"], VIEWING)
    assert measure_pictures(black, grey, ["flip"], VIEWING)["flip"].eyes["both"].value > 0.3
    assert measure_pictures(grey, black, ["hdr-flip"], VIEWING)["hdr-flip"].eyes["both"].value > 0.3


def test_pixels_per_degree_that_take_minutes_are_refused() -> None:
    reference, test = pair()
    with pytest.raises(StimulusError, match="computed up to 2000"):
        measure_pictures(reference, test, ["flip"], ViewingConditions(5000.0, WHITE))


def test_the_white_of_the_display_is_white() -> None:
    matrix = linear_srgb_matrix(WHITE)
    np.testing.assert_allclose(matrix @ WHITE, [1.0, 1.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(matrix @ (0.18 * WHITE), [0.18, 0.18, 0.18], atol=1e-12)


@pytest.mark.parametrize("band_pixels", [1 << 19, 40 * 7])
def test_the_share_of_clipped_pixels_is_of_each_picture(monkeypatch: pytest.MonkeyPatch, band_pixels: int) -> None:
    reference = np.broadcast_to(0.5 * WHITE, (40, 40, 3)).astype(np.float32)
    test = reference.copy()
    test[:10] *= 3.0
    monkeypatch.setattr(rows, "BAND_PIXELS", band_pixels)
    remarks = measure_pictures(reference, test, ["flip"], VIEWING)["flip"].eyes["both"].remarks
    assert "0 % of the reference's pixels and 25 % of the test picture's" in remarks[0]


def test_nothing_heavy_is_imported_before_it_is_used() -> None:
    code = (
        "import sys, numpy as np\n"
        "from stimuli.measures import measure_names, measure_named\n"
        "measure_named('flip'), measure_names(installed_only=True)\n"
        "print([name for name in ('flip_evaluator', 'torch', 'skimage') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
