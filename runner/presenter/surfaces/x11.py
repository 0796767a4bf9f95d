"""What the X server alone knows: who composes its windows, whether it is Xwayland, which colour profiles are set."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

LOST = "the connection to the X server was lost: it ended, or another program closed the window by force"
# Profiles of look-up tables have some megabytes.
_MOST_LONGS = 16 * 1024 * 1024 // 4


@contextmanager
def _x_server() -> Iterator[tuple[Any, Any] | None]:
    """Open the X server for a moment: libX11 and the display, None where there is none."""
    library = ctypes.util.find_library("X11") if sys.platform == "linux" else None
    x11 = ctypes.CDLL(library) if library else None
    if x11 is None:
        yield None
        return
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XInternAtom.restype = x11.XGetSelectionOwner.restype = x11.XDefaultRootWindow.restype = ctypes.c_ulong
    x11.XInternAtom.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]
    x11.XGetSelectionOwner.argtypes = [ctypes.c_void_p, ctypes.c_ulong]
    x11.XQueryExtension.argtypes = [ctypes.c_void_p, ctypes.c_char_p, *[ctypes.POINTER(ctypes.c_int)] * 3]
    x11.XGetWindowProperty.argtypes = [
        *(ctypes.c_void_p, ctypes.c_ulong, ctypes.c_ulong, ctypes.c_long, ctypes.c_long, ctypes.c_int, ctypes.c_ulong),
        *(ctypes.POINTER(ctypes.c_ulong), ctypes.POINTER(ctypes.c_int)),
        *(ctypes.POINTER(ctypes.c_ulong), ctypes.POINTER(ctypes.c_ulong), ctypes.POINTER(ctypes.c_void_p)),
    ]
    x11.XFree.argtypes = [ctypes.c_void_p]
    x11.XDefaultRootWindow.argtypes = x11.XDefaultScreen.argtypes = x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        yield None
        return
    try:
        yield x11, display
    finally:
        x11.XCloseDisplay(display)


def watch_server(lost: Callable[[], object]) -> Callable[[], None] | None:
    """Call ``lost`` and end the process with status 1 if the X server goes away; return what stops watching for it.

    Xlib would print a text of its own and end the process; it cannot be left in any other way, and glfw would wait for
    ever on a connection that is gone. None without Xlib.
    """
    library = ctypes.util.find_library("X11") if sys.platform == "linux" else None
    if library is None:
        return None
    x11 = ctypes.CDLL(library)

    def end(_display: int | None) -> int:
        try:
            lost()
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
        finally:
            os._exit(1)

    handler = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)(end)
    x11.XSetIOErrorHandler.restype = ctypes.c_void_p
    x11.XSetIOErrorHandler.argtypes = [ctypes.c_void_p]
    before = x11.XSetIOErrorHandler(ctypes.cast(handler, ctypes.c_void_p))

    def stop() -> None:
        x11.XSetIOErrorHandler(before)
        _ = handler  # Xlib calls it until now

    return stop


def compositing_manager() -> bool | None:
    """Return whether the selection that compositing managers own has an owner (EWMH, _NET_WM_CM_Sn); None: unknown."""
    with _x_server() as opened:
        if opened is None:
            return None
        x11, display = opened
        atom = x11.XInternAtom(display, f"_NET_WM_CM_S{x11.XDefaultScreen(display)}".encode(), 0)
        return bool(x11.XGetSelectionOwner(display, atom))


def is_xwayland() -> bool:
    """Return whether the X server is Xwayland, which says so by an extension."""
    with _x_server() as opened:
        if opened is None:
            return False
        x11, display = opened
        told = [ctypes.byref(ctypes.c_int()) for _ in range(3)]
        return bool(x11.XQueryExtension(display, b"XWAYLAND", *told))


def colour_profiles() -> tuple[bytes, ...] | None:
    """Return the ICC profiles that a colour manager has set for the monitors (_ICC_PROFILE, _ICC_PROFILE_1, ...).

    None without an X server.
    """
    with _x_server() as opened:
        if opened is None:
            return None
        names = ["_ICC_PROFILE", *(f"_ICC_PROFILE_{number}" for number in range(1, 8))]
        found = (_root_property(*opened, name) for name in names)
        return tuple(profile for profile in found if profile)


def _root_property(x11: Any, display: Any, name: str) -> bytes:
    """Return the bytes of a property of the root window, none if it is not there."""
    atom = x11.XInternAtom(display, name.encode(), 1)
    if not atom:
        return b""
    kind, count, left = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_ulong()
    unit, data = ctypes.c_int(), ctypes.c_void_p()
    told = [ctypes.byref(value) for value in (kind, unit, count, left, data)]
    root = x11.XDefaultRootWindow(display)
    if x11.XGetWindowProperty(display, root, atom, 0, _MOST_LONGS, 0, 0, *told) != 0 or not data:
        return b""
    try:
        return ctypes.string_at(data, count.value) if unit.value == 8 else b""
    finally:
        x11.XFree(data)
