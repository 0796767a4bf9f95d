"""S-CIELAB of 1996 against its code's definition and slow filters."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import xyz_to_lab
from extensions.measures import SCielab1996, kernels_1996, seen_1996
from extensions.measures.scielab_1996 import GAUSSIANS as GAUSSIANS_1996
from extensions.measures.scielab_1996 import OPPONENT_FROM_XYZ
from stimuli.errors import StimulusError
from stimuli.measures import ViewingConditions, measure_pictures

# S-CIELAB of 1996: kernels against the code's definition, the picture against two-dimensional filters, both ways.

KERNELS_WHITE = np.array([95.0, 100.0, 108.9])


def noise(shape: tuple[int, int], seed: int = 1) -> NDArray[np.float64]:
    return np.random.default_rng(seed).uniform(2.0, 90.0, (*shape, 3))


def kernel_step_by_step(hwhm_deg: float, weight: float, density: float) -> list[float]:
    """One Gaussian of the code: sampled finely, interpolated by a triangle, sampled down; in loops."""
    finer = int(np.ceil(224 / density)) if density < 224 else 1
    fine = density * finer
    width = int(np.ceil(fine / 2)) * 2 - 1
    middle = width // 2
    samples = [0.5 ** (((i - middle) / (hwhm_deg * fine)) ** 2) for i in range(width)]
    total = sum(samples)
    samples = [np.sign(weight) * np.sqrt(abs(weight)) * one / total for one in samples]
    places = sorted({*range(middle, -1, -finer), *range(middle, width, finer)})
    out = []
    for place in places:
        near = range(max(0, place - finer + 1), min(width, place + finer))
        out.append(sum(samples[i] * (1 - abs(i - place) / finer) for i in near))
    return out


@pytest.mark.parametrize("density", [9.7, 44.1, 224.0, 301.5])
def test_kernels_are_those_of_the_code(density: float) -> None:
    for kernels, gaussians in zip(kernels_1996(density), GAUSSIANS_1996, strict=True):
        for kernel, (hwhm, weight) in zip(kernels, gaussians, strict=True):
            np.testing.assert_allclose(kernel, kernel_step_by_step(hwhm, weight, density), rtol=0, atol=1e-13)


@pytest.mark.parametrize("shape", [(40, 50), (12, 50), (40, 9), (7, 8)])
def test_the_picture_is_that_of_filters_in_two_dimensions(shape: tuple[int, int]) -> None:
    """Also where the kernel is longer than the picture, of which the code then mirrors half and takes 0 beyond."""
    xyz, density = noise(shape), 14.0
    opponent = xyz @ OPPONENT_FROM_XYZ.T
    plain = np.zeros_like(opponent)
    for channel, kernels in enumerate(kernels_1996(density)):
        size = kernels.shape[1]
        reach = size // 2
        pads = [reach if size < length else length // 2 for length in shape]
        padded = np.pad(opponent[..., channel], [(pads[0], pads[0]), (pads[1], pads[1])], mode="symmetric")
        padded = np.pad(padded, reach)
        for kernel in kernels:
            filter_2d = np.outer(np.abs(kernel), kernel)
            for row in range(shape[0]):
                for column in range(shape[1]):
                    top, left = row + pads[0], column + pads[1]
                    part = padded[top : top + size, left : left + size]
                    plain[row, column, channel] += float((part * filter_2d).sum())
    expected = plain @ np.linalg.inv(OPPONENT_FROM_XYZ).T
    np.testing.assert_allclose(seen_1996(xyz, density), expected, rtol=0, atol=1e-9)


def test_bands_are_those_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = noise((400, 30)), noise((400, 30), 2)
    viewing = ViewingConditions(20.0, KERNELS_WHITE)
    whole = SCielab1996().error_map(first, second, viewing)
    monkeypatch.setattr("stimuli.pictures.rows.BAND_PIXELS", 30)
    np.testing.assert_allclose(SCielab1996().error_map(first, second, viewing), whole, rtol=0, atol=2e-5)


def test_pixels_above_twenty_are_counted_and_none_where_pictures_are_alike() -> None:
    grey = np.broadcast_to(0.4 * KERNELS_WHITE, (80, 90, 3)).astype(np.float32)
    changed = grey.copy()
    changed[20:60, 30:70] *= 2.2
    viewing = ViewingConditions(20.0, KERNELS_WHITE)
    found = measure_pictures(grey, changed, ["s-cielab-1996"], viewing)["s-cielab-1996"].eyes["both"]
    assert found.error_map is not None
    above = int((found.error_map > 20).sum())
    assert 1000 < above < 2400
    assert found.remarks[0].startswith(f"{above} of 7200 pixels")
    alike = measure_pictures(grey, grey, ["s-cielab-1996"], viewing)["s-cielab-1996"].eyes["both"]
    assert alike.value == 0.0
    assert alike.remarks[0].startswith("0 of 7200")


def test_wrong_input() -> None:
    with pytest.raises(StimulusError, match=r"0\.01 to 2000"):
        kernels_1996(0.001)
    with pytest.raises(StimulusError, match="check the viewing distance"):
        measure_pictures(noise((9, 9)), noise((9, 9)), ["s-cielab-1996"], ViewingConditions(9e4, KERNELS_WHITE))
    with pytest.raises(StimulusError, match=r"0\.1° to 60°"):
        kernels_1996(30.0, support_deg=0.01)


def test_the_cut_takes_the_flat_gaussian_of_seven_degrees() -> None:
    """Within 1° it is nearly constant: it lowers the mean luminance around; without the cut it hardly does."""
    cut, wide = kernels_1996(30.0)[0], kernels_1996(30.0, support_deg=30.0)[0]
    assert np.ptp(cut[2][1:-1]) / np.abs(cut[2]).max() < 0.005
    assert np.ptp(wide[2]) / np.abs(wide[2]).max() > 0.9
    assert len(wide[2]) > 25 * len(cut[2])


def test_the_map_is_the_difference_of_1976() -> None:
    first, second = noise((60, 40)), noise((60, 40), 2)
    labs = [xyz_to_lab(seen_1996(one, 30.0), KERNELS_WHITE) for one in (first, second)]
    errors = SCielab1996().error_map(first, second, ViewingConditions(30.0, KERNELS_WHITE))
    np.testing.assert_allclose(errors, np.linalg.norm(labs[0] - labs[1], axis=-1), rtol=1e-6)
