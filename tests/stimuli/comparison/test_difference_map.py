"""ΔE00 per pixel: the map against one call, what it comes to, and its figures."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import delta_e_2000, xyz_to_lab
from runner.reports.comparison.figures import histogram_figure, map_figure, profile, profile_figure
from stimuli.comparison import summarise
from stimuli.comparison.by_pixel import histogram, overview
from stimuli.errors import StimulusError
from stimuli.measures import difference_map, reduced
from stimuli.pictures import rows

WHITE = np.array([96.4, 100.0, 82.5])


def pair() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    photo = np.random.default_rng(1).gamma(2.0, 10.0, (57, 31, 3)).astype(np.float32)
    return photo, (photo * np.float32(1.03)).astype(np.float32)


def test_bands_make_the_map_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    photo, rendering = pair()
    whole = delta_e_2000(xyz_to_lab(photo, WHITE), xyz_to_lab(rendering, WHITE))
    monkeypatch.setattr(rows, "BAND_PIXELS", 100)
    done: list[tuple[int, int]] = []
    got = difference_map(photo, rendering, WHITE, lambda rows, of: done.append((rows, of)))
    np.testing.assert_array_equal(got, whole.astype(np.float32))
    assert done[-1] == (57, 57)
    assert len(done) == 19


def test_what_cannot_be_compared_is_refused() -> None:
    photo, rendering = pair()
    with pytest.raises(StimulusError, match="bring them to one grid"):
        difference_map(photo, rendering[:-1], WHITE)
    rendering[3, 4, 1] = np.nan
    rendering[5, 6, 0] = np.inf
    with pytest.raises(StimulusError, match="2 pixels cannot be compared"):
        difference_map(photo, rendering, WHITE)


def test_the_summary_of_known_differences() -> None:
    delta_e = np.asarray(np.arange(100).reshape(10, 10) / 10, dtype=np.float32)
    compared = np.ones((10, 10), dtype=np.bool_)
    compared[9] = False
    summary = summarise(delta_e, 1.4, compared)
    assert summary.pixels == 90
    assert summary.mean == pytest.approx(4.45)
    assert summary.median == pytest.approx(4.45)
    assert summary.largest == pytest.approx(8.9)
    assert summary.above_limit_percent == pytest.approx(100 * 75 / 90)
    assert summarise(delta_e, 1.4).pixels == 100
    with pytest.raises(StimulusError, match="all are excluded"):
        summarise(delta_e, 1.4, np.zeros((10, 10), dtype=np.bool_))


def test_the_histogram_counts_every_pixel_once() -> None:
    delta_e = np.array([[0.0, 0.05, 9.99, 10.0, 250.0]], dtype=np.float32)
    counts, edges = histogram(delta_e)
    assert counts.sum() == 5
    assert counts[0] == 2
    assert counts[-1] == 3
    assert edges[-1] == 10.0


def test_a_reduced_map_keeps_the_mean_of_what_is_compared() -> None:
    delta_e = np.random.default_rng(2).uniform(0, 5, (103, 47)).astype(np.float32)
    compared = np.random.default_rng(3).uniform(size=delta_e.shape) > 0.3
    compared[:8, :8] = False
    small = reduced(delta_e, compared, longest_px=20)
    assert max(small.shape) <= 20
    assert np.isnan(small[0, 0])
    assert small[1, 1] == pytest.approx(delta_e[6:12, 6:12][compared[6:12, 6:12]].mean(), rel=1e-6)
    np.testing.assert_array_equal(reduced(delta_e, longest_px=103), delta_e)


def test_a_picture_does_not_differ_from_itself() -> None:
    photo, _ = pair()
    assert not difference_map(photo, photo, WHITE).any()


def test_light_below_none_counts_as_none() -> None:
    dark = np.full((2, 2, 3), -0.5)
    assert not difference_map(dark, np.zeros((2, 2, 3)), WHITE).any()


def test_a_profile_follows_its_line() -> None:
    plane = np.add.outer(10.0 * np.arange(50), np.arange(80.0))
    along = profile(plane, (3, 7), (63, 7))
    np.testing.assert_allclose(along, 70 + np.linspace(3, 63, 61))
    np.testing.assert_allclose(profile(plane, (5, 5), (5, 6.0)), [55, 65])


def test_figures_say_what_they_show() -> None:
    delta_e = np.full((30, 40), 2.0, dtype=np.float32)
    shown = overview(delta_e)
    svg = map_figure(shown.reduced, "difference <map>").svg
    assert svg.startswith("<svg")
    assert "difference &lt;map&gt;" in svg
    assert "ΔE00" in svg
    assert "limit 1.4" in histogram_figure(shown, 1.4, "histogram").svg
    assert "rendering" in profile_figure(np.arange(5.0), np.arange(5.0), "profile").svg
