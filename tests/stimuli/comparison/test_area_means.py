"""Means of areas: against one call over the whole, how sure they are, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from stimuli.comparison import areas
from stimuli.comparison.areas import area_means, inside
from stimuli.errors import StimulusError
from stimuli.pictures import rows

TRIANGLE = np.array([[3.0, 2.0], [60.0, 20.0], [10.0, 70.0]])
SQUARE = np.array([[0.0, 0.0], [64.0, 0.0], [64.0, 64.0], [0.0, 64.0]])


def test_bands_give_the_means_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.random.default_rng(2).gamma(2.0, 5.0, (80, 70, 3)).astype(np.float32)
    full = picture[..., 0] > 20
    mask = inside(TRIANGLE, slice(0, 80), slice(0, 70))
    whole = area_means(picture, [("all", TRIANGLE)], full)[0]
    monkeypatch.setattr(rows, "BAND_PIXELS", 300)
    got = area_means(picture, [("all", TRIANGLE)], full)[0]
    values = picture[mask].astype(np.float64)
    for one in (whole, got):
        assert one.pixels == mask.sum()
        np.testing.assert_allclose(one.XYZ, values.mean(axis=0), rtol=1e-14)
        np.testing.assert_allclose(one.sd_XYZ, values.std(axis=0, ddof=1), rtol=1e-13)
        assert one.saturated_share == full[mask].mean()
    assert whole.covariance_XYZ is not None
    assert got.covariance_XYZ is not None
    np.testing.assert_allclose(got.covariance_XYZ, whole.covariance_XYZ, rtol=1e-10)


@pytest.mark.parametrize("outline", [SQUARE + [2, 9], SQUARE[:, ::-1] * [0.9, 1.1] + [3, 5], TRIANGLE])
def test_sums_of_cells_are_those_of_their_pixels(outline: np.ndarray) -> None:
    """Rows come a few at a time, and cells begin and end within them."""
    picture = np.random.default_rng(3).gamma(2.0, 5.0, (80, 70, 3)).astype(np.float32)
    sums = areas._Sums(outline, picture.shape)
    for start in range(sums.rows.start, sums.rows.stop, 7):
        band = slice(start, min(start + 7, sums.rows.stop))
        sums.add(band, picture[band], None)
    mask = inside(outline, sums.rows, sums.columns)
    light = np.where(mask[..., None], picture[sums.rows, sums.columns], 0.0).astype(np.float64)
    side = sums.cell_px
    for row, column in np.ndindex(sums.cells):
        cell = slice(row * side, (row + 1) * side), slice(column * side, (column + 1) * side)
        assert sums.cell_pixels[row, column] == mask[cell].sum()
        np.testing.assert_allclose(sums.cell_sums[:, row, column], light[cell].sum(axis=(0, 1)), rtol=1e-13)


class Counted:
    """A picture that counts the rows it is asked for."""

    def __init__(self, rows: int) -> None:
        self.shape = (rows, 64, 3)
        self.read = 0

    def __getitem__(self, rows: slice, /) -> np.ndarray:
        self.read += rows.stop - rows.start
        return np.ones((rows.stop - rows.start, 64, 3))


def test_only_rows_with_regions_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "BAND_PIXELS", 64 * 10)
    picture = Counted(1000)
    two = [("one", SQUARE + [0, 105]), ("two", SQUARE + [0, 801])]
    area_means(picture, two)
    assert picture.read == 2 * 64


@pytest.mark.parametrize("blurred", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_standard_errors_are_those_of_repeated_pictures(blurred: bool) -> None:
    from scipy.ndimage import uniform_filter

    rng = np.random.default_rng(8)
    light = 10.0 + np.linspace(0, 8, 64)[:, None, None]
    means, told = [], []
    for _ in range(150):
        noise = rng.standard_normal((64, 64, 3))
        picture = light + (uniform_filter(noise, (3, 3, 0), mode="wrap") if blurred else noise)
        (area,) = area_means(picture, [("all", SQUARE)])
        means.append(area.XYZ)
        assert area.covariance_XYZ is not None
        told.append(np.diag(area.covariance_XYZ))
    # 450 means: their standard deviation is known to 3.3 %, three times that is allowed. Means over cells of 8 pixels
    # of noise blurred over 3 scatter less by (1+4+6·9+4+1) / (9·8) along each axis, and so is the error told.
    ratio = np.sqrt(np.mean(told)) / np.std(means, axis=0).mean()
    assert ratio == pytest.approx(64 / 72 if blurred else 1.0, abs=0.1)


def test_what_cannot_be_averaged_is_refused() -> None:
    picture = np.ones((80, 70, 3))
    picture[40, 12, 1] = np.nan
    picture[40:42, 13, 2] = np.inf
    outlines = [("all", TRIANGLE), ("tiny", np.array([[1.0, 1.0], [3.0, 1.0], [3.0, 3.0]]))]
    with pytest.raises(StimulusError) as caught:
        area_means(picture, outlines, least_pixels=25, what="photograph")
    first, second = caught.value.findings
    assert first.message == "the region 'all' holds 3 pixels of the photograph that are no numbers"
    assert "'tiny' holds" in second.message
    assert "fewer than 25" in second.message


def test_float32_light_is_summed_in_float64() -> None:
    picture = np.full((1024, 512, 3), 0.1, dtype=np.float32)
    picture[0, 0] = 3e4
    outline = np.array([[0.0, 0.0], [512.0, 0.0], [512.0, 1024.0], [0.0, 1024.0]])
    (area,) = area_means(picture, [("all", outline)])
    np.testing.assert_allclose(area.XYZ, picture.astype(np.float64).mean(axis=(0, 1)), rtol=1e-14)


def test_small_areas_have_no_standard_error() -> None:
    picture = np.random.default_rng(1).uniform(1, 2, (64, 64, 3))
    (area,) = area_means(picture, [("small", SQUARE / 8)])
    assert area.covariance_XYZ is None
