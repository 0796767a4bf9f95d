"""What a keyboard's keys are called: by what they print, and by their place on an American keyboard."""

from __future__ import annotations

import string
import sys
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
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
# Keys that may print something, without those of the keypad, which not every keyboard has.
_ROWS = range(glfw.KEY_APOSTROPHE, glfw.KEY_WORLD_2 + 1)
_KEYPAD_SIGNS = range(glfw.KEY_KP_DECIMAL, glfw.KEY_KP_EQUAL + 1)
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


@dataclass(frozen=True, slots=True)
class Keyboard:
    """The keyboard here: ``labels`` as of `keyboard_labels`, and which of the keys asked for it cannot send."""

    labels: dict[str, str]
    cannot_send: tuple[str, ...]


def examine_keyboard(keys: Iterable[str]) -> Keyboard:
    """Return what the keyboard prints and which of ``keys`` it cannot send; no window is opened.

    Raises
    ------
    PresentationError
        If there is no display server, or a window is open already.
    """
    from runner.presenter.surfaces.glfw_session import GlfwSession

    session = GlfwSession()
    try:
        return Keyboard(keyboard_labels(), tuple(key for key in keys if not _sends(key)))
    finally:
        session.close()


def keyboard_labels() -> dict[str, str]:
    """Return what keys print at the places of those digits and Latin letters that no key prints without Shift.

    Such as ``&`` for ``1`` on a French keyboard, and ``Т`` for ``n`` on a Russian one. glfw must be initialised.
    """
    there = _printed_here(_ROWS)
    labels = {}
    for key, name in _PLACES.items():
        label = there.get(key, "")
        if name.isalpha() and len(label.upper()) == 1:
            label = label.upper()  # as it stands on the key
        if label and name not in there.values() and not unicodedata.category(label[0]).startswith("M"):
            labels[name] = label
    return labels


def _sends(name: str) -> bool:
    """Return whether a key here counts as ``name``; what is no key, as a gamepad's button, is not asked about."""
    if len(name) == 1:
        return name in _PLACES.values() or name in _printed_here((*_ROWS, *_KEYPAD_SIGNS)).values()
    named = [key for key, called in NAMED.items() if called == name]
    return not named or any(glfw.get_key_scancode(key) != -1 for key in named)


def _printed_here(keys: Iterable[int]) -> dict[int, str]:
    return {key: printed(key) for key in keys if glfw.get_key_scancode(key) != -1}
