"""A questionnaire: a record for each question, and nothing accepted that was not asked for."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from runner.blocks import Choose, Draft, Response, Write
from runner.blocks.questionnaire import Choice, Questionnaire, Typed
from runner.blocks.text_entry import Number, Words
from runner.ports import Ask
from runner.presenter import Text

Play = Callable[..., Any]

HAND = Choice("hand", "Which hand do you write with?", ("Left", "Right", "Both"))
GLASSES = Choice("glasses", "Do you wear glasses?", ("Yes", "No"), required=False)
AGE = Typed("age", "How old are you?", Number("years", 16, 99, whole=True))
REMARKS = Typed("remarks", "Anything else?", Words(40), required=False)
BLOCK = Questionnaire((HAND, GLASSES, AGE, REMARKS))


def _answers(block: Questionnaire, *keys: str) -> tuple[list[Any], list[Ask]]:
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
    lettered = Choice("hand", "Which hand?", ("Left", "Right", "Both"), letters=True)
    for question, *keys in (
        (HAND, "click 2"),
        (lettered, "b"),
        (HAND, "down", "down", "enter"),
        (HAND, "up", "up", "space"),
        (HAND, "pad_down", "pad_down", "pad_a"),
        (HAND, "wheel_down", "wheel_down", "enter"),
        (HAND, "up", "down", "down", "enter"),  # round and round
    ):
        answers, _ = _answers(Questionnaire((question,)), *keys)
        assert answers == ["Right"], keys


def test_enter_takes_nothing_before_an_option_is_marked() -> None:
    _, (ask,) = _answers(Questionnaire((HAND,)))
    assert ask.meaning("enter") is None
    assert ask.meaning("4") is ask.meaning("0") is None


def test_a_number_out_of_range_is_told_and_not_accepted() -> None:
    answers, asks = _answers(Questionnaire((AGE,)), "text 7", "enter", "enter", "text 2", "enter")
    assert answers == [72]
    assert "7 is too low: type a whole number from 16 to 99 years" in _words(asks[2])
    assert "click accept" not in {f"click {target}" for target in asks[1].targets}


def test_a_letter_in_a_number_is_told_and_left_out() -> None:
    answers, asks = _answers(Questionnaire((AGE,)), "text 2", "text x", "text 0", "enter")
    assert answers == [20]
    assert "Digits only" in _words(asks[2])


def test_what_is_required_cannot_be_left_empty_and_the_rest_can() -> None:
    required = Typed("why", "Why?", Words())
    answers, asks = _answers(Questionnaire((required,)), "enter", "text  ", "enter", "text a", "enter")
    assert answers == ["a"]
    assert asks[0].meaning("enter") == "refuse"
    assert _answers(Questionnaire((REMARKS,)), "enter")[0] == [None]
    assert _answers(Questionnaire((REMARKS,)), "text a", "backspace", "backspace", "click accept")[0] == [None]


def test_every_press_changes_the_screen() -> None:
    """So that each screen has an onset, and the sum of the times since the onsets is the time that was taken."""
    keys = ["enter", "enter", "enter", "backspace", "backspace", "text x", "text x", "text 4", "enter", "enter"]
    _, asks = _answers(Questionnaire((AGE,)), *keys)
    assert all(one.scene != other.scene for one, other in pairwise(asks))
    _, asks = _answers(Questionnaire((HAND,)), *["down"] * 7, *["up"] * 7)
    assert all(one.scene != other.scene for one, other in pairwise(asks))


def test_the_longest_answer_fits_the_view() -> None:
    question = Typed("why", "Why? " * 60, Words(500))
    _, asks = _answers(Questionnaire((question,)), *_typed("Wide words " * 46)[:500])
    for item in asks[-1].scene.items:
        if not isinstance(item, Text):
            middle, high = item.offset_px[1], item.size_px[1]  # type: ignore[union-attr]  # no pictures here
            assert abs(middle) + high / 2 < 540


def test_records_say_what_was_asked_and_how_long_it_took(promised: Play) -> None:
    played = promised(BLOCK, "questionnaire")
    hand, _, age, _ = (trial.data for trial in played.trials)
    assert hand == {
        "name": "hand",
        "question": HAND.question,
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
