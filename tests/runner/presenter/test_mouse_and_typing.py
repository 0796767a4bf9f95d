"""Mouse, wheel and typing in a real window, sent by xdotool."""

from __future__ import annotations

import time
import unicodedata
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.display import EyeModels
from runner import Scene
from runner.ports import KeyPress
from runner.presenter import Presenter, find_mode
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces.input import typed_character
from runner.presenter.surfaces.windows import WindowSurface
from runner.scene import Text

Do = Callable[..., None]


def _until(window: WindowSurface, last: str) -> list[str]:
    keys = [window.wait_key().key]
    while keys[-1] != last:
        keys.append(window.wait_key().key)
    return keys


@pytest.mark.window
def test_wheel_keys_and_characters_keep_their_order(window: WindowSurface, do: Do) -> None:
    before_s = time.monotonic()
    do("click", "4", "key", "b", "click", "5", "click", "5", "type", "--delay", "30", "z A?")
    presses: list[KeyPress] = []
    while not presses or presses[-1].key != "text ?":
        presses.append(window.wait_key())
    keys = [press.key for press in presses]
    assert keys[:5] == ["wheel_up", "b", "text b", "wheel_down", "wheel_down"]
    assert [key for key in keys[5:] if key.startswith("text")] == ["text z", "text  ", "text A", "text ?"]
    times_s = [press.time_s for press in presses]
    assert times_s == sorted(times_s)
    assert before_s <= times_s[0] <= times_s[-1] <= time.monotonic()


@pytest.mark.window
def test_a_click_has_the_place_of_the_pointer_when_it_was_made(window: WindowSurface, do: Do) -> None:
    window.follow_mouse(Pointer((320, 480)))
    do("mousemove_relative", "30", "12", "click", "1", "mousemove_relative", "--", "-40", "0", "click", "1")
    do("click", "3", "key", "F1")
    assert _until(window, "f1") == ["click_at 30,12", "click_at -10,12", "f1"]


@pytest.mark.window
def test_a_mouse_that_comes_from_elsewhere_does_not_jump(display: str, do: Do) -> None:
    """The window covers a part of the screen; the cursor is brought into it when the mouse may point."""
    with WindowSurface((200, 100), windowed=True) as window:
        do("mousemove", "600", "400")
        window.poll_keys()
        pointer = Pointer((320, 480))
        window.follow_mouse(pointer)
        until_s = time.monotonic() + 5.0
        while not pointer.shown and time.monotonic() < until_s:
            do("mousemove_relative", "1", "0")
            time.sleep(0.05)
            window.poll_keys()
        assert 1 <= pointer.place_px[0] <= 8
        assert pointer.place_px[1] == 0


@pytest.mark.window
def test_the_pointer_goes_on_where_the_screen_ends(window: WindowSurface, do: Do) -> None:
    """The cursor is not held back by the screen, but the pointer by the view."""
    pointer = Pointer((4000, 480))
    window.follow_mouse(pointer)
    for step in range(1, 9):
        do("mousemove_relative", "200", "0")
        until_s = time.monotonic() + 5.0
        while pointer.place_px[0] < 200 * step and time.monotonic() < until_s:
            window.poll_keys()
    assert pointer.place_px == (1600, 0)


@pytest.mark.window
def test_a_mouse_that_nobody_sees_or_that_may_not_point_clicks_nothing(window: WindowSurface, do: Do) -> None:
    do("mousemove_relative", "30", "12", "click", "1", "key", "F3")
    assert _until(window, "f3") == ["f3"]
    pointer = Pointer((320, 480))
    window.follow_mouse(pointer)
    do("click", "1", "key", "F1")
    assert _until(window, "f1") == ["f1"]
    do("mousemove_relative", "10", "0", "key", "F4")
    assert _until(window, "f4") == ["f4"]
    assert pointer.shown
    window.follow_mouse(None)
    do("mousemove_relative", "10", "0", "click", "1", "key", "F2")
    assert _until(window, "f2") == ["f2"]
    assert pointer.place_px == (10, 0)


@pytest.mark.window
def test_many_motions_that_came_together_are_one_frame(window: WindowSurface, do: Do, same_models: EyeModels) -> None:
    with Presenter(window, find_mode("side-by-side"), same_models, lambda name: pytest.fail(name)) as presenter:
        onset_s = presenter.show(Scene((Text("Which?"),)))
        presenter.point(True)
        for _ in range(6):
            do("mousemove_relative", "5", "0")
        do("key", "F1")
        assert window.wait_key().key == "f1"
        assert presenter.pointer_px == (30, 0)
        work = presenter.counters
        assert work.frames_drawn == 1
        assert work.pointers_drawn <= 1  # or none: a key that waits goes first, and draws nothing
        assert presenter.show(Scene((Text("Which?"),))) == onset_s


@given(st.integers(-5, 0x120000))
def test_typed_characters_are_seen_and_turn_nothing(codepoint: int) -> None:
    character = typed_character(codepoint)
    if character is not None:
        assert ord(character) == codepoint
        assert unicodedata.category(character) not in {"Cc", "Cs", "Zl", "Zp"}
        turning = ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
        assert unicodedata.bidirectional(character) not in turning


def test_letters_of_any_script_can_be_typed_and_marks_of_direction_cannot() -> None:
    assert [typed_character(ord(one)) for one in "aÅж漢 ?"] == [*"aÅж漢 ?"]
    for refused in (0x00, 0x08, 0x1B, 0x7F, 0x85, 0x200E, 0x200F, 0x202E, 0x2066, 0x2069, 0x061C, 0x2028, 0xD800):
        assert typed_character(refused) is None
