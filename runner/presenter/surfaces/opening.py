"""Where to draw, by its name: off the screen, in a window that nobody sees, or in a window."""

from __future__ import annotations

from collections.abc import Sequence

from devices.compensation import Size
from documents import Finding
from documents.text import did_you_mean
from runner.presenter.depth import Bits
from runner.presenter.errors import PresentationError
from runner.presenter.surfaces.surface import Surface

BACKENDS = ("egl", "null", "window")


def open_surface(
    backend: str,
    size_px: Size,
    *,
    stereo: bool = False,
    windowed: bool = False,
    windows: int = 1,
    bits: Bits = 8,
    identity: bool = False,
    monitors: Sequence[str] = (),
    refuse_larger: bool = False,
) -> Surface:
    """Open what scenes are drawn to: a window, or a framebuffer without one.

    Parameters
    ----------
    backend
        ``egl`` (offscreen; on Windows and macOS this is WGL or CGL), ``null`` (a window without a screen) or
        ``window``.
    size_px
        Width and height in pixels.
    stereo
        Whether to ask for a right back buffer; the surface's ``stereo`` is whether there is one.
    windowed
        Whether to keep a window from filling the screen.
    windows
        1, or 2 for one window for each eye; with ``egl``, two offscreen pictures.
    bits
        Bits of a channel's codes to ask for, 8 or 10. Where there are not 10, codes have 8, and ``facts`` has a remark.
    identity
        Whether a window's monitors get the identity as gamma table until it is closed; then what was there comes back.
    monitors
        The monitor for a window, or the two for two windows, the left eye's first, by name or number as
        `cyclopean doctor` lists them. None named: the first of ``size_px``.
    refuse_larger
        Whether to refuse a window that is larger than its screen. If not, ``facts`` has a remark.

    Returns
    -------
    Surface
        A context manager, whose OpenGL context is current until it is closed.

    Raises
    ------
    PresentationError
        If there is no such backend or monitor, ``bits`` is neither 8 nor 10, or this machine cannot open it: with what
        to install or use instead.

    Examples
    --------
    >>> with open_surface("egl", (640, 480)) as surface:
    ...     print(surface.size_px, surface.facts.bits)
    (640, 480) 8
    """
    if backend not in BACKENDS:
        remedy = did_you_mean(backend, BACKENDS)
        raise PresentationError(Finding(f"there is no backend '{backend}'", remedy=remedy))
    if backend == "egl":
        from runner.presenter.surfaces.egl import EglSurface

        return EglSurface(size_px, windows, bits)
    from runner.presenter.surfaces import windows as on_glfw

    if backend == "null":
        return on_glfw.NullWindowSurface(size_px, bits)
    if windows == 2:
        return on_glfw.DualWindowSurface(
            size_px, windowed=windowed, bits=bits, identity=identity, monitors=monitors, refuse_larger=refuse_larger
        )
    return on_glfw.WindowSurface(
        size_px,
        stereo=stereo,
        windowed=windowed,
        bits=bits,
        identity=identity,
        monitors=monitors,
        refuse_larger=refuse_larger,
    )
