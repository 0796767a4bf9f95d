"""A scale: every way to answer it ends at the number meant, and it looks alike at every size."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from runner.blocks.scale import RatedScene, Scale, rate, scale_faults, scale_items, scale_targets
from runner.observers import plain_key
from runner.ports import Ask, Rate, Response
from runner.scene import Box, Text
from runner.views import FULL_HD_HALF, SingleLayout, Style

TEN = Scale(name="similarity", question="How similar?", low_anchor="not at all", high_anchor="the same")
SLIDER = Scale(
    name="quality",
    question="How good?",
    lowest=0,
    highest=100,
    low_anchor="bad",
    middle_anchor="fair",
    high_anchor="good",
)


def _from(lowest: int, highest: int, *, confirm: bool = True) -> Scale:
    return Scale(name="q", question="?", lowest=lowest, highest=highest, confirm=confirm)


UNDER = SingleLayout((0, -60), (400, 300), (0, -250), 800, 90)


def answered(scale: Scale, *keys: str, style: Style = FULL_HD_HALF) -> tuple[int, float, list[Ask]]:
    """Press keys, half a second each; return the number, the time and what was asked."""
    steps = rate(scale, style, RatedScene(stimulus="a", reference="r"))
    asks = [next(steps)]
    for index, key in enumerate(keys):
        meaning = asks[-1].meaning(key)
        assert meaning is not None, f"{key} means nothing at {index}"
        try:
            asks.append(steps.send(Response(key, meaning, 0.5)))
        except StopIteration as end:
            assert index == len(keys) - 1
            value, took_s = end.value
            return value, took_s, asks
    pytest.fail("the scale is not answered yet")


@pytest.mark.parametrize(
    ("scale", "keys", "value"),
    [
        (TEN, ["7", "enter"], 7),
        (TEN, ["0", "space"], 10),
        (TEN, ["3", "8", "pad_a"], 8),
        (TEN, ["right", "right", "left", "left", "left", "enter"], 3),
        (TEN, ["wheel_up", "wheel_up", "wheel_down", "wheel_up", "enter"], 6),
        (TEN, ["1", "left", "left", "enter"], 1),
        (TEN, ["0", "pad_right", "pad_left", "pad_a"], 9),
        (TEN, ["click 4", "click accept"], 4),
        (_from(1, 5, confirm=False), ["4"], 4),
        (_from(1, 5, confirm=False), ["click 2"], 2),
        (_from(1, 5, confirm=False), ["right", "right", "enter"], 4),
        (_from(0, 10), ["0", "enter"], 0),
        (_from(-3, 3), ["left", "left", "enter"], -1),
        (SLIDER, ["7", "right", "enter"], 71),
        (SLIDER, ["end", "page_down", "left", "enter"], 89),
        (SLIDER, ["click 37", "enter"], 37),
        (SLIDER, ["0", "page_down", "enter"], 0),
        (_from(0, 100, confirm=False), ["3", "click 44", "enter"], 44),
    ],
)
def test_every_way_to_answer(scale: Scale, keys: list[str], value: int) -> None:
    found, time_s, _ = answered(scale, *keys)
    assert found == value
    assert time_s == pytest.approx(0.5 * len(keys))


def test_nothing_can_be_accepted_before_the_marker_stands() -> None:
    _, _, (first, second) = answered(TEN, "7", "enter")
    assert first.meaning("enter") is None
    assert "accept" not in first.targets
    assert first.task == Rate("similarity", 1, 10, "a", "r", None)
    assert second.task == Rate("similarity", 1, 10, "a", "r", 7)
    assert second.meaning("enter") == second.meaning("click accept") == "accept"


def test_a_scale_without_ten_has_no_zero_that_means_ten() -> None:
    assert "0" not in _from(1, 7).number_keys
    assert _from(0, 10).number_keys["0"] == "0"
    assert TEN.number_keys["0"] == "10"


@pytest.mark.parametrize("scale", [TEN, SLIDER, _from(1, 5, confirm=False), _from(-3, -1)])
def test_someone_without_eyes_finishes(scale: Scale) -> None:
    keys: list[str] = []
    steps = rate(scale, FULL_HD_HALF)
    ask = next(steps)
    while len(keys) < 5:
        keys.append(plain_key(ask))
        try:
            ask = steps.send(Response(keys[-1], ask.meaning(keys[-1]) or "", 0.1))
        except StopIteration:
            break
    assert len(keys) == (1 if scale.at_once else 2)
    assert answered(scale, *keys)[0] == (scale.lowest + scale.highest) // 2


bounds = st.integers(-100, 99).flatmap(lambda low: st.tuples(st.just(low), st.integers(low + 1, min(100, low + 100))))


@given(bounds, st.sampled_from([(960, 1080), (1920, 1080), (1920, 2160), (640, 480)]), st.data())
def test_whatever_the_scale_all_of_it_is_seen_and_a_click_hits_its_number(
    bounds: tuple[int, int], view_px: tuple[int, int], data: st.DataObject
) -> None:
    words = {"low_anchor": "low", "middle_anchor": "middle", "high_anchor": "high"}
    scale = Scale(name="q", question="How?", lowest=bounds[0], highest=bounds[1], **words)
    style = Style(view_px)
    current = data.draw(st.none() | st.sampled_from(scale.numbers))
    for item in scale_items(scale, style, current):
        size = item.size_px if isinstance(item, Box) else (0, item.height_px) if isinstance(item, Text) else (0, 0)
        assert all(
            abs(place) + side / 2 <= view / 2 for place, side, view in zip(item.offset_px, size, view_px, strict=True)
        )
    number = data.draw(st.sampled_from(scale.numbers))
    targets = scale_targets(scale, style, current)
    middle = targets[str(number)].offset_px
    hit = [meaning for meaning, target in targets.items() if target.holds(middle)]
    assert hit == [str(number)] or style.px(720) / (scale.highest - scale.lowest) < 4
    assert str(number) in hit


def test_the_marker_stands_above_its_number_and_nothing_covers_it() -> None:
    for number in TEN.numbers:
        items = scale_items(TEN, FULL_HD_HALF, number)
        (words,) = (item for item in items if isinstance(item, Text) and item.words == str(number))
        marker = max((item for item in items if isinstance(item, Box)), key=lambda box: box.luminance_share)
        assert marker.offset_px[0] == words.offset_px[0]
    near = [item.words for item in scale_items(SLIDER, FULL_HD_HALF, 26) if isinstance(item, Text)]
    assert "26" in near
    assert "25" not in near


@pytest.mark.parametrize(("type_px", "end"), [(None, 360.0), (48.0, 122.0)])
def test_numbers_are_clicked_where_they_stand_and_the_ends_leave_room_for_words(
    type_px: float | None, end: float
) -> None:
    style = Style((960, 1080), type_px=type_px)
    targets = scale_targets(TEN, style, None)
    for item in scale_items(TEN, style, None):
        if isinstance(item, Text) and item.words in targets:
            assert item.offset_px[0] == targets[item.words].offset_px[0]
    ends = [targets[str(number)].offset_px[0] / style.unit_px for number in (1, 10)]
    assert ends == pytest.approx([-end, end], abs=1 / style.unit_px)


def test_under_a_picture_the_question_is_above_and_the_scale_below_it() -> None:
    question, *rest = scale_items(TEN, FULL_HD_HALF, 4, UNDER)
    assert isinstance(question, Text)
    assert question.offset_px == UNDER.question_px
    assert all(UNDER.below_px < item.offset_px[1] < UNDER.below_px + 200 for item in rest)


def test_a_scale_in_a_file() -> None:
    spec = Scale.model_validate({"name": "ease", "question": "How easy?", "low_anchor": "hard", "highest": 7})
    assert (spec.numbers, spec.low_anchor, spec.high_anchor, spec.confirm) == (range(1, 8), "hard", "", True)
    for wrong in ({"lowest": 5, "highest": 5}, {"lowest": -100, "highest": 100}, {"name": "No Name"}):
        with pytest.raises(ValidationError):
            Scale.model_validate({"name": "ease", "question": "How easy?", **wrong})
    (fault,) = scale_faults([spec, spec], "ratings")
    assert fault.path == ("ratings", 1, "name")
