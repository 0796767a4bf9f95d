"""Keys of glfw by the names that blocks use: ``up``, ``space``, ``enter``, ``escape``, ``a``, ``1``."""

from __future__ import annotations

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


def key_name(key: int, scancode: int) -> str | None:
    """Return the name of a key; a letter or digit is named as the keyboard's layout has it. None if it has none."""
    if key in NAMED:
        return NAMED[key]
    if key == glfw.KEY_UNKNOWN and scancode < 0:
        return None
    printed = glfw.get_key_name(key, scancode)
    return str(printed).lower() if printed else None
