"""A questionnaire: a record for each question, and nothing accepted that was not asked for."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from pydantic import ValidationError

from runner.blocks import Block, Draft
from runner.blocks.text_entry import lines_needed
from runner.ports import Ask, Choose, Response, Write
from runner.scene import Box, Text
from tests.runner.every_kind import met, setting

Play = Callable[..., Any]


def question(kind: str, name: str, words: str, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "name": name, "question": words, **more}


def block(*questions: dict[str, Any]) -> Block:
    return met("questionnaire", setting(), questions=questions)


HAND = question("choice", "hand", "Which hand do you write with?", options=["Left", "Right", "Both"])
GLASSES = question("choice", "glasses", "Do you wear glasses?", options=["Yes", "No"], required=False)
AGE = question("number", "age", "How old are you?", unit="years", lowest=16, highest=99, whole=True)
REMARKS = question("text", "remarks", "Anything else?", max_length=40, required=False)
BLOCK = block(HAND, GLASSES, AGE, REMARKS)


def _answers(block: Block, *keys: str) -> tuple[list[Any], list[Ask]]:
    """Press ``keys``, one a screen, and return the answers and the screens."""
    left, steps, response = list(keys), block.steps(), None
    answers: list[Any] = []
    asks: list[Ask] = []
    while True:
        try:
            step = steps.send(response)
        except StopIteration:
            return answers, asks
        response = None
        if isinstance(step, Draft):
            answers.append(step.data["answer"])
        elif isinstance(step, Ask):
            asks.append(step)
            if not left:
                return answers, asks
            key = left.pop(0)
            meaning = step.meaning(key)
            assert meaning is not None, f"'{key}' means nothing on screen {len(asks)}"
            response = Response(key, meaning, 0.5)


def _words(ask: Ask) -> str:
    return " / ".join(item.words for item in ask.scene.items if isinstance(item, Text))


def _typed(words: str) -> list[str]:
    return [f"text {character}" for character in words]


def test_each_kind_of_question_gives_its_answer() -> None:
    answers, _ = _answers(BLOCK, "2", "0", *_typed("72"), "enter", *_typed("None, thanks. "), "enter")
    assert answers == ["Right", None, 72, "None, thanks."]


def test_an_option_is_taken_by_click_by_letter_or_by_the_arrows_and_enter() -> None:
    lettered = HAND | {"keys": "letters"}
    for asked, *keys in (
        (HAND, "click 2"),
        (lettered, "b"),
        (HAND, "down", "down", "enter"),
        (HAND, "up", "up", "space"),
        (HAND, "pad_down", "pad_down", "pad_a"),
        (HAND, "wheel_down", "wheel_down", "enter"),
        (HAND, "up", "down", "down", "enter"),  # round and round
    ):
        answers, _ = _answers(block(asked), *keys)
        assert answers == ["Right"], keys


def test_enter_takes_nothing_before_an_option_is_marked() -> None:
    _, (ask,) = _answers(block(HAND))
    assert ask.meaning("enter") is None
    assert ask.meaning("4") is ask.meaning("0") is None


def test_a_range_has_an_end() -> None:
    assert block(AGE | {"highest": 1e9}).trials == 1
    with pytest.raises(ValidationError):
        block(AGE | {"highest": 1.5e9})


def test_a_number_out_of_range_is_told_and_not_accepted() -> None:
    answers, asks = _answers(block(AGE), "text 7", "enter", "enter", "text 2", "enter")
    assert answers == [72]
    assert "7 is too low: type a whole number from 16 to 99 years" in _words(asks[2])
    assert "click accept" not in {f"click {target}" for target in asks[1].targets}


def test_a_letter_in_a_number_is_told_and_left_out() -> None:
    answers, asks = _answers(block(AGE), "text 2", "text x", "text 0", "enter")
    assert answers == [20]
    assert "Digits only" in _words(asks[2])


def test_what_is_required_cannot_be_left_empty_and_the_rest_can() -> None:
    required = question("text", "why", "Why?")
    answers, asks = _answers(block(required), "enter", "text  ", "enter", "text a", "enter")
    assert answers == ["a"]
    assert asks[0].meaning("enter") == "refuse"
    assert _answers(block(REMARKS), "enter")[0] == [None]
    assert _answers(block(REMARKS), "text a", "backspace", "backspace", "click accept")[0] == [None]


def test_every_press_changes_the_screen() -> None:
    """So that each screen has an onset, and the sum of the times since the onsets is the time that was taken."""
    keys = ["enter", "enter", "enter", "backspace", "backspace", "text x", "text x", "text 4", "enter", "enter"]
    _, asks = _answers(block(AGE), *keys)
    assert all(one.scene != other.scene for one, other in pairwise(asks))
    _, asks = _answers(block(HAND), *["down"] * 7, *["up"] * 7)
    assert all(one.scene != other.scene for one, other in pairwise(asks))


def test_the_longest_answer_fits_the_view() -> None:
    longest = question("text", "why", "Why? " * 60, max_length=500)
    _, asks = _answers(block(longest), *_typed("Wide words " * 46)[:500])
    for item in asks[-1].scene.items:
        if not isinstance(item, Text):
            middle, high = item.offset_px[1], item.size_px[1]  # type: ignore[union-attr]  # no pictures here
            assert abs(middle) + high / 2 < 540


def test_a_question_of_any_length_stands_above_its_field() -> None:
    for words in ("Why?", "Why? " * 30):
        _, (ask,) = _answers(block(question("text", "why", words)))
        frame = [item for item in ask.scene.items if isinstance(item, Box)]
        prompt = next(item for item in ask.scene.items if isinstance(item, Text))
        top = min(item.offset_px[1] - item.size_px[1] / 2 for item in frame)
        lines = lines_needed(words, 30, 780)
        assert prompt.offset_px[1] + lines * prompt.height_px / 2 < top


def test_records_say_what_was_asked_and_how_long_it_took(promised: Play) -> None:
    played = promised(BLOCK, "questionnaire")
    hand, _, age, _ = (trial.details() for trial in played.trials)
    assert hand == {
        "name": "hand",
        "question": HAND["question"],
        "answer": "Left",
        "answered_by": "choice",
    }
    assert (age["answer"], age["unit"], age["answered_by"]) == (16, "years", "number")
    # The plain observer types '1', '6' and Enter, each half a second after its screen.
    assert played.trials[2].response_time_s == pytest.approx(1.5)


def test_tasks_say_what_is_asked(play: Play) -> None:
    tasks = [ask.task for ask in play(BLOCK).asks]
    assert tasks[0] == Choose("hand", ("1", "2", "3"))
    assert tasks[1] == Choose("glasses", ("1", "2", "none"))
    assert tasks[2] == Write("age", "", True, "16")
