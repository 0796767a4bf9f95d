"""What the eye resolves, and S-CIELAB of 1996."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import ndtr

from devices.colour import xyY_from_XYZ
from stimuli.errors import StimulusError
from stimuli.measures import SeenPicture, difference_map
from stimuli.measures.scielab import GAUSSIANS, opponent_from_xyz
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


def test_a_grey_pattern_gets_no_colour() -> None:
    grey = np.random.default_rng(4).gamma(0.5, 30.0, (60, 60, 1)) * (WHITE / WHITE[1])
    seen = xyY_from_XYZ(SeenPicture(grey, 60, WHITE)[:])
    np.testing.assert_allclose(seen[..., :2], np.broadcast_to(xyY_from_XYZ(WHITE)[:2], seen[..., :2].shape), atol=1e-4)


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
