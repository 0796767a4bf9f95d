"""Opening a surface by the name of its backend."""

from __future__ import annotations

import difflib
from types import MappingProxyType

from documents import Finding
from runner.presenter.depth import Bits
from runner.presenter.errors import PresentationError
from runner.presenter.rectangle import Size
from runner.presenter.surfaces.egl import EglSurface
from runner.presenter.surfaces.surface import Surface


def _egl(size_px: Size, stereo: bool, windowed: bool, windows: int, bits: Bits) -> Surface:
    return EglSurface(size_px, windows, bits)


def _window(size_px: Size, stereo: bool, windowed: bool, windows: int, bits: Bits) -> Surface:
    if windows == 2:
        from runner.presenter.surfaces.dual_window import DualWindowSurface

        return DualWindowSurface(size_px, windowed=windowed, bits=bits)
    from runner.presenter.surfaces.window import WindowSurface

    return WindowSurface(size_px, stereo=stereo, windowed=windowed, bits=bits)


def _null(size_px: Size, stereo: bool, windowed: bool, windows: int, bits: Bits) -> Surface:
    from runner.presenter.surfaces.null_window import NullWindowSurface

    return NullWindowSurface(size_px, bits)


BACKENDS = MappingProxyType({"egl": _egl, "null": _null, "window": _window})


def open_surface(
    backend: str,
    size_px: Size,
    *,
    stereo: bool = False,
    windowed: bool = False,
    windows: int = 1,
    bits: Bits = 8,
) -> Surface:
    """Open a surface of ``size_px``: ``egl`` (offscreen), ``null`` (a window without a screen) or ``window``.

    ``stereo`` asks for a right back buffer; whether there is one, the surface's ``stereo`` says. ``windowed`` keeps
    a window from filling the screen. Two ``windows`` are one for each eye, and two offscreen pictures with ``egl``.
    ``bits`` asks for codes of 8 bits a channel or 10; where there are not 10, the codes have 8, and ``facts`` says so
    in ``bits`` and a remark.

    Raises
    ------
    PresentationError
        If there is no such backend, ``bits`` is neither 8 nor 10, or this machine cannot open it: with what to
        install or use instead.
    """
    if backend not in BACKENDS:
        near = difflib.get_close_matches(backend, BACKENDS, n=1)
        remedy = f"did you mean '{near[0]}'?" if near else "expected one of: " + ", ".join(BACKENDS)
        raise PresentationError(Finding(f"there is no backend '{backend}'", remedy=remedy))
    return BACKENDS[backend](size_px, stereo, windowed, windows, bits)
