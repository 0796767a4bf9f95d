"""Whether something stands between a window and the screen: timing depends on it, so a record must say so."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys


def compositor() -> str:
    """Return in a few words which compositor the windows of this process go through, as far as can be told."""
    if sys.platform != "linux":
        return "the system's own"
    if os.environ.get("WAYLAND_DISPLAY"):
        return f"Wayland compositor ({os.environ.get('XDG_CURRENT_DESKTOP') or 'unnamed'})"
    if not os.environ.get("DISPLAY"):
        return "none (no display server)"
    found = _x11_compositing_manager()
    if found is None:
        return "X11; a compositing manager cannot be told"
    return "X11 with a compositing manager" if found else "X11 without a compositing manager"


def _x11_compositing_manager() -> bool | None:
    """Return whether the selection that compositing managers own has an owner (EWMH, _NET_WM_CM_Sn)."""
    library = ctypes.util.find_library("X11")
    if library is None:
        return None
    x11 = ctypes.CDLL(library)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XInternAtom.restype = ctypes.c_ulong
    x11.XInternAtom.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]
    x11.XGetSelectionOwner.restype = ctypes.c_ulong
    x11.XGetSelectionOwner.argtypes = [ctypes.c_void_p, ctypes.c_ulong]
    x11.XDefaultScreen.argtypes = x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        return None
    try:
        atom = x11.XInternAtom(display, f"_NET_WM_CM_S{x11.XDefaultScreen(display)}".encode(), 0)
        return bool(x11.XGetSelectionOwner(display, atom))
    finally:
        x11.XCloseDisplay(display)
