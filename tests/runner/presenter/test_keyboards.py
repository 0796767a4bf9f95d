"""Keyboards that are not American, in a real window: keys count by what they print and by their place."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from runner.observers.presses import Person
from runner.ports import Ask, KeyPress
from runner.presenter.scene import Scene
from runner.presenter.surfaces.windows import WindowSurface

pytestmark = pytest.mark.window
Sit = Callable[[str], WindowSurface]
# X11's numbers of keys, by what an American keyboard has there.
KEYS = {"1": "10", "2": "11", "5": "14", "a": "38", "n": "57", "s": "39", "q": "24"}
KEYPAD = {"4": "83", "6": "85", "8": "80"}


def _do(*words: str) -> None:
    subprocess.run(words, check=True, timeout=10, env=dict(os.environ))


@pytest.fixture
def sit(display: str) -> Iterator[Sit]:
    """Open a window at a keyboard of the layout that is named."""
    for tool in ("xdotool", "setxkbmap"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    with ExitStack() as opened:
        opened.callback(_do, "setxkbmap", "us")

        def at(layout: str) -> WindowSurface:
            _do("setxkbmap", layout)
            return opened.enter_context(WindowSurface((640, 480)))

        yield at


def _answers(window: WindowSurface, ask: Ask, presses: int) -> list[KeyPress]:
    # Another person for each, for whom nothing was pressed before.
    return [Person(window.wait_key).respond(ask, 0.0) for _ in range(presses)]


def _press(*keys: str) -> None:
    _do("xdotool", "key", "--delay", "30", *keys, "F12")


@pytest.mark.parametrize("layout", ["us", "fr", "cz", "ru", "de"])
def test_the_row_of_digits_answers_at_every_keyboard(sit: Sit, layout: str) -> None:
    window = sit(layout)
    ask = Ask(Scene(), {**dict.fromkeys("12345", "rated"), "f12": "end"})
    _press(KEYS["1"], f"shift+{KEYS['2']}", KEYS["5"])
    assert [press.key for press in _answers(window, ask, 4)] == ["1", "2", "5", "f12"]


@pytest.mark.parametrize("layout", ["us", "ru", "cz"])
def test_letters_answer_by_their_place(sit: Sit, layout: str) -> None:
    window = sit(layout)
    ask = Ask(Scene(), {"n": "no_difference", "s": "stop", "a": "option", "f12": "end"})
    _press(KEYS["n"], KEYS["s"], KEYS["a"])
    assert [press.key for press in _answers(window, ask, 4)] == ["n", "s", "a", "f12"]


def test_what_a_key_prints_goes_before_its_place(sit: Sit) -> None:
    """The French key at Q prints A, and the one at A prints Q."""
    window = sit("fr")
    _press(KEYS["q"], KEYS["a"])
    both = Ask(Scene(), {"a": "one", "q": "other", "f12": "end"})
    assert [press.key for press in _answers(window, both, 3)] == ["a", "q", "f12"]


def test_the_keypad_has_arrows_while_num_lock_is_off_and_digits_while_it_is_on(sit: Sit) -> None:
    window = sit("us")
    scale = Ask(Scene(), {**dict.fromkeys("468", "rated"), "left": "lower", "right": "higher", "f12": "end"})
    _press(KEYPAD["4"], KEYPAD["6"], KEYPAD["8"])
    answers = _answers(window, scale, 3)
    assert [press.key for press in answers] == ["left", "right", "f12"]
    assert [(one.key, one.why) for one in answers[-1].ignored] == [("up", "no_meaning")]
    _do("xdotool", "key", "Num_Lock")
    try:
        _press(KEYPAD["4"], KEYPAD["6"], KEYPAD["8"])
        assert [press.key for press in _answers(window, scale, 4)] == ["4", "6", "8", "f12"]
    finally:
        _do("xdotool", "key", "Num_Lock")


def test_presses_with_alt_ctrl_or_super_answer_nothing_and_are_recorded(sit: Sit) -> None:
    window = sit("us")
    ask = Ask(Scene(), {"n": "no_difference", "up": "first", "f12": "end"})
    _press("ctrl+n", "alt+n", "super+n", "ctrl+Up", "shift+n")
    answers = _answers(window, ask, 2)
    assert [press.key for press in answers] == ["n", "f12"]
    ignored = [(one.key, one.why) for one in answers[0].ignored]
    assert ignored == [(key, "no_meaning") for key in ("ctrl+n", "alt+n", "super+n", "ctrl+up")]


def test_super_types_nothing_and_shift_types(sit: Sit) -> None:
    window = sit("us")
    _press("super+n", "ctrl+n", "shift+n")
    keys = [window.wait_key().key]
    while keys[-1] != "f12":
        keys.append(window.wait_key().key)
    assert [key for key in keys if key.startswith("text")] == ["text N"]
