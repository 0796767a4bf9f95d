"""Sizes of a new study: they fit the mode, no picture is enlarged, and what the recipe makes has the planned pixels."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from devices.display import PanelSpec
from runner.presenter import MODES, find_mode
from runner.studies.plan import GAP_MM, plan_sizes
from runner.views import LayoutSpec, Style
from runner.views.layout import LayoutError, pair_layout, single_layout
from stimuli.pictures.resampling import display_pixels

PANEL = PanelSpec(resolution_px=(1920, 1080), pixel_pitch_mm=0.2768)
SIZES = {
    "one": [(640, 480)],
    "landscape": [(4000, 3000)] * 3,
    "portrait": [(3000, 4000)],
    "mixed": [(16, 16), (6000, 400), (300, 5000), (1200, 800)],
    "tall": [(90, 16000)],
    "wide": [(16000, 3)],
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("sizes", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("pairs", [True, False], ids=["pairs", "single"])
def test_the_sizes_fit_the_mode(mode: str, sizes: list[tuple[int, int]], pairs: bool) -> None:
    plan = plan_sizes(sizes, find_mode(mode), PANEL, pairs=pairs)
    layout = LayoutSpec(arrangement=plan.arrangement, size_mm=plan.window_mm, gap_mm=GAP_MM)
    placed = (pair_layout if pairs else single_layout)(layout, PANEL, Style(plan.view_px))
    assert placed.aperture_px == plan.window_px
    for number, picture in enumerate(plan.pictures):
        (width, height), (across, down) = picture.size_px, picture.shown_px
        assert 1 <= across <= min(width, plan.window_px[0])
        assert 1 <= down <= min(height, plan.window_px[1])
        if picture.is_pixel_for_pixel:
            continue
        # As `stimuli.recipes.picture_steps` resamples: the width is given, the height follows.
        width_mm = plan.width_mm(number)
        made = tuple(display_pixels(mm, PANEL.pixel_pitch_mm) for mm in (width_mm, width_mm * height / width))
        assert made == (across, down)


@pytest.mark.parametrize("mode", MODES)
def test_a_picture_that_is_made_smaller_fills_the_room(mode: str) -> None:
    plan = plan_sizes([(4000, 3000)], find_mode(mode), PANEL, pairs=True)
    for more_px in (12, 0), (0, 12):
        size_mm = tuple((px + more) * PANEL.pixel_pitch_mm for px, more in zip(plan.window_px, more_px, strict=True))
        larger = LayoutSpec(arrangement=plan.arrangement, size_mm=(size_mm[0], size_mm[1]), gap_mm=GAP_MM)
        try:
            pair_layout(larger, PANEL, Style(plan.view_px))
        except LayoutError:
            return
    pytest.fail("a larger window would have fitted too")


@pytest.mark.parametrize("pairs", [True, False])
def test_pictures_are_brought_to_one_size_where_they_differ(pairs: bool) -> None:
    def shown(sizes: Sequence[tuple[int, int]], fit: bool | None, *groups: Sequence[int]) -> list[tuple[int, int]]:
        plan = plan_sizes(sizes, find_mode("flat"), PANEL, pairs=pairs, fit=fit, compared=groups)
        return [each.shown_px for each in plan.pictures]

    assert shown([(100, 80), (400, 320)], None) == [(100, 80), (100, 80)]
    assert shown([(100, 80), (400, 320)], False) == [(100, 80), (400, 320)]
    assert shown([(100, 80), (102, 82)], None) == [(100, 80), (102, 82)]
    assert shown([(100, 100), (400, 100)], True) == [(100, 100), (200, 50)]
    assert shown([(100, 80), (400, 320), (50, 40), (100, 80)], None, [0, 1], [2, 3]) == [
        (100, 80),
        (100, 80),
        (50, 40),
        (50, 40),
    ]


def test_the_arrangement_lets_pictures_be_larger() -> None:
    half = find_mode("side-by-side")
    assert plan_sizes([(4000, 3000)], half, PANEL, pairs=True).arrangement == "vertical"
    assert plan_sizes([(3000, 4000)], half, PANEL, pairs=True).arrangement == "horizontal"


def test_the_sentence_says_what_is_made_smaller() -> None:
    def sentence(*sizes: tuple[int, int]) -> str:
        return plan_sizes(sizes, find_mode("flat"), PANEL, pairs=True).sentence

    assert sentence((640, 480), (16, 16)) == "Every picture is shown pixel for pixel."
    assert sentence((1884, 1412)) == "Every picture is made smaller to fit, 2 times, in linear light."
    both = sentence((1884, 1412), (16, 16))
    assert both == (
        "1 of 2 pictures is made smaller to fit, 2 times, in linear light; the others are shown pixel for pixel."
    )


def test_a_screen_without_room_is_refused() -> None:
    tiny = PanelSpec(resolution_px=(64, 4), pixel_pitch_mm=0.3)
    with pytest.raises(LayoutError, match="no room for pictures"):
        plan_sizes([(10, 10)], find_mode("side-by-side"), tiny, pairs=True)


def test_a_picture_that_would_vanish_is_refused() -> None:
    with pytest.raises(LayoutError, match="less than a pixel wide"):
        plan_sizes([(3, 16000)], find_mode("flat"), PANEL, pairs=True)
