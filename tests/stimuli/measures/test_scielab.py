"""What the eye resolves, and S-CIELAB of 1996."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import ndtr

from devices.colour import xyz_to_lab
from stimuli.errors import StimulusError
from stimuli.measures import (
    SCielab1996,
    SeenPicture,
    ViewingConditions,
    difference_map,
    kernels_1996,
    measure_pictures,
    seen_1996,
)
from stimuli.measures.scielab import GAUSSIANS, opponent_from_xyz
from stimuli.measures.scielab_1996 import GAUSSIANS as GAUSSIANS_1996
from stimuli.measures.scielab_1996 import OPPONENT_FROM_XYZ
from stimuli.pictures import Rows

# What the eye resolves: against full-size sums of Gaussians, and by what must hold at any distance.

WHITE = np.array([96.4, 100.0, 82.5])
OPPONENT = opponent_from_xyz(WHITE)


def blur_matrix(pixels: int, sd_px: float) -> NDArray[np.float64]:
    """One axis of a blur: each row how much of every pixel a pixel gets, the picture mirrored at its edges."""
    reach = int(7 * sd_px) + 2
    kernel = np.diff(ndtr((np.arange(-reach, reach + 2) - 0.5) / sd_px))
    matrix = np.zeros((pixels, pixels))
    pixel = np.arange(pixels)
    for offset, weight in zip(range(-reach, reach + 1), kernel, strict=True):
        place = (pixel + offset) % (2 * pixels)
        matrix[pixel, np.minimum(place, 2 * pixels - 1 - place)] += weight
    return np.asarray(matrix / matrix.sum(axis=1, keepdims=True))


def seen_plain(xyz: NDArray[np.float64], pixels_per_degree: float) -> NDArray[np.float64]:
    """The slow twin: every Gaussian at full size, as matrices."""
    opponent = xyz @ OPPONENT.T
    out = np.zeros_like(opponent)
    for channel, gaussians in enumerate(GAUSSIANS):
        total = sum(weight for weight, _ in gaussians)
        for weight, spread_deg in gaussians:
            sd = spread_deg * pixels_per_degree / np.sqrt(2)
            down, across = (blur_matrix(pixels, sd) for pixels in xyz.shape[:2])
            out[..., channel] += weight / total * (down @ opponent[..., channel] @ across.T)
    return np.asarray(out @ np.linalg.inv(OPPONENT).T)


@pytest.mark.parametrize("pixels_per_degree", [12.0, 44.1, pytest.param(300.0, marks=pytest.mark.nightly)])
def test_against_full_size_blurs(pixels_per_degree: float) -> None:
    """Noise of single bright pixels is the hardest: within 3e-6 of the brightest, with cells and without."""
    xyz = np.random.default_rng(1).gamma(0.3, 10.0, (50, 80, 3))
    plain = seen_plain(xyz, pixels_per_degree)
    np.testing.assert_allclose(SeenPicture(xyz, pixels_per_degree, WHITE)[:], plain, rtol=0, atol=3e-6 * xyz.max())


@given(st.floats(1.0, 2000.0), st.lists(st.floats(0.01, 500.0), min_size=3, max_size=3))
@settings(max_examples=8, deadline=None)
def test_a_uniform_field_stays_as_it_is(pixels_per_degree: float, colour: list[float]) -> None:
    xyz = np.broadcast_to(np.array(colour), (37, 23, 3))
    np.testing.assert_allclose(SeenPicture(xyz, pixels_per_degree, WHITE)[:], xyz, rtol=0, atol=2e-5 * max(colour))


@given(st.integers(0, 59), st.integers(1, 60))
@settings(max_examples=8, deadline=None)
def test_any_rows_are_those_of_the_whole(start: int, count: int) -> None:
    xyz = np.random.default_rng(2).gamma(1.0, 10.0, (60, 40, 3))
    seen = SeenPicture(xyz, 60.0, WHITE)
    np.testing.assert_allclose(seen[start : start + count], seen[:][start : start + count], rtol=0, atol=1e-5)


def test_a_difference_in_the_dark_beside_a_highlight_is_not_lost() -> None:
    """The widest Gaussian's weight is below 0, so that dark places near bright ones are left below 0."""
    photo = np.full((60, 200, 3), 0.5) * WHITE / 100.0
    photo[:, 80:90] *= 2000.0
    rendering = photo.copy()
    rendering[:, 150:] *= 6.0
    seen = [SeenPicture(picture, 40, WHITE) for picture in (photo, rendering)]
    assert (seen[0][:][:, 160:] < 0).all()
    map_ = difference_map(seen[0], seen[1], WHITE, filtered=True)
    assert map_[:, 160:].min() > 1.0
    assert map_[:, :60].max() < 0.5


@pytest.mark.parametrize("pixels_per_degree", [0.0, -1.0, np.nan, np.inf])
def test_a_distance_that_cannot_be_is_refused(pixels_per_degree: float) -> None:
    with pytest.raises(StimulusError, match="above 0"):
        SeenPicture(np.ones((4, 4, 3)), pixels_per_degree, WHITE)
    with pytest.raises(StimulusError, match="white"):
        SeenPicture(np.ones((4, 4, 3)), 60.0, [1.0, np.nan, 1.0])


def test_rows_are_read_a_few_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stimuli.pictures.rows.BAND_PIXELS", 20 * 30)
    most = 0

    class Counted:
        shape = (400, 30, 3)

        def __getitem__(self, rows: slice) -> NDArray[np.float64]:
            nonlocal most
            height = len(range(*rows.indices(400)))
            most = max(most, height)
            return np.ones((height, 30, 3))

    source: Rows = Counted()
    difference_map(SeenPicture(source, 20, WHITE), SeenPicture(source, 20, WHITE), WHITE, filtered=True)
    assert most < 400 / 4


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
