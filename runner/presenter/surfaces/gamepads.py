"""Gamepads: glfw tells of no button, so they are read every 8 ms, but only while there is one and someone waits."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import TypeAlias

import glfw

from runner.ports import KeyPress

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
    found = False
    for number in range(glfw.JOYSTICK_LAST + 1):
        if not glfw.joystick_is_gamepad(number):
            continue
        found = True
        if (state := glfw.get_gamepad_state(number)) is not None:
            names |= {name for button, name in _BUTTONS.items() if state.buttons[button] == glfw.PRESS}
    return frozenset(names) if found else None


def gamepad_names() -> tuple[str, ...]:
    """Return what the gamepads that are connected are called."""
    pads = (number for number in range(glfw.JOYSTICK_LAST + 1) if glfw.joystick_is_gamepad(number))
    return tuple(_words(glfw.get_gamepad_name(number)) for number in pads)


def _words(name: object) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)


class Gamepads:
    """Tells which buttons went down since it was last asked; Back stands for Escape."""

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
