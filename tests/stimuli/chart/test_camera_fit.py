"""A chart in a photograph: found or given, turned whichever way, its patches read and its faults named."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest

from devices.camera import ReferenceColours, fit_camera
from devices.chart import COLORCHECKER, WAYS, patch_quadrangles
from devices.errors import DeviceError
from stimuli.chart.camera_fit import read_chart
from stimuli.chart.find import find_corners
from stimuli.chart.sample import sample_patches
from stimuli.errors import StimulusError

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


@pytest.mark.nightly
def test_a_saturated_patch_is_named_and_left_out(photograph: Draw, reference: ReferenceColours) -> None:
    picture = photograph(noise=0.001)
    exposed = np.minimum(picture * 2.0, 1.0).astype(np.float32)
    read = read_chart(exposed, exposed >= 1, reference)
    found = fit_camera(read.colours)
    assert [patch.name for patch in found.left_out] == ["white 9.5"]
    assert found.left_out[0].left_out_reason.startswith("saturated: ")
    assert found.model.matrix == pytest.approx(M / 2, abs=0.5)


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
