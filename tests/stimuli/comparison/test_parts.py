"""Parts of a comparison: rows in files, bands, ΔE00 per pixel, the luminance factor, whose luminance is white."""

from __future__ import annotations

import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.colour import delta_e_2000, rgb_to_xyz_matrix, white_point, xyz_to_lab
from devices.display import read_rig
from runner.reports.comparison.figures import draw_pictures, histogram_figure, map_figure, profile, profile_figure
from stimuli.align import warp
from stimuli.comparison import compare_regions, place_regions, summarise
from stimuli.comparison.alignment import Alignment, resample, resample_flags
from stimuli.comparison.by_pixel import histogram, overview
from stimuli.comparison.luminance import luminance_factor
from stimuli.comparison.regions_file import RegionsFile
from stimuli.errors import StimulusError
from stimuli.measures import difference_map, reduced
from stimuli.pictures import REC709, RowFile, rows
from tests.kept import known
from tests.stimuli.comparison.scenes import (
    CHART,
    PLATE,
    RIG,
    Cyclopean,
    chart,
    compared,
    few,
    patch_XYZ,
    said,
    spots,
    written,
)


# Rows in files, bands of a turned picture, corners, spectra, and the page.
class Ids(HTMLParser):
    """Gathers what a page names and asks for."""

    def __init__(self) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.asked: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id":
                self.ids.append(value or "")
            if name in ("src", "href", "xlink:href") and value and not value.startswith(("data:", "#")):
                self.asked.append(value)


@settings(max_examples=30, deadline=None)
@given(height=st.integers(1, 40), width=st.integers(1, 30), first=st.integers(-45, 45), last=st.integers(-45, 45))
def test_rows_come_back(height: int, width: int, first: int, last: int) -> None:
    picture = np.random.default_rng(height).random((height, width, 3)).astype(np.float32)
    rows = RowFile.of(picture)
    np.testing.assert_array_equal(rows[first:last], picture[first:last])


def alignment(matrix: np.ndarray) -> Alignment:
    return Alignment(matrix, "corners", (0.0, 0.0), None, 1.0, None, 1.0, None, 0, 0, True)


def test_bands_equal_the_whole() -> None:
    picture = spots(size=(200, 600), count=2000)
    c, s = np.cos(np.radians(40.0)), np.sin(np.radians(40.0))
    matrix = np.array([[c, -s, 60.0], [s, c, 20.0], [1e-5, 2e-5, 1.0]])
    found, within = resample(RowFile.of(picture), alignment(matrix), (220, 620), lambda done, of: None)
    whole = warp(picture, matrix, (220, 620)).picture
    assert np.abs(found[0:620] - whole)[within].max() < 2e-4 * picture.max()
    assert 0.05 < within.mean() < 0.95
    flags = picture[..., 1] > 100
    moved = resample_flags(flags, alignment(matrix), (220, 620))
    # Every pixel that light of a flagged one reaches is flagged.
    light = warp(flags[..., None].astype(np.float32), matrix, (220, 620)).picture[..., 0]
    assert moved[within & (light > 0.6)].all()
    assert moved.mean() < 10 * flags.mean()


def test_tiff_and_told_colour_spaces(tmp_path: Path, cyclopean: Cyclopean) -> None:
    import tifffile

    picture = few()
    photo = written(tmp_path / "a.exr", picture)
    tifffile.imwrite(tmp_path / "xyz.tif", picture, photometric="rgb")
    linear = (picture.astype(np.float64) @ np.linalg.inv(rgb_to_xyz_matrix(*REC709)).T).astype(np.float32)
    tifffile.imwrite(tmp_path / "rec709.tif", linear, photometric="rgb")
    for name in ("xyz", "rec709"):
        found = compared(cyclopean, photo, tmp_path / f"{name}.tif", "--regions", PLATE, "--rendering-holds", name)
        sums = found["eyes"]["both"]["per_pixel"]
        assert sums["mean"] < 0.05
        assert sums["largest"] < 0.5  # half floats round X, Y and Z apart, by 1/2048 each
        assert found["rendering"]["holds"] == name
    tifffile.imwrite(tmp_path / "whole.tif", picture.astype(np.uint16), photometric="rgb")
    told = cyclopean("compare", photo, tmp_path / "whole.tif", "--regions", PLATE, "--rendering-holds", "xyz", expect=2)
    assert "whole numbers are no light" in told.stderr


def test_pictures_are_drawn_with_the_displays_white_as_white() -> None:
    import base64
    import io

    from PIL import Image

    def middle(url: str) -> NDArray[np.int_]:
        picture = Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2])))
        return np.array(picture.resize((1, 1), Image.Resampling.BOX).convert("RGB")).reshape(3).astype(int)

    white = read_rig(RIG).models.left.white_XYZ_cd_m2
    grey = np.broadcast_to(0.2 * white, (40, 60, 3)).copy()
    for drawn in draw_pictures(grey, 0.5 * grey, white)[:2]:
        assert np.ptp(middle(drawn)) <= 1
    d50 = white_point("d50", 1.0)
    assert middle(draw_pictures(grey, grey, d50)[0])[2] == 255


def test_a_limit_decides_and_help_says_how_it_ends(tmp_path: Path, cyclopean: Cyclopean) -> None:
    files = written(tmp_path / "a.exr", few()), written(tmp_path / "b.exr", few(gain=1.03))
    found = compared(cyclopean, *files, "--regions", PLATE, "--rig", RIG, "--limit", "0.3", expect=1)
    assert any("more than 0.3" in line for line in said(found, "fails"))
    told = cyclopean("compare", *files, "--regions", PLATE)
    assert told.stdout.startswith("Validated: ")
    assert "0 validated, 1 not validated" in " ".join(cyclopean("compare", "--help").stdout.split())


def test_corners_count_from_the_corner_of_a_pixel(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """Where nothing in the pictures says more, the corners alone decide, and what is left is not known."""
    here = np.array([[0.0, 0.0], [200.0, 0.0], [200.0, 100.0], [0.0, 100.0]])
    corners = [[f"{x},{y}" for x, y in (scale * here).tolist()] for scale in (1.0, 1.05)]
    files = written(tmp_path / "a.exr", spots()), written(tmp_path / "b.exr", spots(seed=1, size=(260, 200)))
    told = ("--register", "corners", "--photo-corners", *corners[0], "--rendering-corners", *corners[1])
    found = compared(cyclopean, *files, "--regions", PLATE, *told, expect=None)
    lies = found["eyes"]["both"]["registration"]
    # The middle of the first pixel, half a pixel from the corner, goes to 1.05 halves from it.
    want = [[1.05, 0.0, 0.025], [0.0, 1.05, 0.025], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(lies["photo_to_rendering"], want, atol=1e-9)
    assert lies["residual_px"] is None
    assert any("could not be measured" in line for line in found["eyes"]["both"]["said"])


def test_a_full_disk_is_told(tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    file = written(tmp_path / "a.exr", spots())
    monkeypatch.setattr(RowFile, "write", full)
    told = cyclopean("compare", file, file, "--regions", PLATE, "-o", tmp_path / "o.html", expect=1)
    assert "the temporary files cannot be written: the disk of the folder" in told.stderr
    assert "TMPDIR" in told.stderr
    assert not (tmp_path / "o.html").exists()


@pytest.mark.nightly
def test_the_page(tmp_path: Path, cyclopean: Cyclopean) -> None:
    one = written(tmp_path / "<b>a.exr", chart(), chart(seed=7))
    two = written(tmp_path / "b.exr", chart(1.03 * patch_XYZ(), seed=6), chart(1.03 * patch_XYZ(), seed=8))
    (tmp_path / "r.yaml").write_text(CHART, encoding="utf-8")
    asked = ("--regions", tmp_path / "r.yaml", "--rig", RIG, "--measures", "pu-ssim", "-o", tmp_path / "o.html")
    cyclopean("compare", one, two, *asked, expect=None)
    page = (tmp_path / "o.html").read_text(encoding="utf-8")
    assert "<b>a.exr" not in page
    seen = Ids()
    seen.feed(page)
    assert len(seen.ids) == len(set(seen.ids)) > 10
    assert seen.asked == []
    used = set(re.findall(r"url\(#([^)]+)\)", page)) | set(re.findall(r'href="#([^"]+)"', page))
    assert used <= set(seen.ids)
    first = page.index('class="decision"')
    places = [page.index(f'<section id="{name}">') for name in ("pictures-left", "colour-differences-left", "made")]
    assert sorted([first, *places]) == [first, *places]
    for words in (
        "Δxy",
        "S_L",
        "mean ratio",
        "left eye",
        "right eye",
        "Disparity",
        "the rendering 2.99 % brighter",
        "Luminance along the greys of 'chart'".replace("'", "&#39;"),
        "Within their limits, left eye / right eye:",
    ):
        assert words in page
    assert page.count("data:image/png;base64,") >= 4 + 4
    assert "in the colour of the display&#39;s white" in page.replace("'", "&#39;")


# ΔE00 per pixel: the map against one call, what it comes to, and its figures.

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


# The factor between luminances: planted, and against NumPy's own regression.

lights = st.lists(st.tuples(st.floats(1, 1e3), st.floats(0.5, 2.0)), min_size=3, max_size=20)


def test_a_factor_comes_back() -> None:
    rendering = np.array([3.0, 10.0, 40.0, 90.0])
    found = luminance_factor(1000 * rendering, rendering)
    assert found.mean_ratio == pytest.approx(1000, rel=1e-14)
    assert found.least_squares == pytest.approx(1000, rel=1e-14)
    assert found.mean_ratio_se == pytest.approx(0, abs=1e-9)
    assert found.pearson == pytest.approx(1)
    assert found.rms_mean_ratio == pytest.approx(0, abs=1e-9)
    assert found.r2_mean_ratio == pytest.approx(1)
    assert known(found.r2_as_rendered) < 0


@given(lights)
@settings(max_examples=25, deadline=None)
def test_what_scaling_changes_and_what_not(pairs: list[tuple[float, float]]) -> None:
    rendering = np.array([light for light, _ in pairs])
    photo = rendering * np.array([share for _, share in pairs])
    found, scaled = luminance_factor(photo, rendering), luminance_factor(photo, 7.0 * rendering)
    if found.pearson is not None and scaled.pearson is not None and np.ptp(rendering) > 1e-3:
        assert scaled.pearson == pytest.approx(found.pearson, abs=1e-6)
        assert found.pearson == pytest.approx(np.corrcoef(photo, rendering)[0, 1], abs=1e-6)
    assert 7 * scaled.least_squares == pytest.approx(found.least_squares)
    assert 7 * scaled.mean_ratio == pytest.approx(found.mean_ratio)
    slope, left, *_ = np.linalg.lstsq(rendering[:, None], photo, rcond=None)
    assert found.least_squares == pytest.approx(slope[0])
    assert found.rms_least_squares == pytest.approx(np.sqrt(left[0] / len(photo)) if len(left) else 0, abs=1e-6)
    assert found.rms_least_squares <= min(found.rms_mean_ratio, found.rms_as_rendered) * (1 + 1e-9) + 1e-12


def test_standard_errors_are_those_of_repetition() -> None:
    rng = np.random.default_rng(3)
    rendering = np.linspace(20, 90, 24)
    runs = [luminance_factor(0.97 * rendering + rng.normal(0, 2, 24), rendering) for _ in range(400)]
    told = np.sqrt(np.mean([(run.least_squares_se or 0) ** 2 for run in runs]))
    # 400 runs: a standard deviation to 3.5 %.
    assert told == pytest.approx(np.std([run.least_squares for run in runs]), rel=0.12)


def test_one_region_has_a_factor_and_no_more() -> None:
    found = luminance_factor([10.0], [20.0])
    assert (found.mean_ratio, found.least_squares) == (0.5, 0.5)
    assert (found.mean_ratio_se, found.pearson, found.r2_mean_ratio) == (None, None, None)


@pytest.mark.parametrize("bad", [[], [0.0], [np.nan], [1.0, 2.0]])
def test_what_has_no_factor_is_refused(bad: list[float]) -> None:
    with pytest.raises(StimulusError):
        luminance_factor(bad, [1.0] if bad else [])


# Whose luminance is white: what is given, a chart's white patch, the display's white, the brightest region.

WHITE_CHART = "{kind: colorchecker, corners: [[40, 30], [330, 44], [318, 240], [28, 220]]}"
LAMP = "{kind: rectangle, name: lamp, box: [1, 1, 20, 20]}"
WHITE_PLATE = "{kind: rectangle, name: table, box: [335, 100, 20, 60]}"
Write = Callable[..., RegionsFile]


@pytest.fixture
def white(regions_of: Write, chart_picture: Any) -> Callable[..., tuple[float, str]]:
    """Compare a chart beside a lamp of 500 cd/m² with itself; return the white's luminance and what is said of it."""
    picture = chart_picture()
    picture[:25, :25] = 500.0

    def compare(*entries: str, display: float | None = None, full: Any = None, **keys: object) -> tuple[float, str]:
        regions = regions_of(*entries, **keys)
        placed = place_regions(regions, picture.shape)
        found = compare_regions(picture, picture, placed, regions, display_white_cd_m2=display, photo_saturated=full)
        return found.table.white_XYZ[1], found.notes[0]

    return compare


def test_a_charts_white_comes_before_the_displays_and_what_is_brighter(white: Any) -> None:
    luminance, said = white(WHITE_CHART, LAMP, display=600.0)
    assert 85 < luminance < 95
    assert said.endswith("'chart 19 white 9.5'")


def test_a_displays_white_comes_before_the_brightest_region(white: Any) -> None:
    assert white(WHITE_PLATE, display=26.5) == (26.5, "white is icc-d50 at 26.5 cd/m², the display's")
    assert white(WHITE_PLATE)[0] == 20.0
    # What outshines the display cannot be shown on it.
    assert white(WHITE_PLATE, LAMP, display=26.5)[0] == 500.0


def test_what_is_given_comes_first(white: Any) -> None:
    assert white(WHITE_CHART, LAMP, display=600.0, white_luminance_cd_m2=70)[0] == 70.0
    assert white(WHITE_CHART, LAMP, display=600.0, white_region="lamp")[0] == 500.0


def test_a_saturated_patch_is_no_white(white: Any) -> None:
    full = np.zeros((270, 360), dtype=np.bool_)
    full[:, :80] = True  # the first column of patches, and the lamp
    luminance, said = white(WHITE_CHART, full=full)
    assert luminance < 85
    assert "brightest region, 'chart 16 yellow'" in said
