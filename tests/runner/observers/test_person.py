"""A person's presses: what an ask understands is taken, all else let go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import pytest

from runner import Scene
from runner.observers import Person
from runner.ports import DOUBLE_S, Ask, Browse, Button, Choose, KeyPress, Rate, Write

TWO = Ask(
    Scene(),
    {"up": "first", "down": "second"},
    targets={"first": Button((0, -50), (100, 40)), "second": Button((0, 50), (100, 40))},
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


def _field(name: str) -> Ask:
    return Ask(Scene(), {"backspace": "erase", "enter": "accept"}, task=Write(name), typing=True)


def _scale(keys: Mapping[str, str], stimulus: str = "a", current: int | None = None, least_s: float = 0.0) -> Ask:
    task = Rate("gloss", 1, 10, stimulus, current=current)
    return Ask(Scene(), {**keys, "enter": "accept"}, task=task, least_s=least_s)


def _series(index: int) -> Ask:
    task = Browse(("a", "b", "c"), index, frozenset({0, index}))
    return Ask(Scene(), {"right": "next", "enter": "choose"}, task=task, least_s=0.1)


LEAST = replace(TWO, least_s=0.1)
QUICK = replace(_field("age"), least_s=0.1)
SIDES = Ask(Scene(), {"left": "first", "right": "second"})
MENU = Ask(Scene(), {"escape": "continue", "c": "continue"}, least_s=0.1)
NOTE = Ask(Scene(), {"n": "note"})
ROWS = Ask(Scene(), {"down": "downwards", "enter": "2"}, task=Choose("hand", ("1", "2")), least_s=0.1)
WHEEL, MOVED = {"wheel_up": "higher"}, {"right": "higher", "7": "7", "page_up": "7"}
CLICK = "click_at 0,50"
Presses = Sequence[tuple[str, float]]
MOVES = ((None, "right", 1.01), (5, "right", 1.03), (6, "page_up", 1.2))
# What is pressed and when; what is asked and since when, with the press that answers it; its time where that counts.
ANSWERED: Mapping[str, tuple[Presses, Sequence[tuple[Ask, float, str, float | None]]]] = {
    "what means nothing or came before the onset does not": (
        [("up", 0.9), ("q", 1.1), ("text q", 1.1), ("wheel_up", 1.15), ("down", 1.2)],
        [(TWO, 1.0, "down", 1.2)],
    ),
    "escape always does": ([("text x", 1.0), ("escape", 2.0)], [(TWO, 0.0, "escape", 2.0)]),
    "a click means the target it hits": (
        [("click_at 0,0", 1.0), ("click_at 51,-50", 1.1), ("click_at -50,-70", 1.2)],
        [(TWO, 0.5, "click first", 1.2)],
    ),
    "a letter is its key": ([("n", 1.0), ("text n", 1.0)], [(NOTE, 0.0, "n", 1.0)]),
    "or itself where words are typed": ([("c", 1.0), ("text c", 1.0)], [(TYPING, 0.0, "text c", 1.0)]),
    "a letter that opened a page of typing is not typed into it": (
        [("n", 1.0), ("text n", 1.0), ("text a", 2.0)],
        [(NOTE, 0.0, "n", 1.0), (TYPING, 1.5, "text a", 2.0)],
    ),
    "a key held down answers one trial": (
        [("up", 1.0), ("again up", 2.0), ("again up", 2.1), ("down", 3.0)],
        [(TWO, 0.5, "up", 1.0), (TWO, 1.5, "down", 3.0)],
    ),
    "backspace may be held, and a scale's arrows": (
        [("backspace", 1.0), ("again backspace", 1.1), ("right", 2.0), ("again right", 2.1)],
        [(TYPING, 0.0, "backspace", 1.0), (TYPING, 1.05, "backspace", 1.1)]
        + [(SCALE, 1.5, "right", 2.0), (SCALE, 2.05, "right", 2.1)],
    ),
    "an arrow held since another question does not move the scale": (
        [("left", 1.0), ("again left", 2.0), ("again left", 2.1), ("right", 2.2)],
        [(SIDES, 0.0, "left", 1.0), (SCALE, 1.5, "right", 2.2)],
    ),
    "nor does the second press of an arrow that answered": (
        [("left", 1.2), ("left", 1.26), ("right", 1.5)],
        [
            (replace(SIDES, least_s=0.1), 1.0, "left", 1.2),
            (_scale({"right": "higher"}, least_s=0.1), 1.25, "right", 1.5),
        ],
    ),
    "the second click of a double click answers nothing": (
        [(CLICK, 1.0), (CLICK, 1.0 + DOUBLE_S / 2), (CLICK, 2.0)],
        [(TWO, 0.5, "click second", 1.0), (TWO, 1.05, "click second", 2.0)],
    ),
    "the same key answers again after a quarter of a second": (
        [("up", 1.2), ("up", 1.3), ("up", 1.46)],
        [(LEAST, 1.0, "up", 1.2), (LEAST, 1.25, "up", 1.46)],
    ),
    "what is typed faster than it is drawn counts from the onset on": (
        [("text a", 1.0), ("text b", 1.01), ("text c", 1.02), ("text d", 3.0)],
        [(_field("age"), 0.9, "text a", 1.0), (_field("age"), 1.1, "text b", 1.1)]
        + [(_field("age"), 1.2, "text c", 1.2), (_field("age"), 1.3, "text d", 3.0)],
    ),
    "what was typed before the next field is not typed into it": (
        [("enter", 1.0), ("text b", 1.01), ("enter", 1.02), ("text c", 3.0)],
        [(_field("age"), 0.9, "enter", 1.0), (_field("name"), 1.1, "text c", 3.0)],
    ),
    "nor where the same is asked again": (
        [("enter", 1.0), ("text b", 1.01), ("text c", 3.0)],
        [(_field("age"), 0.9, "enter", 1.0), (_field("age"), 1.1, "text c", 3.0)],
    ),
    "every step of the wheel moves the scale but none the next one": (
        [("wheel_up", 1.0), ("wheel_up", 1.0), ("enter", 1.5), ("wheel_up", 1.5), ("enter", 4.0)],
        [(_scale(WHEEL), 0.9, "wheel_up", 1.0), (_scale(WHEEL), 1.1, "wheel_up", 1.1)]
        + [(_scale(WHEEL), 1.2, "enter", 1.5), (_scale(WHEEL, "b"), 1.6, "enter", 4.0)],
    ),
    "escape opens the menu whenever it was pressed, but a second one does not close it": (
        [("escape", 0.9), ("escape", 1.05), ("c", 1.5)],
        [(LEAST, 1.0, "escape", None), (MENU, 1.01, "c", 1.5)],
    ),
    "typing is as fast as one likes": (
        [("text 4", 1.01), ("text 2", 1.03), ("enter", 1.05)],
        [(QUICK, 1.0, "text 4", None), (QUICK, 1.02, "text 2", None), (QUICK, 1.06, "enter", None)],
    ),
    "so is moving a marker": (
        [("right", 1.01), ("right", 1.03), ("page_up", 1.2), ("page_up", 1.22), ("enter", 1.24)],
        [(_scale(MOVED, current=at, least_s=0.1), 1.0, key, s) for at, key, s in MOVES]
        + [(_scale(MOVED, current=7, least_s=0.1), 1.21, "page_up", 1.22)]
        + [(_scale(MOVED, current=7, least_s=0.1), 1.23, "enter", 1.24)],
    ),
    "and going down a list": (
        [("down", 1.01), ("down", 1.03), ("enter", 1.05)],
        [(ROWS, 1.0, "down", None), (ROWS, 1.02, "down", None), (ROWS, 1.06, "enter", None)],
    ),
    "leafing shows each picture for the least time, and the same key leafs on": (
        [("right", 1.2), ("right", 1.25), ("right", 1.4)],
        [(_series(0), 1.0, "right", 1.2), (_series(1), 1.22, "right", 1.4)],
    ),
}


@pytest.mark.parametrize("what", ANSWERED)
def test_which_presses_answer(what: str) -> None:
    presses, asked = ANSWERED[what]
    person = _person(presses)
    for ask, onset_s, key, time_s in asked:
        answer = person.respond(ask, onset_s)
        assert (answer.key, time_s if time_s is None else answer.time_s) == (key, time_s)


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


def test_a_held_key_is_recorded_once() -> None:
    person = _person([("up", 1.2), *[("again up", 1.3 + number / 30) for number in range(60)], ("down", 4.0)])
    person.respond(LEAST, 1.0)
    assert _why(person.respond(LEAST, 1.25)) == [("up", 0.05, "held")]


def test_a_gamepad_s_button_and_a_click_follow_the_same_rule() -> None:
    pad = replace(LEAST, keys={"pad_up": "first"})
    assert _why(_person([("pad_up", 1.05), ("pad_up", 1.3)]).respond(pad, 1.0)) == [("pad_up", 0.05, "early")]
    person = _person([("click_at 0,50", 0.99), ("click_at 0,50", 1.04), ("click_at 0,-50", 1.5)])
    answer = person.respond(LEAST, 1.0)
    assert answer.key == "click first"
    assert _why(answer) == [("click second", -0.01, "before"), ("click second", 0.04, "early")]


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
