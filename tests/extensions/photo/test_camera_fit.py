"""Charts in photographs, one or several: found or given, read, fitted to; and their faults named."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from devices.camera import Correspondences, Exposure, ReferenceColours, fit_camera
from devices.chart import COLORCHECKER, WAYS, patch_quadrangles
from devices.errors import DeviceError
from documents.arrays import Floats
from extensions.photo import ChartOptions, fit_camera_to_chart
from extensions.photo.camera_fit import read_chart
from extensions.photo.find import find_corners, sample_patches
from extensions.photo.pooled import ChartShot, pool_shots
from stimuli.develop import CameraImage, write_camera_exr
from stimuli.errors import StimulusError
from tests.kept import known

# A chart in a photograph: found or given, turned whichever way, its patches read and its faults named.

Draw = Callable[..., np.ndarray]
CORNERS = np.array([[120.0, 90.0], [620.0, 130.0], [590.0, 455.0], [95.0, 410.0]])
M = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]])


def _none(picture: np.ndarray) -> np.ndarray:
    return np.zeros(picture.shape, dtype=bool)


def test_patches_between_given_corners(photograph: Draw, true_rgb: np.ndarray, reference: ReferenceColours) -> None:
    picture = photograph()
    read = read_chart(picture, _none(picture), reference, CORNERS)
    assert read.colours.rgb == pytest.approx(true_rgb, abs=1e-6)  # the picture is float32
    assert read.values.spread.max() < 1e-6
    assert read.values.pixels.min() > 300
    assert read.way_round == "upright"
    assert read.notes == ()
    assert fit_camera(read.colours).model.matrix == pytest.approx(M, abs=1e-3)


ONE_OF_EACH = ("", "turned a quarter to the right", "mirrored")


@pytest.mark.parametrize(
    "way", [way if way in ONE_OF_EACH else pytest.param(way, marks=pytest.mark.nightly) for way in WAYS]
)
def test_whichever_way_it_lies(photograph: Draw, true_rgb: np.ndarray, reference: ReferenceColours, way: str) -> None:
    """The chart stands on its side, head or behind a mirror; the corners are given as they look upright."""
    order = list(WAYS[way])
    picture = photograph(CORNERS)
    given = np.empty_like(CORNERS)
    given[order] = CORNERS  # turned as `way` says, these are the chart's own
    read = read_chart(picture, _none(picture), reference, given)
    assert read.way_round == (way or "upright")
    assert read.colours.rgb == pytest.approx(true_rgb, abs=1e-6)
    assert (read.notes == ()) == (way == "")
    assert way in " ".join(read.notes)
    assert np.array_equal(read.values.corners_px, CORNERS)


@pytest.mark.parametrize(
    ("corners", "gap"),
    [
        (CORNERS, 0.1),
        pytest.param(
            np.array([[500.0, 60.0], [500.0, 500.0], [200.0, 500.0], [200.0, 60.0]]), 0.2, marks=pytest.mark.nightly
        ),
    ],
    ids=["upright", "on its side"],
)
def test_found_by_itself(
    photograph: Draw, true_rgb: np.ndarray, reference: ReferenceColours, corners: np.ndarray, gap: float
) -> None:
    picture = photograph(corners, gap=gap, noise=0.003)
    read = read_chart(picture, _none(picture), reference)
    # A patch is about 70 pixels wide; two pixels are far within its margin.
    assert np.abs(read.values.corners_px - corners).max() < 2.0
    error = np.abs(read.colours.rgb - true_rgb)
    assert error.max() < 5 * 0.003 / np.sqrt(read.values.pixels.min())
    assert read.corners == "found"
    assert read.values.spread == pytest.approx(0.003, rel=0.15)  # of some 1000 pixels


@pytest.mark.nightly
@pytest.mark.parametrize("times", [0.02, 1.5])
def test_a_dark_raw_picture_is_brightened_for_the_finder_alone(
    photograph: Draw, true_rgb: np.ndarray, reference: ReferenceColours, times: float
) -> None:
    picture = (times * photograph(noise=0.003)).astype(np.float32)
    read = read_chart(picture, picture >= 1, reference)
    assert np.abs(read.values.corners_px - CORNERS).max() < 2.0
    assert read.colours.rgb == pytest.approx(times * true_rgb, abs=times * 0.0005)


def test_every_patch_against_a_loop(photograph: Draw) -> None:
    picture = photograph(noise=0.01)
    values = sample_patches(picture, picture > 0.5, CORNERS)
    quadrangle = patch_quadrangles(CORNERS)[8]
    inside = []
    low, high = quadrangle.min(axis=0).astype(int) - 2, quadrangle.max(axis=0).astype(int) + 3
    for row in range(low[1], high[1]):
        for column in range(low[0], high[0]):
            x, y = column + 0.5, row + 0.5
            turns = []
            for a, b in zip(quadrangle, np.roll(quadrangle, -1, axis=0), strict=True):
                turns.append((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]))
            if min(turns) >= 0:
                inside.append(picture[row, column].astype(float))
    kept = np.sort(np.array(inside), axis=0)
    cut = len(kept) // 10
    assert values.pixels[8] == len(inside)
    assert values.rgb[8] == pytest.approx(kept[cut : len(kept) - cut].mean(axis=0), abs=1e-12)


def _one(caught: pytest.ExceptionInfo[StimulusError | DeviceError]) -> str:
    (finding,) = caught.value.findings
    assert finding.file == "photo.nef"
    assert finding.remedy
    return finding.message


def test_no_chart(photograph: Draw, reference: ReferenceColours) -> None:
    rng = np.random.default_rng(2)
    for picture in (
        np.full((150, 200, 3), 0.5, np.float32),
        rng.uniform(0, 1, (150, 200, 3)).astype(np.float32),
        np.full((5, 5, 3), 0.5, np.float32),
    ):
        with pytest.raises(StimulusError) as caught:
            read_chart(picture, _none(picture), reference, file="photo.nef")
        assert "no chart of 24 patches was found" in _one(caught)
    picture = rng.uniform(0, 1, (540, 720, 3)).astype(np.float32)
    with pytest.raises(StimulusError) as caught:
        read_chart(picture, _none(picture), reference, CORNERS, file="photo.nef")
    assert "in any way round" in _one(caught)


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        (CORNERS + [200, 0], "outside the picture"),
        (CORNERS[[0, 2, 1, 3]], "no convex quadrangle"),
        (np.full((4, 2), 50.0), "no convex quadrangle"),
        (CORNERS[0] + [[0, 0], [12, 0], [12, 8], [0, 8]], "holds . pixels"),
    ],
)
def test_corners_that_are_none(photograph: Draw, reference: ReferenceColours, corners: np.ndarray, words: str) -> None:
    picture = photograph()
    if "pixels" in words:  # so small a chart that it is all there, in a few pixels each
        picture = photograph(corners)
    with pytest.raises(StimulusError, match=words) as caught:
        read_chart(picture, _none(picture), reference, corners, file="photo.nef")
    _one(caught)


@pytest.mark.nightly
def test_a_large_photograph_is_found_on_a_small_preview(photograph: Draw, reference: ReferenceColours) -> None:
    picture = photograph().repeat(4, axis=0).repeat(4, axis=1)
    assert find_corners(picture) == pytest.approx(CORNERS * 4, abs=6.0)


def test_dust_does_not_move_the_mean(photograph: Draw, true_rgb: np.ndarray) -> None:
    picture = photograph()
    quadrangle = patch_quadrangles(CORNERS)[2]
    x, y = quadrangle.min(axis=0).astype(int) + 8
    picture[y : y + 6, x : x + 6] = 0.9  # a glint, 36 of some 1200 pixels
    values = sample_patches(picture, _none(picture), CORNERS)
    assert values.rgb[2] == pytest.approx(true_rgb[2], abs=1e-6)


def test_a_saturated_chart(photograph: Draw, reference: ReferenceColours) -> None:
    picture = np.minimum(photograph() * 100, 1).astype(np.float32)
    with pytest.raises(StimulusError) as caught:
        read_chart(picture, picture >= 1, reference, CORNERS, file="photo.nef")
    assert "chart's 24 patches are saturated" in _one(caught)


def test_a_reference_of_another_chart(photograph: Draw, reference: ReferenceColours) -> None:
    picture = photograph()
    other = ReferenceColours(reference.XYZ[:12], reference.names[:12], "reference.csv")
    with pytest.raises(DeviceError, match="12 colours and the chart 24 patches"):
        read_chart(picture, _none(picture), other, CORNERS)


def test_numbers_that_are_none(photograph: Draw, reference: ReferenceColours) -> None:
    picture = photograph()
    x, y = patch_quadrangles(CORNERS)[8].mean(axis=0).astype(int)
    picture[y, x - 3 : x + 3] = np.nan
    with pytest.raises(StimulusError, match="holds values that are no numbers"):
        read_chart(picture, _none(picture), reference, CORNERS)


def test_corners_that_do_not_sit_well_are_said(photograph: Draw, reference: ReferenceColours) -> None:
    picture = photograph()
    read = read_chart(picture, _none(picture), reference, CORNERS + [22.0, 0.0])
    assert "pixels differ" in " ".join(read.notes)


def test_json_is_plain(photograph: Draw, reference: ReferenceColours) -> None:
    picture = photograph()
    told = json.loads(json.dumps(read_chart(picture, _none(picture), reference, CORNERS[[2, 3, 0, 1]]).to_json()))
    assert told["way_round"] == "upside down"
    assert told["corners_px"] == CORNERS.tolist()
    assert len(told["spread_rgb"]) == len(COLORCHECKER)


# Several photographs of charts fitted to together: repeated shots by their mean, exposures and charts side by side.

MATRIX = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]])
AT = Exposure(1 / 15, 8.0, 800.0)
POOLED_CORNERS = ((0, 0), (120, 0), (120, 80), (0, 80))


def shot(
    reference: ReferenceColours,
    rgb: Floats,
    number: int = 0,
    noise: float = 0.0,
    at: Exposure | None = AT,
    gain: float = 1.0,
    chart: str = "chart.csv",
) -> ChartShot:
    rng = np.random.default_rng(number)
    seen = np.clip(rgb * gain + noise * rng.normal(size=rgb.shape), 0, 1)
    colours = Correspondences(seen, reference.XYZ, reference.names, seen >= 1, f"{number}.nef")
    return ChartShot(f"{number}.nef", chart, colours, at)


@pytest.fixture
def rgb(reference: ReferenceColours) -> Floats:
    return np.asarray(reference.XYZ @ np.linalg.inv(MATRIX).T)


def test_repeated_shots_are_averaged_and_show_the_noise(reference: ReferenceColours, rgb: Floats) -> None:
    pooled = pool_shots([shot(reference, rgb, number, 0.0005) for number in range(16)])
    assert len(pooled.colours) == 24
    assert (pooled.colours.rgb - rgb).std() == pytest.approx(0.0005 / 4, rel=0.25)  # of 72 values
    assert np.sqrt((known(pooled.colours.noise_rgb) ** 2).mean()) == pytest.approx(0.0005 / 4, rel=0.1)
    single = fit_camera(shot(reference, rgb, 0, 0.0005).colours)
    many = fit_camera(pooled.colours)
    assert np.abs(many.model.matrix - MATRIX).max() < 0.5 * np.abs(single.model.matrix - MATRIX).max()
    (chart,) = pooled.residuals(many)
    assert chart.patches == 24
    assert len(chart.files) == 16
    assert chart.luminance_ratio == pytest.approx(1, abs=0.01)
    assert "0.nef and 15 more" in str(chart)


def test_exposures_and_charts_stand_side_by_side(reference: ReferenceColours, rgb: Floats) -> None:
    half = Exposure(1 / 30, 8.0, 800.0)
    shots = [
        shot(reference, rgb, 0),
        shot(reference, rgb, 1, at=half, gain=0.5),
        shot(reference, rgb, 2, at=half, gain=0.5, chart="other.csv"),
    ]
    pooled = pool_shots(shots)
    assert len(pooled.colours) == 72
    assert len(pooled.groups) == 3
    fit = fit_camera(pooled.colours)
    assert fit.model.exposure == half
    np.testing.assert_allclose(fit.model.matrix, 2 * MATRIX, rtol=1e-9, atol=1e-9)
    assert [chart.delta_e_max for chart in pooled.residuals(fit)] == pytest.approx([0, 0, 0], abs=1e-6)


def test_a_chart_in_other_light_shows_in_its_residual(reference: ReferenceColours, rgb: Floats) -> None:
    pooled = pool_shots([shot(reference, rgb, 0), shot(reference, rgb * 1.05, 1, chart="other.csv")])
    first, second = pooled.residuals(fit_camera(pooled.colours))
    assert known(second.luminance_ratio) / known(first.luminance_ratio) == pytest.approx(1.05, rel=1e-3)
    twice = pool_shots([shot(reference, rgb, 0), shot(reference, rgb * 1.08, 1)])
    assert any("1.nef has 1.080 × the light" in note for note in twice.notes)
    assert pool_shots([shot(reference, rgb, 0), shot(reference, rgb * 1.01, 1)]).notes == ()


def test_an_exposure_must_be_known_of_all_or_none(reference: ReferenceColours, rgb: Floats) -> None:
    with pytest.raises(StimulusError, match="has no exposure"):
        pool_shots([shot(reference, rgb, 0), shot(reference, rgb, 1, at=None)])
    assert len(pool_shots([shot(reference, rgb, 0, at=None), shot(reference, rgb, 1, at=None)]).colours) == 24


def photograph(path: Path, rgb: Floats, seed: int, at: Exposure | None = AT) -> Path:
    rng = np.random.default_rng(seed)
    picture = np.kron(rgb.reshape(4, 6, 3), np.ones((20, 20, 1))) + 0.002 * rng.normal(size=(80, 120, 3))
    write_camera_exr(path, CameraImage(picture.astype(np.float32), picture >= 1, at, path.name))
    return path


def test_photographs_are_read_and_pooled(tmp_path: Path, reference: ReferenceColours, rgb: Floats) -> None:
    table = tmp_path / "chart.csv"
    np.savetxt(table, reference.XYZ, delimiter=",", header="X,Y,Z", comments="")
    photos = [photograph(tmp_path / f"{number}.exr", rgb, number) for number in range(3)]
    fitted = fit_camera_to_chart(photos, ChartOptions(reference=(table,), corners_px=POOLED_CORNERS))
    np.testing.assert_allclose(fitted.fit.model.matrix, MATRIX, atol=0.5)
    assert [len(chart.files) for chart in fitted.charts] == [3]
    assert fitted.to_json()["charts"][0]["files"] == ["0.exr", "1.exr", "2.exr"]
    assert "and 2 more" in fitted.fit.model.source
    by_each = fit_camera_to_chart(photos, ChartOptions(reference=(table,) * 3, corners_px=POOLED_CORNERS))
    np.testing.assert_array_equal(by_each.fit.model.matrix, fitted.fit.model.matrix)
    flat = tmp_path / "flat.exr"
    write_camera_exr(
        flat, CameraImage(np.full((80, 120, 3), 0.5, np.float32), np.zeros((80, 120, 3), bool), AT, "flat")
    )
    even = fit_camera_to_chart(photos, ChartOptions(reference=(table,), corners_px=POOLED_CORNERS, flat=(flat,)))
    np.testing.assert_allclose(even.fit.model.matrix, fitted.fit.model.matrix, rtol=1e-5)

    for charts, references, words in (
        ([photos[0], table], (table,), "a table is given beside other charts"),
        ([photos[0], photos[0]], (table,), "named twice"),
        (photos, (table,) * 2, "2 references are given for 3 photographs"),
        ([], (table,), "no chart"),
    ):
        with pytest.raises(StimulusError, match=words):
            fit_camera_to_chart(charts, ChartOptions(reference=references, corners_px=POOLED_CORNERS))


@pytest.mark.nightly
def test_noisy_rows_count_less(reference: ReferenceColours, rgb: Floats) -> None:
    """Half of the patches with twenty times the noise: weighed by it, the matrix errs by less; alike, as without."""
    rng = np.random.default_rng(5)
    noise = np.where(np.arange(24)[:, None] % 2 == 0, 0.004, 0.0002) * np.ones(3)
    plain: list[float] = []
    weighed: list[float] = []
    for _ in range(12):
        seen = np.clip(rgb + noise * rng.normal(size=rgb.shape), 1e-4, 0.99)
        for errors, each in ((plain, None), (weighed, noise)):
            colours = Correspondences(seen, reference.XYZ, reference.names, seen > 1, noise_rgb=each)
            errors.append(float(np.sqrt(((fit_camera(colours).model.matrix - MATRIX) ** 2).mean())))
    assert np.mean(weighed) < 0.7 * np.mean(plain)
    seen = np.clip(rgb + 0.001 * rng.normal(size=rgb.shape), 1e-4, 0.99)
    even = Correspondences(seen, reference.XYZ, reference.names, seen > 1, noise_rgb=np.full((24, 3), 1e-9))
    without = Correspondences(seen, reference.XYZ, reference.names, seen > 1)
    np.testing.assert_allclose(fit_camera(even).model.matrix, fit_camera(without).model.matrix, rtol=1e-6)
    with pytest.raises(DeviceError, match="noise"):
        Correspondences(seen, reference.XYZ, reference.names, seen > 1, noise_rgb=np.zeros((3, 3)))
