"""What a keyboard's keys are called: by what they print, and by their place on an American keyboard."""

from __future__ import annotations

import string
import sys
from types import MappingProxyType

import glfw

NAMED = MappingProxyType(
    {
        glfw.KEY_UP: "up",
        glfw.KEY_DOWN: "down",
        glfw.KEY_LEFT: "left",
        glfw.KEY_RIGHT: "right",
        glfw.KEY_SPACE: "space",
        glfw.KEY_ENTER: "enter",
        glfw.KEY_KP_ENTER: "enter",
        glfw.KEY_ESCAPE: "escape",
        glfw.KEY_TAB: "tab",
        glfw.KEY_BACKSPACE: "backspace",
        glfw.KEY_DELETE: "delete",
        glfw.KEY_INSERT: "insert",
        glfw.KEY_HOME: "home",
        glfw.KEY_END: "end",
        glfw.KEY_PAGE_UP: "page_up",
        glfw.KEY_PAGE_DOWN: "page_down",
        **{glfw.KEY_F1 + number: f"f{number + 1}" for number in range(12)},
        **{glfw.KEY_KP_0 + number: str(number) for number in range(10)},
    }
)
# What the keypad's keys are while NumLock is off.
_WITHOUT_NUM_LOCK = MappingProxyType(
    {
        glfw.KEY_KP_0: "insert",
        glfw.KEY_KP_1: "end",
        glfw.KEY_KP_2: "down",
        glfw.KEY_KP_3: "page_down",
        glfw.KEY_KP_4: "left",
        glfw.KEY_KP_5: "",
        glfw.KEY_KP_6: "right",
        glfw.KEY_KP_7: "home",
        glfw.KEY_KP_8: "up",
        glfw.KEY_KP_9: "page_up",
        glfw.KEY_KP_DECIMAL: "delete",
    }
)
# glfw numbers these by their place, with the character that an American keyboard has there.
_PLACES = MappingProxyType({ord(character): character.lower() for character in string.ascii_uppercase + string.digits})
_COMMANDING = MappingProxyType({glfw.MOD_CONTROL: "ctrl", glfw.MOD_ALT: "alt", glfw.MOD_SUPER: "super"})


def key_names(key: int, scancode: int, modifiers: int) -> tuple[str, str]:
    """Return what a key is called by what it prints, and by its place if that is a digit's or Latin letter's.

    Texts are empty where there is no such name. With Ctrl, Alt or Super a key has a name that answers nothing, such as
    ``ctrl+a``; Shift and CapsLock do not count. Keys of the keypad are arrows while NumLock is off, except on macOS,
    which has no NumLock.
    """
    name = printed(key, scancode) if key not in _WITHOUT_NUM_LOCK else _keypad(key, scancode, modifiers)
    by_place = _PLACES.get(key, "")
    name = name or by_place  # a key that only accents the next character prints nothing by itself
    held = "".join(f"{modifier}+" for mask, modifier in _COMMANDING.items() if modifiers & mask)
    if held:
        return (f"{held}{name}" if name else ""), ""
    return name, "" if by_place == name else by_place


def printed(key: int, scancode: int = -1) -> str:
    """Return what ``key`` prints without Shift, or how it is named; an empty text if it has no name."""
    if key in NAMED:
        return NAMED[key]
    if key == glfw.KEY_UNKNOWN and scancode < 0:
        return ""
    return str(glfw.get_key_name(key, max(scancode, 0)) or "").lower()


def _keypad(key: int, scancode: int, modifiers: int) -> str:
    num_lock = bool(modifiers & glfw.MOD_NUM_LOCK) or sys.platform == "darwin"
    if sys.platform == "linux" and modifiers & glfw.MOD_SHIFT:
        num_lock = not num_lock  # X11 and Wayland: Shift turns it over
    return printed(key, scancode) if num_lock else _WITHOUT_NUM_LOCK[key]
