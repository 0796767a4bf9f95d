"""Leafing through series: where one begins, what can be chosen when, and what is kept of the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from runner.blocks import Block, Draft, Stimuli
from runner.blocks.best_of_series import DIFFICULTY, SIMILARITY, BestOfSeries, BrowsedSeries
from runner.blocks.series import find_series, series_scene, series_targets
from runner.observers import plain_key, walk
from runner.ports import Ask, Browse, Button, Rate
from runner.protocol import read_experiment
from runner.scene import Box, Text
from runner.views import SingleLayout, Style
from tests.runner.every_kind import met, setting

Study = Any  # tests/conftest.py
Play = Callable[..., Any]  # conftest.py
LAYOUT = SingleLayout((0, -60), (400, 300), (0, -250), 800, 90)
PICTURES = ("p0", "p1", "p2", "p3")
PLACE = setting(PICTURES, reference="physical")
FIFTEEN = Stimuli(
    {
        f"{paint}-{kind}-{n}": {"paint": paint, "kind": kind, "n": n}
        for paint in ("GM1", "GM2", "HI", "BC", "BR")
        for kind in ("base", "brighter", "grey")
        for n in range(6)
    }
)
BY_FACTORS = {"by": ["paint", "kind"], "order": "n"}


def one(**keys: Any) -> Block:
    """Return a block of one series."""
    return met("best_of_series", PLACE, **{"series": {"one": PICTURES}, "start": "first", **keys})


def fifteen(observer: str = "01", **keys: Any) -> Block:
    """Return a block of fifteen series of five paints."""
    place = setting(FIFTEEN, observer, reference="physical")
    return met("best_of_series", place, series=BY_FACTORS, **keys)


ONE = one()


def pressing(*keys: str) -> Callable[[Ask], str]:
    """Press these keys while leafing, and rate 8, then 3."""
    left = list(keys)

    def press(ask: Ask) -> str:
        if isinstance(ask.task, Rate):
            return "enter" if ask.task.current is not None else {"similarity": "8"}.get(ask.task.name, "3")
        return left.pop(0)

    return press


def test_the_way_through_a_series_is_kept(play: Play) -> None:
    played = play(ONE, pressing("right", "wheel_down", "pad_right", "left", "wheel_up", "space"))
    (trial,) = played.trials
    assert trial.details() == {
        "series": "one",
        "stimuli": list(PICTURES),
        "start": 0,
        "chosen": "p1",
        "chosen_index": 1,
        "path": [[0, 0.5], [1, 0.5], [2, 0.5], [3, 0.5], [2, 0.5], [1, 0.5]],
        "dwell_s": [0.5, 1.0, 1.0, 0.5],
        "ratings": {"similarity": 8, "difficulty": 3},
        "rating_times_s": {"similarity": 1.0, "difficulty": 1.0},
    }
    assert trial.response_time_s == 3.0
    assert [ask.scene.stimuli[0] for ask in played.asks] == ["p0", "p1", "p2", "p3", "p2", "p1", *["p1"] * 4]
    assert [ask.task.stimulus for ask in played.asks if isinstance(ask.task, Rate)] == ["p1"] * 4


def test_nothing_can_be_chosen_before_everything_was_seen(play: Play) -> None:
    played = play(ONE, pressing("right", "right", "right", "enter"))
    browsing = [ask for ask in played.asks if isinstance(ask.task, Browse)]
    for ask in browsing[:-1]:
        assert ask.meaning("enter") is ask.meaning("space") is ask.meaning("click choose") is None
    assert browsing[-1].meaning("enter") == browsing[-1].meaning("click choose") == "choose"
    assert [ask.task.seen for ask in browsing] == [frozenset(range(n)) for n in (1, 2, 3, 4)]
    hints = [
        item.words for ask in browsing for item in ask.scene.items if isinstance(item, Text) and "eaf" in item.words
    ]
    assert ["all" in words for words in hints] == [True, True, True, False]
    hasty = play(one(see_all=False), pressing("pad_a"))
    assert hasty.trials[0].details()["chosen"] == "p0"
    assert hasty.trials[0].details()["dwell_s"] == [0.5, 0, 0, 0]


def test_the_ends_are_ends_unless_the_series_wraps(play: Play) -> None:
    first, *_, last = (
        a for a in play(ONE, pressing("right", "right", "right", "enter")).asks if isinstance(a.task, Browse)
    )
    assert first.meaning("left") is first.meaning("wheel_up") is first.meaning("click previous") is None
    assert last.meaning("right") is last.meaning("pad_right") is last.meaning("click next") is None
    heads = [{item.words for item in ask.scene.items if isinstance(item, Text)} & {"◀", "▶"} for ask in (first, last)]
    assert heads == [{"▶"}, {"◀"}]
    round_ = play(one(wrap=True), pressing("left", "left", "right", "right", "left", "left", "left", "enter"))
    assert [index for index, _ in round_.trials[0].details()["path"]] == [0, 3, 2, 3, 0, 3, 2, 1]


def test_the_next_picture_in_the_direction_of_travel_is_made_ready(play: Play) -> None:
    played = play(ONE, pressing("right", "right", "left", "right", "right", "left", "enter"))
    ready = [ask.upcoming.stimuli[0] for ask in played.asks if isinstance(ask.task, Browse) and ask.upcoming]
    assert ready == ["p1", "p2", "p3", "p0", "p3", "p2", "p1"]
    for here, following in pairwise(ask for ask in played.asks[:3]):
        assert here.upcoming == following.scene


def test_the_next_series_is_made_ready_while_this_one_is_rated(play: Play) -> None:
    played = play(fifteen())
    for rating, browsing in pairwise(played.asks):
        if isinstance(rating.task, Rate) and isinstance(browsing.task, Browse):
            assert rating.upcoming == browsing.scene


def test_one_paint_never_comes_twice_running_and_everyone_has_an_order_of_their_own(play: Play) -> None:
    orders, starts = set(), set()
    for number in range(8):
        played = play(fifteen(f"{number:02d}", ratings=[]))
        order = [trial.details()["series"] for trial in played.trials]
        assert len({*order}) == len(order) == 15
        assert all(one.split("-")[0] != other.split("-")[0] for one, other in pairwise(order))
        orders.add(tuple(order))
        starts |= {trial.details()["start"] for trial in played.trials}
    assert len(orders) == 8
    assert starts == set(range(6))


@given(st.integers(0, 5), st.lists(st.sampled_from(["left", "right"]), max_size=30))
def test_dwell_times_add_up_to_the_response_time(start: int, keys: list[str]) -> None:
    index, path = start, []
    for number, key in enumerate(keys):
        path.append((index, round(0.1 * number + 0.05, 6)))
        index = min(5, max(0, index + (1 if key == "right" else -1)))
    choice = BrowsedSeries(index, (*path, (index, 0.25)))
    assert sum(choice.dwell_s(6)) == pytest.approx(choice.time_s, abs=1e-5)
    assert {i for i, seconds in enumerate(choice.dwell_s(6)) if seconds} == {i for i, _ in choice.path}


@pytest.mark.parametrize("view_px", [(960, 1080), (1920, 1080), (1920, 2160), (3840, 2160), (640, 480)])
@pytest.mark.parametrize("count", [2, 6, 40, 90])
@pytest.mark.parametrize("x", [0, 0.22])
def test_the_row_of_boxes_is_seen_whole_and_says_where_one_is(view_px: tuple[int, int], count: int, x: float) -> None:
    style = Style(view_px)
    layout = replace(LAYOUT, picture_px=(round(x * view_px[0]), 0), below_px=style.px(150))
    names = tuple(f"p{n}" for n in range(count))
    scene = series_scene(names, 1, {0, 1}, "Which?", "hint", layout, style)
    boxes = [item for item in scene.items if isinstance(item, Box)]
    assert len(boxes) == count
    assert max(range(count), key=lambda n: boxes[n].luminance_share) == 1
    assert boxes[0].luminance_share > min((box.luminance_share for box in boxes[2:]), default=0)
    targets = series_targets(count, layout, style)
    placed: list[Box | Button] = [*boxes, targets["previous"], targets["next"]]
    for item in placed:
        assert all(abs(p) + s / 2 <= v / 2 for p, s, v in zip(item.offset_px, item.size_px, view_px, strict=True))
    assert (
        targets["previous"].offset_px[0]
        < boxes[0].offset_px[0]
        <= boxes[-1].offset_px[0]
        < targets["next"].offset_px[0]
    )


def test_the_keys_say_what_they_do_in_both_parts() -> None:
    assert ONE.keys["left"] == "previous, lower"
    assert ONE.keys["wheel_down"] == "next, lower"
    assert ONE.keys["enter"] == "choose, accept"
    assert ONE.keys["0"] == "10"
    assert one(ratings=[]).keys["left"] == "previous"


FACTORS = Stimuli(
    {
        f"{paint}-{kind}-{exposure:g}": {"paint": paint, "series": kind, "exposure_s": exposure}
        for exposure in (4.0, 1.3, 2.0)
        for paint in ("GM1", "HI")
        for kind in ("base", "grey")
    }
)


def spec(series: Any, **more: Any) -> BestOfSeries:
    return BestOfSeries.model_validate({"kind": "best_of_series", "series": series, **more})


def test_series_are_found_by_factors() -> None:
    by_factors = spec({"by": ["paint", "series"], "order": "exposure_s"})
    all_series = find_series(by_factors.series, FACTORS)
    assert [(series.name, series.group) for series in all_series] == [
        ("GM1-base", "GM1"),
        ("GM1-grey", "GM1"),
        ("HI-base", "HI"),
        ("HI-grey", "HI"),
    ]
    assert all_series[1].stimuli == ("GM1-grey-1.3", "GM1-grey-2", "GM1-grey-4")
    without = replace(FACTORS, reference="GM1-grey-2")
    assert find_series(by_factors.series, without)[1].stimuli == (
        "GM1-grey-1.3",
        "GM1-grey-4",
    )
    assert not list(by_factors.faults(FACTORS))


@pytest.mark.parametrize(
    ("series", "path", "words"),
    [
        ({"by": ["paint"], "order": "exposure_s"}, ("series", "by"), "have the same exposure_s"),
        ({"by": ["paint", "series", "exposure_s"], "order": "exposure_s"}, ("series", "by"), "has only the picture"),
        ({"by": ["pain", "series"], "order": "exposure_s"}, ("series", "by", 0), "no factor 'pain'"),
        ({"by": ["paint", "series"], "order": "time"}, ("series", "order"), "no factor 'time'"),
        ({"one": ["GM1-base-2", "GM1-bose-2"]}, ("series", "one", 1), "no stimulus 'GM1-bose-2'"),
        ({"one": ["GM1-base-2", "GM1-base-2"]}, ("series", "one", 1), "stands twice"),
    ],
)
def test_series_that_there_are_not(series: Any, path: tuple[Any, ...], words: str) -> None:
    faults = list(spec(series).faults(FACTORS))
    assert any(fault.path == path and words in fault.message for fault in faults), faults


def test_the_thesis_s_two_scales_are_the_default() -> None:
    block = spec({"one": ["a", "b"]})
    assert block.ratings == (SIMILARITY, DIFFICULTY)
    assert (SIMILARITY.lowest, SIMILARITY.highest, DIFFICULTY.lowest, DIFFICULTY.highest) == (1, 10, 1, 10)
    assert spec({"one": ["a", "b"]}, ratings=[]).ratings == ()


SERIES = """\
blocks:
  - kind: best_of_series
    series:
      first: [one, two]
      second: [three, four]
    ratings: [{name: ease, question: Easy, highest: 7}]
"""


def test_a_file_makes_it(study: Study) -> None:
    study.edit("small.yaml", "blocks:\n", SERIES)
    block = read_experiment(study.experiment).blocks("03")[0]
    assert (block.trials, block.scale_ends) == (2, {"ease": (1, 7)})
    drafts = [step for step in walk(block) if isinstance(step, Draft)]
    assert {draft.data["series"]: draft.stimuli for draft in drafts} == {
        "first": ("one", "two"),
        "second": ("three", "four"),
    }


def test_someone_without_eyes_sees_all_of_a_series_and_takes_the_last(play: Play) -> None:
    played = play(fifteen(), plain_key)
    for trial in played.trials:
        assert {index for index, _ in trial.details()["path"]} == set(range(6))
        assert trial.details()["ratings"] == {"similarity": 5, "difficulty": 5}
