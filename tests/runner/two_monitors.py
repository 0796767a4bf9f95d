"""A second monitor for glfw: a laptop's, the primary one, beside the real one of a virtual screen."""

from __future__ import annotations

import ctypes
from collections import namedtuple
from types import SimpleNamespace
from typing import Any

import glfw

Size = namedtuple("Size", ["width", "height"])
LAPTOP = SimpleNamespace(
    name=b"eDP-1", size=(1366, 768), hz=60, place=(-1366, 0), mm=(344, 194), contents=ctypes.c_int()
)


def add_laptop() -> None:
    """Let glfw list a laptop's monitor before those that there are; it never draws on it."""

    def of_laptop(name: str, value: Any) -> None:
        real = getattr(glfw, name)
        setattr(glfw, name, lambda handle: value if handle is LAPTOP else real(handle))

    there = glfw.get_monitors
    setattr(glfw, "get_monitors", lambda: [LAPTOP, *there()])  # noqa: B010 # the stubs let nobody change it
    of_laptop("get_monitor_name", LAPTOP.name)
    of_laptop("get_video_mode", SimpleNamespace(size=Size(*LAPTOP.size), refresh_rate=LAPTOP.hz))
    of_laptop("get_monitor_pos", LAPTOP.place)
    of_laptop("get_monitor_physical_size", LAPTOP.mm)
    ramp = [index / 255 for index in range(256)]
    of_laptop("get_gamma_ramp", SimpleNamespace(red=ramp, green=ramp, blue=ramp))
