"""Gamepads by a fake pad: a press once, when it goes down; and no reading where there is none."""

from __future__ import annotations

import resource
import threading
import time

import glfw
import pytest

from runner.presenter.surfaces.input import Gamepads
from runner.presenter.surfaces.windows import WindowSurface


class Pad:
    """What is down on a pad; None while it is not connected. It counts how often it is read."""

    def __init__(self, *down: str) -> None:
        self.down: frozenset[str] | None = frozenset(down)
        self.readings = 0

    def read(self) -> frozenset[str] | None:
        self.readings += 1
        return self.down


def _told(pads: Gamepads, now_s: float) -> list[tuple[str, float]]:
    return [(press.key, press.time_s) for press in pads.presses(now_s) or ()]


def test_a_button_is_pressed_once_when_it_goes_down() -> None:
    pad = Pad()
    pads = Gamepads(pad.read)
    assert _told(pads, 1.0) == []
    pad.down = frozenset({"pad_a"})
    assert _told(pads, 1.008) == [("pad_a", 1.008)]
    assert _told(pads, 1.016) == []
    pad.down = frozenset({"pad_a", "pad_left"})
    assert _told(pads, 1.024) == [("pad_left", 1.024)]
    pad.down = frozenset()
    assert _told(pads, 1.032) == []
    pad.down = frozenset({"pad_a"})
    assert _told(pads, 1.040) == [("pad_a", 1.040)]


def test_what_is_down_when_a_wait_begins_is_no_press() -> None:
    pad = Pad("pad_a")
    pads = Gamepads(pad.read)
    assert _told(pads, 1.0) == []
    pads.settle()
    pad.down = frozenset({"pad_a", "pad_b"})
    assert _told(pads, 2.0) == []
    assert _told(pads, 2.008) == []


def test_a_pad_that_goes_and_comes_presses_nothing() -> None:
    pad = Pad()
    pads = Gamepads(pad.read)
    pads.presses(1.0)
    pad.down = None
    assert pads.presses(1.008) is None
    pad.down = frozenset({"pad_a"})
    assert _told(pads, 1.016) == []


def test_back_stands_for_escape() -> None:
    pad = Pad()
    pads = Gamepads(pad.read)
    pads.presses(1.0)
    pad.down = frozenset({"pad_back"})
    assert _told(pads, 1.008) == [("escape", 1.008)]


@pytest.mark.window
def test_a_press_ends_the_waiting_within_a_few_readings(window: WindowSurface) -> None:
    pad = Pad()
    window.gamepads = Gamepads(pad.read)
    pressed_s: list[float] = []

    def press() -> None:
        pad.down = frozenset({"pad_right"})
        pressed_s.append(time.monotonic())

    later = threading.Timer(0.5, press)
    later.start()
    told = window.wait_key()
    later.join()
    assert told.key == "pad_right"
    assert -0.001 <= told.time_s - pressed_s[0] < 0.2  # 8 ms, and what a busy machine adds
    assert 10 < pad.readings < 120  # 62 in half a second


@pytest.mark.window
def test_without_a_gamepad_nothing_is_read_while_waiting(window: WindowSurface) -> None:
    pad = Pad()
    pad.down = None
    window.gamepads = Gamepads(pad.read)

    def type_x() -> None:
        window._input.on_character(None, ord("x"))
        glfw.post_empty_event()

    later = threading.Timer(2.0, type_x)
    later.start()
    before, start_s = resource.getrusage(resource.RUSAGE_THREAD), time.monotonic()
    assert window.wait_key().key == "text x"
    after, waited_s = resource.getrusage(resource.RUSAGE_THREAD), time.monotonic() - start_s
    later.join()
    assert waited_s > 1.5
    assert pad.readings < 10
    busy_s = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    assert busy_s < 0.01 * waited_s


@pytest.mark.window
def test_the_facts_say_how_exactly_gamepads_are_timed(window: WindowSurface) -> None:
    assert window.facts.gamepad_resolution_ms == 8.0
    assert window.facts.gamepads == ()


@pytest.mark.window
def test_a_button_held_since_the_last_answer_is_no_answer(window: WindowSurface) -> None:
    pad = Pad("pad_a")
    window.gamepads = Gamepads(pad.read)
    window.follow_mouse(None)  # an answer is awaited from here on

    def let_go_and_press() -> None:
        pad.down = frozenset()
        time.sleep(0.3)
        pad.down = frozenset({"pad_b"})

    later = threading.Timer(0.3, let_go_and_press)
    later.start()
    assert window.wait_key().key == "pad_b"
    later.join()
