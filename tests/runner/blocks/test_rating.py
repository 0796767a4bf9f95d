"""Single pictures rated: each once per repeat, on every scale, with or without a limit to how long it is seen."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from documents import InputError
from runner import Picture, Scene
from runner.blocks import Block, Draft
from runner.observers import walk
from runner.ports import Ask, Rate
from runner.protocol import Experiment, read_experiment
from runner.scene import Text
from tests.runner.every_kind import met, setting

PLACE = setting("abc")
SCALES = (
    {"name": "quality", "question": "How good?", "highest": 5},
    {"name": "depth", "question": "How deep?", "lowest": 0, "highest": 100},
)
Study = Any  # tests/conftest.py
Play = Callable[..., Any]  # conftest.py


def block(**keys: Any) -> Block:
    return met("rating", PLACE, ratings=SCALES, repeats=2, **keys)


def test_what_is_recorded_is_what_was_shown_and_pressed(play: Play) -> None:
    def press(ask: Ask) -> str:
        assert isinstance(ask.task, Rate)
        if ask.task.current is not None:
            return "enter"
        return str("abc".index(str(ask.task.stimulus)) + 2) if ask.task.name == "quality" else "7"

    played = play(block(), press)
    assert [trial.details()["ratings"] for trial in played.trials] == [
        {"quality": "abc".index(trial.details()["stimulus"]) + 2, "depth": 70} for trial in played.trials
    ]
    for number, trial in enumerate(played.trials):
        assert trial.details()["rating_times_s"] == {"quality": 1.0, "depth": 1.0}
        assert trial.response_time_s == 2.0
        for ask in played.asks[4 * number : 4 * number + 4]:
            assert ask.scene.stimuli == (trial.details()["stimulus"],)
    order = [trial.details()["stimulus"] for trial in played.trials]
    assert sorted(order[:3]) == sorted(order[3:]) == ["a", "b", "c"]
    assert all(one != other for one, other in pairwise(order))


def test_how_long_it_takes_grows_by_what_is_shown_and_asked() -> None:
    plain, timed, one = block(), block(exposure_s=0.5, blank_s=1.0), met("rating", PLACE, ratings=SCALES[:1], repeats=2)
    assert plain.trials == timed.trials == one.trials == 6
    assert timed.expected_s - plain.expected_s == pytest.approx(6 * 1.5)
    assert plain.expected_s == 2 * one.expected_s


def test_the_next_picture_is_made_ready_while_this_one_is_rated(play: Play) -> None:
    played = play(block(break_every=4))
    seen = list(dict.fromkeys(scene for scene in played.shown if scene.stimuli))
    ready = list(dict.fromkeys(played.prefetched))
    assert len(ready) == 3  # three different pictures, each made ready as it will be seen first
    assert set(ready) <= set(seen)


def test_a_limited_exposure_leaves_the_scale_without_the_picture(play: Play) -> None:
    played = play(block(fixation_s=1.0, exposure_s=0.5, blank_s=1.0))
    assert not any(ask.scene.stimuli for ask in played.asks)
    held = [[one["what"] for one in trial.details()["timed"]] for trial in played.trials]
    assert held == [["fixation", "picture"], *[["blank", "fixation", "picture"]] * 5]
    cross, picture = played.shown[:2]
    assert isinstance(cross.items[0], Text)
    assert cross.items[0].offset_px == PLACE.single_layout().picture_px
    assert isinstance(picture.items[0], Picture)
    assert [item.words for item in picture.items if isinstance(item, Text)] == ["How good?"]


def test_breaks_come_after_so_many_pictures(play: Play) -> None:
    played = play(block(break_every=2))
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
    made = read_experiment(study.experiment).blocks("03")[0]
    assert made.scale_ends == {"quality": (1, 5)}
    assert (made.trials, made.expected_s) == (2, 10.0)
    orders = [
        [
            step.stimuli
            for step in walk(read_experiment(study.experiment).blocks(f"{n:02d}")[0])
            if isinstance(step, Draft)
        ]
        for n in range(8)
    ]
    assert {*orders[0]} == {("one",), ("two",)}
    assert orders[0][::-1] in orders  # each observer has an order of their own


# What pictures are judged against: nothing, a real thing, or a picture; and what observers read about it.


BEST = "{kind: best_of_series, series: {one: [one, two], two: [three, four]}}"


def words_on(design: Experiment) -> str:
    """Return every word that an observer reads."""
    scenes = [step.scene for block in design.blocks("01") for step in walk(block) if not isinstance(step, Draft)]
    return "\n".join(item.words for scene in scenes for item in scene.items if isinstance(item, Text))


def written(study: Study, reference: str | None) -> Experiment:
    """Return the study with a series, and ``reference`` in its layout, left out if None."""
    study.edit("small.yaml", "{kind: all_pairs, break_every: 4}", BEST)
    if reference is not None:
        study.edit("small.yaml", "gap_mm: 5}", f"gap_mm: 5, reference: {reference}}}")
    return read_experiment(study.experiment)


@pytest.mark.parametrize("reference", [None, "none"])
def test_without_a_reference_no_word_speaks_of_one(study: Study, reference: str | None) -> None:
    design = written(study, reference)
    assert design.stimuli.reference is None
    assert design.spec.layout.reference == "none"
    words = words_on(design).lower()
    assert "how good is the image that you chose?" in words
    assert "reference" not in words
    assert "plate" not in words
    (_, block) = design.example_blocks
    assert [*block.scale_ends] == ["quality", "difficulty"]


@pytest.mark.parametrize("reference", ["physical", "four"])
def test_with_one_the_choice_is_rated_against_it(study: Study, reference: str) -> None:
    study.edit(
        "small.yaml",
        "layout: {arrangement: vertical, size_mm: [20, 10]",
        "layout: {arrangement: vertical, size_mm: [8, 8]",
    )
    words = words_on(written(study, reference))
    assert "that you chose to the reference?" in words


def test_scales_that_are_written_stay(study: Study) -> None:
    study.edit(
        "small.yaml",
        "{kind: all_pairs, break_every: 4}",
        BEST[:-1] + ", ratings: [{name: similarity, question: How alike are they}]}",
    )
    assert "How alike are they" in words_on(read_experiment(study.experiment))


def test_an_unknown_reference_names_what_can_be_written(study: Study) -> None:
    with pytest.raises(InputError, match=r"'nona' .*did you mean 'none'"):
        written(study, "nona")


def test_a_digest_of_before_stays_what_it_was(study: Study) -> None:
    """Sessions recorded before ``none`` existed: a file that wrote ``physical``, or left it out and meant that."""
    left_out = read_experiment(study.experiment)
    study.edit("small.yaml", "gap_mm: 5}", "gap_mm: 5, reference: physical}")
    says_so = read_experiment(study.experiment)
    dump: dict[str, Any] = says_so.spec.model_dump(mode="json")
    assert dump["layout"]["reference"] == "physical"
    assert says_so.digest == hashlib.sha256(says_so.spec.model_dump_json().encode()).hexdigest()
    assert left_out.digest == says_so.digest
    study.edit("small.yaml", "reference: physical", "reference: none")
    assert read_experiment(study.experiment).digest != says_so.digest
