"""What is done at a window: keys, characters, wheel, mouse and gamepads, in one queue, each with its time."""

from __future__ import annotations

import time
import unicodedata
from collections import deque
from collections.abc import Callable
from types import MappingProxyType
from typing import Any, TypeAlias

import glfw

from runner.ports import KeyPress
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces.keyboard import key_names


class Input:
    """Takes glfw's callbacks of one window or more; ``pointed`` is whether the pointer was moved since it was drawn.

    ``presses`` are those that nobody took yet, as `Surface.wait_key` describes them.
    """

    def __init__(self) -> None:
        self.presses: deque[KeyPress] = deque()
        self.pointed = False
        self._again = False
        self._commanding = False
        self._wheel_steps = 0.0
        self._pointer: Pointer | None = None
        self._cursor_px: tuple[float, float] | None = None

    def listen(self, window: Any) -> None:
        """Queue what is done at ``window``, but for the mouse's motion."""
        glfw.set_input_mode(window, glfw.LOCK_KEY_MODS, glfw.TRUE)  # else nobody tells whether NumLock is on
        glfw.set_key_callback(window, self._on_key)
        glfw.set_char_callback(window, self.on_character)
        glfw.set_scroll_callback(window, self._on_wheel)
        glfw.set_mouse_button_callback(window, self._on_button)

    def listen_to_motion(self, window: Any) -> None:
        """Follow the mouse's motion over ``window``, which must be one only."""
        glfw.set_cursor_pos_callback(window, self._on_motion)
        glfw.set_cursor_enter_callback(window, self._on_enter)

    def follow_mouse(self, window: Any, pointer: Pointer | None) -> None:
        """Let the mouse, taken by ``window``, move ``pointer`` from now on; with None it moves and clicks nothing."""
        self._pointer, self.pointed = pointer, False
        if pointer is not None and glfw.get_input_mode(window, glfw.CURSOR) != glfw.CURSOR_DISABLED:
            glfw.set_input_mode(window, glfw.CURSOR, glfw.CURSOR_DISABLED)
            self._cursor_px = glfw.get_cursor_pos(window)

    def read_gamepads(self, gamepads: Gamepads) -> bool:
        """Take what was pressed at ``gamepads``; return whether there are any."""
        presses = gamepads.presses(time.monotonic())
        self.presses.extend(presses or ())
        return presses is not None

    def on_character(self, _window: Any, codepoint: int) -> None:
        """Take a character that was typed; one that a held key repeats, or that Super commands with, is none."""
        now_s = time.monotonic()
        character = typed_character(codepoint)
        if character is not None and not self._again and not self._commanding:
            self.presses.append(KeyPress(f"text {character}", now_s))

    def _on_key(self, _window: Any, key: int, scancode: int, action: int, modifiers: int) -> None:
        now_s = time.monotonic()
        self._again = action == glfw.REPEAT
        self._commanding = bool(modifiers & glfw.MOD_SUPER)
        name, by_place = key_names(key, scancode, modifiers)
        if action != glfw.RELEASE and name:
            self.presses.append(KeyPress(f"again {name}" if self._again else name, now_s, by_place=by_place))

    def _on_wheel(self, _window: Any, _right: float, up: float) -> None:
        now_s = time.monotonic()
        self._wheel_steps += up  # touchpads turn it by parts of a step
        while abs(self._wheel_steps) >= 1.0:
            step = 1.0 if self._wheel_steps > 0.0 else -1.0
            self._wheel_steps -= step
            self.presses.append(KeyPress("wheel_up" if step > 0.0 else "wheel_down", now_s))

    def _on_button(self, _window: Any, button: int, action: int, _modifiers: int) -> None:
        now_s = time.monotonic()
        pointer = self._pointer
        if pointer is not None and pointer.shown and button == glfw.MOUSE_BUTTON_LEFT and action == glfw.PRESS:
            x, y = pointer.place_px
            self.presses.append(KeyPress(f"click_at {x},{y}", now_s))

    def _on_motion(self, _window: Any, x: float, y: float) -> None:
        before_px, self._cursor_px = self._cursor_px, (x, y)
        if self._pointer is not None and before_px is not None:
            self._pointer.move(x - before_px[0], y - before_px[1])
            self.pointed = True

    def _on_enter(self, _window: Any, _entered: int) -> None:
        self._cursor_px = None  # what comes next is where it entered, and no motion


_REFUSED = frozenset({"Cc", "Cs", "Co", "Cn", "Zl", "Zp"})
_BIDIRECTIONAL = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def typed_character(codepoint: int) -> str | None:
    """Return the character of ``codepoint``, None if it is a control character, a direction mark or none at all."""
    try:
        character = chr(codepoint)
    except (ValueError, OverflowError):
        return None
    if unicodedata.category(character) in _REFUSED or character in _BIDIRECTIONAL:
        return None
    return character


PERIOD_S = 0.008

_BUTTONS = MappingProxyType(
    {
        glfw.GAMEPAD_BUTTON_A: "pad_a",
        glfw.GAMEPAD_BUTTON_B: "pad_b",
        glfw.GAMEPAD_BUTTON_X: "pad_x",
        glfw.GAMEPAD_BUTTON_Y: "pad_y",
        glfw.GAMEPAD_BUTTON_LEFT_BUMPER: "pad_left_bumper",
        glfw.GAMEPAD_BUTTON_RIGHT_BUMPER: "pad_right_bumper",
        glfw.GAMEPAD_BUTTON_BACK: "pad_back",
        glfw.GAMEPAD_BUTTON_START: "pad_start",
        glfw.GAMEPAD_BUTTON_DPAD_UP: "pad_up",
        glfw.GAMEPAD_BUTTON_DPAD_RIGHT: "pad_right",
        glfw.GAMEPAD_BUTTON_DPAD_DOWN: "pad_down",
        glfw.GAMEPAD_BUTTON_DPAD_LEFT: "pad_left",
    }
)
_BACK = "pad_back"

# What is down on all gamepads together; None if there is no gamepad.
ReadPads: TypeAlias = Callable[[], frozenset[str] | None]


def read_pads() -> frozenset[str] | None:
    """Return the buttons that are down, by the names that blocks use; None if no gamepad is connected."""
    names: set[str] = set()
    connected = False
    for number in range(glfw.JOYSTICK_LAST + 1):
        if not glfw.joystick_is_gamepad(number):
            continue
        connected = True
        if (state := glfw.get_gamepad_state(number)) is not None:
            names |= {name for button, name in _BUTTONS.items() if state.buttons[button] == glfw.PRESS}
    return frozenset(names) if connected else None


def gamepad_names() -> tuple[str, ...]:
    """Return what the gamepads that are connected are called."""
    pads = (number for number in range(glfw.JOYSTICK_LAST + 1) if glfw.joystick_is_gamepad(number))
    return tuple(_text(glfw.get_gamepad_name(number)) for number in pads)


def _text(name: object) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)


class Gamepads:
    """Reports which buttons went down since it was last asked; Back stands for Escape.

    glfw has no event for a button, so gamepads are read every 8 ms, but only while one is connected and someone waits.
    """

    def __init__(self, read: ReadPads = read_pads) -> None:
        self._read = read
        self._down: frozenset[str] = frozenset()
        self._settled = False

    def settle(self) -> None:
        """Take what is down at the next reading as down for long."""
        self._settled = False

    def presses(self, now_s: float) -> tuple[KeyPress, ...] | None:
        """Return what went down, stamped ``now_s``; None if no gamepad is connected.

        What is down when a gamepad appears, or at the first reading after `settle`, is no press.
        """
        down = self._read()
        if down is None:
            self._settled = False
            return None
        fresh = sorted(down - self._down) if self._settled else []
        self._down, self._settled = down, True
        return tuple(KeyPress("escape" if name == _BACK else name, now_s) for name in fresh)
