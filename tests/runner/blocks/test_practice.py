"""Practice: another block's trials, told apart from it, with a word on each answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from runner import Scene
from runner.blocks import Block, BlockContext, BlockKind, Draft, Steps
from runner.blocks.practice import feedback_words
from runner.observers import key_for, plain_key
from runner.ports import Ask, Choose, answer
from runner.scene import Text
from tests.runner.every_kind import entry, setting

Play = Callable[..., Any]
PLACE = setting("abcde")
PAIRED: dict[str, Any] = {"kind": "all_pairs", "break_every": 2}
PAIRS = entry(**PAIRED).meet(PLACE)


class Sides(BlockKind):
    """Which side is it on? The right answer alternates, and may be told in the data or in the task alone."""

    kind: str = "sides"
    in_data: bool = True
    pictures: Any = None

    def meet(self, setting: BlockContext) -> Block:
        return Block(entry=self, steps=self._steps, trials=8, expected_s=40.0, pictures=self.pictures or {})

    def _steps(self) -> Steps:
        for number in range(8):
            side = ("left", "right")[number % 2]
            ask = Ask(Scene((Text(f"{number}"),)), {"left": "left", "right": "right"}, task=_side(side))
            given = answer((yield ask)).meaning
            data = {"answer": given, "correct": given == side} if self.in_data else {"answer": given}
            yield Draft("sides", data, response_time_s=0.5)


def practice(trials: int, block: BlockKind | None = None, **keys: Any) -> Block:
    """Return a practice of the pairs, or of a ``block`` of a kind of its own."""
    written = entry("practice", trials=trials, block=PAIRED, **keys)
    made: Block = (written.model_copy(update={"block": block}) if block else written).meet(PLACE)
    return made


def _side(side: str) -> Choose:
    return Choose("side", ("left", "right"), side)


def _words(scene: Scene) -> str:
    return " / ".join(item.words for item in scene.items if isinstance(item, Text))


def _wrong(ask: Ask) -> str:
    if isinstance(ask.task, Choose):
        return key_for(ask, next(option for option in ask.task.options if option != ask.task.correct))
    return plain_key(ask)


def test_it_is_the_first_trials_of_the_block_under_another_kind(play: Play, promised: Play) -> None:
    four = practice(4, feedback="none")
    promised(four, "practice")
    promised(practice(5, Sides(), until={"correct": 1.0, "of": 6}), "practice")
    played, whole = play(four), play(PAIRS)
    for trial, scored in zip(played.trials, whole.trials, strict=False):
        assert dict(trial.details()) == {**scored.details(), "practice_of": "all_pairs"}
        assert trial.response_time_s == scored.response_time_s
    assert played.shown == whole.shown[: len(played.shown)]


def test_it_is_no_longer_than_the_block(play: Play) -> None:
    long = practice(50)
    assert long.trials == PAIRS.trials == len(play(long).trials)
    assert long.expected_s < 3 * PAIRS.expected_s
    assert long.keys == PAIRS.keys


@pytest.mark.parametrize("in_data", [True, False])
def test_what_was_right_is_told_before_it_is_recorded(play: Play, in_data: bool) -> None:
    for press, words in ((plain_key, "That was right."), (_wrong, "That was not right.")):
        played = play(practice(3, Sides(in_data=in_data)), press)
        assert [words in _words(scene) for scene in played.shown] == [False, True] * 3
        assert played.shown_at_record == [2, 4, 6]


def test_without_a_right_answer_there_is_nothing_to_tell(play: Play) -> None:
    assert play(practice(3)).shown == play(practice(3, feedback="none")).shown


def test_the_choice_is_told_in_words(play: Play) -> None:
    played = play(practice(1, feedback="choice"))
    assert "Your answer: the upper picture." in _words(played.shown[1])
    across = {"first_position": "left", "answer": "second"}
    assert feedback_words(across, None, "choice") == "Your answer: the right picture."
    assert feedback_words({"answer": "no_difference"}, None, "choice") == "Your answer: no difference."
    assert feedback_words({"ratings": {"gloss": 3}}, None, "choice") == "Your answer was taken down."


def test_it_ends_once_enough_was_right(play: Play) -> None:
    assert len(play(practice(8, Sides(), until={"correct": 1.0, "of": 3})).trials) == 3
    assert len(play(practice(8, Sides(), until={"correct": 1.0, "of": 3}), _wrong).trials) == 8
    # Wrong twice, then right: two of the last three are right after the fourth.
    asked: list[Ask] = []

    def late(ask: Ask) -> str:
        if isinstance(ask.task, Choose):
            asked.append(ask)
        return _wrong(ask) if len(asked) <= 2 else plain_key(ask)

    assert len(play(practice(8, Sides(), until={"correct": 0.66, "of": 3}), late).trials) == 4


def test_it_shows_what_the_block_makes() -> None:
    made = {"dots": lambda: pytest.fail("not asked for")}

    assert practice(2, Sides(pictures=made)).pictures == made
