"""Opening a surface by the name of its backend."""

from __future__ import annotations

import difflib
from types import MappingProxyType

from documents import Finding
from runner.presenter.errors import PresentationError
from runner.presenter.rectangle import Size
from runner.presenter.surfaces.egl import EglSurface
from runner.presenter.surfaces.surface import Surface


def _egl(size_px: Size, stereo: bool, windowed: bool, windows: int) -> Surface:
    return EglSurface(size_px, windows)


def _window(size_px: Size, stereo: bool, windowed: bool, windows: int) -> Surface:
    if windows == 2:
        from runner.presenter.surfaces.dual_window import DualWindowSurface

        return DualWindowSurface(size_px, windowed=windowed)
    from runner.presenter.surfaces.window import WindowSurface

    return WindowSurface(size_px, stereo=stereo, windowed=windowed)


def _null(size_px: Size, stereo: bool, windowed: bool, windows: int) -> Surface:
    from runner.presenter.surfaces.null_window import NullWindowSurface

    return NullWindowSurface(size_px)


BACKENDS = MappingProxyType({"egl": _egl, "null": _null, "window": _window})


def open_surface(
    backend: str, size_px: Size, *, stereo: bool = False, windowed: bool = False, windows: int = 1
) -> Surface:
    """Open a surface of ``size_px``: ``egl`` (offscreen), ``null`` (a window without a screen) or ``window``.

    ``stereo`` asks for a right back buffer; whether there is one, the surface's ``stereo`` says. ``windowed`` keeps
    a window from filling the screen. Two ``windows`` are one for each eye, and two offscreen pictures with ``egl``.

    Raises
    ------
    PresentationError
        If there is no such backend, or this machine cannot open it: with what to install or use instead.
    """
    if backend not in BACKENDS:
        near = difflib.get_close_matches(backend, BACKENDS, n=1)
        remedy = f"did you mean '{near[0]}'?" if near else "expected one of: " + ", ".join(BACKENDS)
        raise PresentationError(Finding(f"there is no backend '{backend}'", remedy=remedy))
    return BACKENDS[backend](size_px, stereo, windowed, windows)
