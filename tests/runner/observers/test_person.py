"""A person's presses: what an ask understands is taken, all else let go."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from runner.blocks.tasks import Rate, Write
from runner.observers.presses import DOUBLE_CLICK_S, Person
from runner.ports import Ask, KeyPress, Target
from runner.presenter.scene import Scene

TWO = Ask(
    Scene(),
    {"up": "first", "down": "second"},
    targets={"first": Target((0, -50), (100, 40)), "second": Target((0, 50), (100, 40))},
)
TYPING = Ask(Scene(), {"backspace": "erase", "enter": "accept"}, typing=True)
SCALE = Ask(Scene(), {"left": "lower", "right": "higher", "enter": "accept"})


class Mouse:
    """Remembers what was wanted of the pointer."""

    def __init__(self) -> None:
        self.wanted: list[tuple[bool, bool]] = []

    def point(self, wanted: bool, at_once: bool) -> None:
        self.wanted.append((wanted, at_once))


def _person(presses: Sequence[tuple[str, float]], mouse: Mouse | None = None) -> Person:
    left = [KeyPress(*press) for press in presses]
    return Person(lambda: left.pop(0), (mouse or Mouse()).point)


def test_what_means_nothing_and_what_came_before_the_onset_is_no_answer() -> None:
    person = _person([("up", 0.9), ("q", 1.1), ("text q", 1.1), ("wheel_up", 1.15), ("down", 1.2)])
    assert person.respond(TWO, 1.0) == KeyPress("down", 1.2)


def test_escape_is_always_told() -> None:
    assert _person([("text x", 1.0), ("escape", 2.0)]).respond(TWO, 0.0) == KeyPress("escape", 2.0)


def test_a_click_means_the_target_it_hits() -> None:
    person = _person([("click_at 0,0", 1.0), ("click_at 51,-50", 1.1), ("click_at -50,-70", 1.2)])
    assert person.respond(TWO, 0.5) == KeyPress("click first", 1.2)


def test_a_letter_is_its_key_where_keys_have_meanings_and_itself_where_words_are_typed() -> None:
    presses = [("c", 1.0), ("text c", 1.0)]
    assert _person(presses).respond(Ask(Scene(), {"c": "continue"}), 0.0).key == "c"
    assert _person(presses).respond(TYPING, 0.0).key == "text c"
    # A letter that opened a page of typing is not typed into it: it came before the page.
    person = _person([("n", 1.0), ("text n", 1.0), ("text a", 2.0)])
    assert person.respond(Ask(Scene(), {"n": "note"}), 0.0).key == "n"
    assert person.respond(TYPING, 1.5).key == "text a"


def test_a_key_held_down_answers_one_trial() -> None:
    person = _person([("up", 1.0), ("again up", 2.0), ("again up", 2.1), ("down", 3.0)])
    assert person.respond(TWO, 0.5).key == "up"
    assert person.respond(TWO, 1.5) == KeyPress("down", 3.0)


def test_backspace_and_a_scale_s_arrows_may_be_held() -> None:
    person = _person([("backspace", 1.0), ("again backspace", 1.1), ("right", 2.0), ("again right", 2.1)])
    assert [person.respond(TYPING, 0.0), person.respond(TYPING, 1.05)] == [
        KeyPress("backspace", 1.0),
        KeyPress("backspace", 1.1),
    ]
    assert [person.respond(SCALE, 1.5).time_s, person.respond(SCALE, 2.05).time_s] == [2.0, 2.1]


def test_an_arrow_held_since_another_question_does_not_move_the_scale() -> None:
    sides = Ask(Scene(), {"left": "first", "right": "second"})
    person = _person([("left", 1.0), ("again left", 2.0), ("again left", 2.1), ("right", 2.2)])
    assert person.respond(sides, 0.0).key == "left"
    assert person.respond(SCALE, 1.5) == KeyPress("right", 2.2)


def test_the_second_click_of_a_double_click_answers_nothing() -> None:
    person = _person([("click_at 0,50", 1.0), ("click_at 0,50", 1.0 + DOUBLE_CLICK_S / 2), ("click_at 0,50", 2.0)])
    assert person.respond(TWO, 0.5).time_s == 1.0
    assert person.respond(TWO, 1.05) == KeyPress("click second", 2.0)


def test_the_mouse_points_only_while_something_can_be_clicked() -> None:
    mouse = Mouse()
    person = _person([("click_at 0,50", 1.0), ("left", 2.0), ("up", 3.0), ("down", 4.0)], mouse)
    person.respond(TWO, 0.0)
    assert mouse.wanted == [(True, False), (False, False)]
    mouse.wanted.clear()
    person.respond(SCALE, 1.5)  # nothing to click
    person.respond(TWO, 2.5)  # last was a key: it waits to be moved
    assert mouse.wanted == [(False, True), (False, False), (True, False), (False, False)]


def test_after_a_click_the_pointer_is_there_at_once() -> None:
    mouse = Mouse()
    person = _person([("click_at 0,50", 1.0), ("down", 4.0)], mouse)
    person.respond(TWO, 0.0)
    person.respond(TWO, 2.0)
    assert mouse.wanted[2] == (True, True)


def test_the_mouse_points_no_longer_when_the_window_was_closed() -> None:
    mouse = Mouse()
    with pytest.raises(IndexError):
        _person([], mouse).respond(TWO, 0.0)
    assert mouse.wanted == [(True, False), (False, False)]


def _field(name: str) -> Ask:
    return Ask(Scene(), {"backspace": "erase", "enter": "accept"}, task=Write(name), typing=True)


def test_what_is_typed_faster_than_it_is_drawn_is_not_lost() -> None:
    """Characters that waited while the page was drawn again count, from its onset on."""
    person = _person([("text a", 1.0), ("text b", 1.01), ("text c", 1.02), ("text d", 3.0)])
    presses = [person.respond(_field("age"), onset_s) for onset_s in (0.9, 1.1, 1.2, 1.3)]
    assert presses == [
        KeyPress("text a", 1.0),
        KeyPress("text b", 1.1),
        KeyPress("text c", 1.2),
        KeyPress("text d", 3.0),
    ]


def test_what_was_typed_before_the_next_field_is_not_typed_into_it() -> None:
    person = _person([("enter", 1.0), ("text b", 1.01), ("enter", 1.02), ("text c", 3.0)])
    assert person.respond(_field("age"), 0.9).key == "enter"
    assert person.respond(_field("name"), 1.1) == KeyPress("text c", 3.0)
    # Nor where the same is asked again.
    person = _person([("enter", 1.0), ("text b", 1.01), ("text c", 3.0)])
    assert person.respond(_field("age"), 0.9).key == "enter"
    assert person.respond(_field("age"), 1.1) == KeyPress("text c", 3.0)


def test_every_step_of_the_wheel_moves_the_scale_but_none_the_next_one() -> None:
    def scale(stimulus: str) -> Ask:
        keys = {"wheel_up": "higher", "enter": "accept"}
        return Ask(Scene(), keys, task=Rate("gloss", 1, 10, stimulus))

    person = _person([("wheel_up", 1.0), ("wheel_up", 1.0), ("enter", 1.5), ("wheel_up", 1.5), ("enter", 4.0)])
    assert [person.respond(scale("a"), onset_s).time_s for onset_s in (0.9, 1.1, 1.2)] == [1.0, 1.1, 1.5]
    assert person.respond(scale("b"), 1.6) == KeyPress("enter", 4.0)
