"""Single pictures rated: each once per repeat, on every scale, with or without a limit to how long it is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

from runner.blocks import Rate
from runner.blocks.layout import SingleLayout
from runner.blocks.rating import Rating
from runner.blocks.scale import Scale
from runner.ports import Ask
from runner.presenter import Picture, Scene, Text
from runner.protocol import read_experiment

LAYOUT = SingleLayout((0, -60), (400, 300), (0, -250), 800, 90)
SCALES = (Scale("quality", "How good?", 1, 5), Scale("depth", "How deep?", 0, 100))
BLOCK = Rating(("a", "b", "c"), SCALES, LAYOUT, "s", repeats=2)
Study = Any  # tests/conftest.py
Play = Callable[..., Any]  # conftest.py


def test_what_is_recorded_is_what_was_shown_and_pressed(play: Play) -> None:
    def press(ask: Ask) -> str:
        assert isinstance(ask.task, Rate)
        if ask.task.current is not None:
            return "enter"
        return str("abc".index(str(ask.task.stimulus)) + 2) if ask.task.name == "quality" else "7"

    played = play(BLOCK, press)
    assert [trial.data["ratings"] for trial in played.trials] == [
        {"quality": "abc".index(trial.data["stimulus"]) + 2, "depth": 70} for trial in played.trials
    ]
    for number, trial in enumerate(played.trials):
        assert trial.data["rating_times_s"] == {"quality": 1.0, "depth": 1.0}
        assert trial.response_time_s == 2.0
        for ask in played.asks[4 * number : 4 * number + 4]:
            assert ask.scene.stimuli == (trial.data["stimulus"],)
    order = [trial.data["stimulus"] for trial in played.trials]
    assert sorted(order[:3]) == sorted(order[3:]) == ["a", "b", "c"]
    assert all(one != other for one, other in pairwise(order))


def test_the_next_picture_is_made_ready_while_this_one_is_rated(play: Play) -> None:
    played = play(replace(BLOCK, break_every=4))
    seen = list(dict.fromkeys(scene for scene in played.shown if scene.stimuli))
    ready = list(dict.fromkeys(played.prefetched))
    assert len(ready) == 3  # three different pictures, each made ready as it will be seen first
    assert set(ready) <= set(seen)


def test_a_limited_exposure_leaves_the_scale_without_the_picture(play: Play) -> None:
    played = play(replace(BLOCK, fixation_s=1.0, exposure_s=0.5, blank_s=1.0))
    assert not any(ask.scene.stimuli for ask in played.asks)
    held = [[one["what"] for one in trial.data["timed"]] for trial in played.trials]
    assert held == [["fixation", "picture"], *[["blank", "fixation", "picture"]] * 5]
    cross, picture = played.shown[:2]
    assert isinstance(cross.items[0], Text)
    assert cross.items[0].offset_px == LAYOUT.picture_px
    assert isinstance(picture.items[0], Picture)
    assert [item.words for item in picture.items if isinstance(item, Text)] == ["How good?"]


def test_breaks_come_after_so_many_pictures(play: Play) -> None:
    played = play(replace(BLOCK, break_every=2))
    pages = [scene for scene in played.shown if not scene.stimuli]
    assert len(pages) == 2
    first = pages[0].items[0]
    assert isinstance(first, Text)
    assert first.words == "Time for a break.\n2 of 6 images are done."
    assert Scene() not in played.shown


RATING = """\
blocks:
  - kind: rating
    stimuli: [one, two]
    ratings:
      - {name: quality, question: Good, highest: 5, low_anchor: bad, high_anchor: excellent}
"""


def test_a_file_makes_it(study: Study) -> None:
    study.edit("small.yaml", "blocks:\n", RATING)
    block = read_experiment(study.experiment).blocks("03")[0]
    assert isinstance(block, Rating)
    assert block.scales == (Scale("quality", "Good", 1, 5, "bad", "excellent"),)
    assert (block.stimuli, block.trials, block.expected_s) == (("one", "two"), 2, 10.0)
    other = read_experiment(study.experiment).blocks("04")[0]
    assert isinstance(other, Rating)
    assert other.seed != block.seed
