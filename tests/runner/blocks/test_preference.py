"""Stereo or flat: both versions of each picture, sides balanced, found by their factors, replayed exactly."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from runner.blocks import Block, BlockContext, Stimuli
from runner.blocks.preference import Preference, Versions
from runner.ports import Compare
from runner.scene import Text
from tests.runner.every_kind import met, pairs_of, setting

Play = Callable[..., Any]
PLACE = setting(f"{number}-{view}" for number in range(6) for view in ("stereo", "flat"))
SIX = [[f"{number}-stereo", f"{number}-flat"] for number in range(6)]


def block(place: BlockContext = PLACE, **keys: Any) -> Block:
    return met("preference", place, **{"pairs": SIX, "break_every": 4, **keys})


TIMED: dict[str, Any] = {"exposure_s": 1.0, "blank_s": 0.2}
BLOCKS = {
    "own pace": block(),
    "timed": block(**TIMED),
    "twice": block(repeats=2, blank_between_s=0.0),
    "at once": block(presentation="simultaneous"),
    "at once and taken away": block(presentation="simultaneous", **TIMED),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_a_block_keeps_what_every_block_promises(play: Play, promised: Play, name: str) -> None:
    block = BLOCKS[name]
    played = promised(block, "preference")
    comparing = [ask for ask in played.asks if isinstance(ask.task, Compare)]
    assert all(ask.keys == block.keys and set(ask.targets) == {"first", "second"} for ask in comparing)
    for trial in played.trials:
        data = trial.details()
        assert data["chosen"] == data[data["answer"]]
        assert data["chosen"].endswith(data["chosen_view"])
        assert data["first"].endswith(data["first_view"])
        assert {data["chosen"], data["rejected"]} == {data["first"], data["second"]}
        assert data["first"].split("-")[0] == data["second"].split("-")[0]
        assert trial.response_time_s == 0.5
    assert {trial.details()["answer"] for trial in play(block).trials} == {"first"}


def test_at_ones_own_pace_each_interval_stays_until_the_space_bar(play: Play) -> None:
    played = play(BLOCKS["own pace"])
    _, one, between, two, question, *_ = played.shown
    first = played.trials[0].details()
    assert one.stimuli == (first["first"],)
    assert two.stimuli == (first["second"],)
    assert not between.items
    assert [item.words for item in question.items] == ["Which?", "1", "2"]
    assert [item.words for item in two.items if isinstance(item, Text)] == ["2", "Press the space bar to go on"]
    assert first["interval_s"] == [0.5, 0.5]
    # The second picture is made ready while the first is looked at.
    assert played.prefetched[1].stimuli == two.stimuli


def test_timed_intervals_are_recorded_as_timed_scenes(play: Play) -> None:
    data = play(BLOCKS["timed"]).trials[1].details()
    assert [held["what"] for held in data["timed"]] == ["blank", "interval_1", "between", "interval_2"]
    assert "interval_s" not in data


@given(st.integers(1, 9), st.integers(1, 3), st.integers(0, 9), st.integers(0, 40))
def test_sides_balance_within_and_between_observers(count: int, repeats: int, seed: int, pair: int) -> None:
    def order(number: int) -> list[tuple[str, str]]:
        place = setting((), f"{number:02d}", seed=seed)
        return pairs_of(block(place, pairs=SIX_AND_MORE[:count], repeats=repeats, break_every=None))

    own, neighbour = order(2 * pair + 1), order(2 * pair + 2)
    pictures = [first.split("-")[0] for first, _ in own]
    assert Counter(pictures) == {str(number): repeats for number in range(count)}
    assert abs(2 * sum(first.endswith("stereo") for first, _ in own) - len(own)) <= 1
    if count > 1:
        assert all(one != following for one, following in pairwise(pictures))
    assert Counter((second, first) for first, second in neighbour) == Counter(own)


SIX_AND_MORE = [[f"{number}-stereo", f"{number}-flat"] for number in range(9)]


def _stimuli(*views: str, **more: str) -> Stimuli:
    return Stimuli({f"{image}-{view}": {"image": image, "view": view, **more} for image in "ab" for view in views})


def _spec(**written: Any) -> Preference:
    return Preference.model_validate({"kind": "preference", **written})


def test_pairs_are_found_by_the_view() -> None:
    stimuli = _stimuli("flat", "stereo", exposure="long")
    spec = _spec()
    assert spec.versions(stimuli) == (Versions("a-stereo", "a-flat"), Versions("b-stereo", "b-flat"))
    assert not list(spec.faults(stimuli))
    without = replace(stimuli, reference="b-flat")
    assert spec.versions(without) == (Versions("a-stereo", "a-flat"),)


def test_named_pairs_need_no_factors() -> None:
    stimuli = Stimuli({"x": {}, "y": {}})
    spec = _spec(pairs=[["y", "x"]])
    assert spec.versions(stimuli) == (Versions("y", "x"),)
    assert not list(spec.faults(stimuli))


@pytest.mark.parametrize(
    ("stimuli", "pairs", "path", "what"),
    [
        (_stimuli("stereo"), "all", ("pairs",), "in stereo and flat"),
        (
            Stimuli({"x": {"view": "flat"}, "y": {"view": "stereo"}, "z": {"view": "flat"}}),
            "all",
            ("pairs",),
            "x and z",
        ),
        (_stimuli("stereo", "flat"), [["a-stereo", "a-falt"]], ("pairs", 0, 1), "a-falt"),
        (_stimuli("stereo", "flat"), [["a-stereo", "b-stereo"]], ("pairs", 0, 1), "'b-stereo' is stereo, not flat"),
        (_stimuli("stereo", "flat"), [["a-stereo", "a-flat"]] * 2, ("pairs", 1), "stands twice"),
    ],
)
def test_faults_name_their_place(stimuli: Stimuli, pairs: Any, path: tuple[object, ...], what: str) -> None:
    (fault,) = _spec(pairs=pairs).faults(stimuli)
    assert fault.path == path
    assert what in fault.message


def test_a_blank_between_two_that_are_shown_at_once_is_refused() -> None:
    with pytest.raises(ValidationError, match="belongs to 'presentation: sequence'"):
        _spec(presentation="simultaneous", blank_between_s=1)
