"""A ColorChecker that lies another way round than its corners say is found, and said."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.chart import WAYS
from stimuli.comparison import place_regions
from stimuli.comparison.by_region import check_charts
from stimuli.comparison.regions import Chart
from stimuli.comparison.regions_file import RegionsFile
from stimuli.errors import StimulusError
from stimuli.pictures import rows

Draw = Callable[..., NDArray[np.float64]]
Write = Callable[..., RegionsFile]
CORNERS = np.array([[40.0, 30.0], [330.0, 44.0], [318.0, 240.0], [28.0, 220.0]])


def chart(corners: NDArray[np.float64], inner: float = 0.5) -> Chart:
    return Chart("chart", corners, corners, inner)


@pytest.mark.parametrize("way", list(WAYS))
def test_each_way_round_is_told_with_the_right_corners(chart_picture: Draw, way: str) -> None:
    picture = chart_picture(CORNERS, noise=0.05)
    # Corners from which that way leads back to the chart's own.
    given = np.empty_like(CORNERS)
    given[list(WAYS[way])] = CORNERS
    if not way:
        assert check_charts(picture, [chart(given)], "photograph") == ()
        return
    with pytest.raises(StimulusError) as caught:
        check_charts(picture, [chart(given)], "photograph", file="r.yaml")
    (finding,) = caught.value.findings
    assert finding.message == f"the chart 'chart' lies {way} in the photograph"
    assert finding.remedy is not None
    assert finding.remedy.endswith("[[40, 30], [330, 44], [318, 240], [28, 220]]")


def test_another_white_and_a_camera_of_its_own_do_not_matter(chart_picture: Draw) -> None:
    matrix = np.array([[0.5, 0.3, 0.1], [0.2, 0.9, -0.2], [0.0, 0.1, 0.6]])
    assert check_charts(chart_picture() @ matrix.T, [chart(CORNERS)], "rendering") == ()


def test_what_is_no_chart_is_told(chart_picture: Draw) -> None:
    with pytest.raises(StimulusError, match="in no way round in the rendering"):
        check_charts(chart_picture(), [chart(CORNERS[::1] * 0.6)], "rendering")


def test_a_saturated_chart_is_left_open(chart_picture: Draw) -> None:
    picture = chart_picture()
    (said,) = check_charts(picture, [chart(CORNERS)], "photograph", np.ones(picture.shape, dtype=np.bool_))
    assert "is not known" in said


def test_another_chart_is_not_asked_for_its_colours(regions_of: Write) -> None:
    entry = "{kind: colorchecker, colours: other, corners: [[0, 0], [138, 0], [138, 90], [0, 90]]}"
    assert place_regions(regions_of(entry), (100, 200, 3)).charts == ()


def test_bands_do_not_matter(chart_picture: Draw, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "BAND_PIXELS", 700)
    assert check_charts(chart_picture(), [chart(CORNERS)], "photograph") == ()
