"""A person's presses: what an ask understands is taken, all else let go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from runner.blocks import Browse, Choose, Rate, Write
from runner.observers import Person
from runner.ports import DOUBLE_S, Ask, KeyPress, Target
from runner.presenter import Scene

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
    person = _person([("click_at 0,50", 1.0), ("click_at 0,50", 1.0 + DOUBLE_S / 2), ("click_at 0,50", 2.0)])
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


LEAST = replace(TWO, least_s=0.1)


def _why(press: KeyPress) -> list[tuple[str, float, str]]:
    return [(ignored.key, ignored.from_onset_s, ignored.why) for ignored in press.ignored]


def test_what_came_too_early_is_returned_with_the_answer() -> None:
    person = _person([("up", 0.9), ("q", 0.95), ("down", 1.05), ("up", 1.2)])
    answer = person.respond(LEAST, 1.0)
    assert answer == KeyPress("up", 1.2)
    assert _why(answer) == [("up", -0.1, "before"), ("q", -0.05, "no_meaning"), ("down", 0.05, "early")]


def test_a_press_soon_after_another_is_no_answer_however_late_it_is() -> None:
    """Presses that follow one another faster than anyone answers are a storm: none of them counts."""
    storm = [("up" if number % 2 else "down", 1.0 + 0.05 * number) for number in range(100)]
    answer = _person([*storm, ("down", 7.0)]).respond(LEAST, 1.0)
    assert answer == KeyPress("down", 7.0)
    assert (len(answer.ignored), answer.ignored_more) == (20, 80)


def test_a_least_response_time_of_nothing_still_refuses_what_was_before_and_double_presses() -> None:
    person = _person([("up", 1.001), ("up", 1.04), ("up", 1.05), ("down", 1.051)])
    assert person.respond(TWO, 1.0).time_s == 1.001
    answer = person.respond(TWO, 1.045)
    assert (answer.key, answer.time_s) == ("down", 1.051)
    assert [why for *_, why in _why(answer)] == ["double", "double"]


def test_the_same_key_answers_again_after_a_quarter_of_a_second() -> None:
    person = _person([("up", 1.2), ("up", 1.3), ("up", 1.46)])
    assert person.respond(LEAST, 1.0).time_s == 1.2
    assert person.respond(LEAST, 1.25).time_s == 1.46


def test_a_held_key_is_recorded_once() -> None:
    person = _person([("up", 1.2), *[("again up", 1.3 + number / 30) for number in range(60)], ("down", 4.0)])
    person.respond(LEAST, 1.0)
    assert _why(person.respond(LEAST, 1.25)) == [("up", 0.05, "held")]


def test_escape_opens_the_menu_whenever_it_was_pressed_but_a_second_one_does_not_close_it() -> None:
    person = _person([("escape", 0.9), ("escape", 1.05), ("c", 1.5)])
    assert person.respond(LEAST, 1.0).key == "escape"
    menu = Ask(Scene(), {"escape": "continue", "c": "continue"}, least_s=0.1)
    assert person.respond(menu, 1.01) == KeyPress("c", 1.5)


def test_a_gamepad_s_button_and_a_click_follow_the_same_rule() -> None:
    pad = replace(LEAST, keys={"pad_up": "first"})
    assert _why(_person([("pad_up", 1.05), ("pad_up", 1.3)]).respond(pad, 1.0)) == [("pad_up", 0.05, "early")]
    person = _person([("click_at 0,50", 0.99), ("click_at 0,50", 1.04), ("click_at 0,-50", 1.5)])
    answer = person.respond(LEAST, 1.0)
    assert answer.key == "click first"
    assert _why(answer) == [("click second", -0.01, "before"), ("click second", 0.04, "early")]


def test_typing_and_moving_are_as_fast_as_one_likes() -> None:
    field = replace(_field("age"), least_s=0.1)
    person = _person([("text 4", 1.01), ("text 2", 1.03), ("enter", 1.05)])
    assert [person.respond(field, onset_s).key for onset_s in (1.0, 1.02, 1.06)] == ["text 4", "text 2", "enter"]

    def scale(current: int | None) -> Ask:
        keys = {"right": "higher", "7": "7", "page_up": "7", "enter": "accept"}
        return Ask(Scene(), keys, task=Rate("gloss", 1, 10, "a", current=current), least_s=0.1)

    person = _person([("right", 1.01), ("right", 1.03), ("page_up", 1.2), ("page_up", 1.22), ("enter", 1.24)])
    times_s = [person.respond(scale(current), 1.0).time_s for current in (None, 5, 6)]
    assert times_s == [1.01, 1.03, 1.2]
    assert [person.respond(scale(7), 1.21).time_s, person.respond(scale(7), 1.23).time_s] == [1.22, 1.24]

    rows = Ask(Scene(), {"down": "downwards", "enter": "2"}, task=Choose("hand", ("1", "2")), least_s=0.1)
    person = _person([("down", 1.01), ("down", 1.03), ("enter", 1.05)])
    assert [person.respond(rows, onset_s).key for onset_s in (1.0, 1.02, 1.06)] == ["down", "down", "enter"]


def test_an_arrow_that_answered_does_not_move_the_scale_that_follows_by_its_second_press() -> None:
    sides = Ask(Scene(), {"left": "first", "right": "second"}, least_s=0.1)
    person = _person([("left", 1.2), ("left", 1.26), ("right", 1.5)])
    assert person.respond(sides, 1.0).key == "left"
    assert person.respond(replace(SCALE, task=Rate("gloss", 1, 10), least_s=0.1), 1.25) == KeyPress("right", 1.5)


def test_leafing_shows_each_picture_for_the_least_time_and_the_same_key_leafs_on() -> None:
    def series(index: int) -> Ask:
        keys = {"right": "next", "enter": "choose"}
        return Ask(Scene(), keys, task=Browse(("a", "b", "c"), index, frozenset({0, index})), least_s=0.1)

    person = _person([("right", 1.2), ("right", 1.25), ("right", 1.4)])
    assert person.respond(series(0), 1.0).time_s == 1.2
    assert person.respond(series(1), 1.22).time_s == 1.4


def test_a_question_like_the_one_before_is_not_answered_by_what_waited() -> None:
    """An equal scene is not drawn again and keeps its onset; the same question is another all the same."""
    now_s = [1.35]
    left = [KeyPress(*press) for press in (("up", 1.2), ("down", 1.3), ("down", 1.5))]
    person = Person(lambda: left.pop(0), clock=lambda: now_s[0])
    assert person.respond(LEAST, 1.0).time_s == 1.2
    assert person.respond(LEAST, 1.0).time_s == 1.5


def test_a_key_counts_by_its_place_where_what_it_prints_means_nothing() -> None:
    left = [KeyPress("т", 1.0, by_place="n"), KeyPress("т", 1.1, by_place="n"), KeyPress("ф", 2.0, by_place="a")]
    person = Person(lambda: left.pop(0))
    assert person.respond(Ask(Scene(), {"n": "none"}), 0.0).key == "n"
    other = Ask(Scene(), {"т": "t", "a": "option"})
    answer = person.respond(other, 1.05)
    assert answer.key == "a"
    assert _why(answer) == [("т", 0.05, "double")]


def test_keys_that_mean_nothing_are_recorded_and_what_is_no_key_of_its_own_is_not() -> None:
    presses = [("q", 1.0), ("text q", 1.0), ("again q", 1.1), ("wheel_up", 1.2), ("ctrl+up", 1.3), ("up", 2.0)]
    assert _why(_person(presses).respond(TWO, 0.5)) == [("q", 0.5, "no_meaning"), ("ctrl+up", 0.8, "no_meaning")]
    typed = _person([("a", 1.0), ("text a", 1.0)]).respond(TYPING, 0.5)
    assert (typed.key, typed.ignored) == ("text a", ())
